//! Replays to the bit, of journals and of the logs they lie beside.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use recording::{JournalLink, Reader as LogReader, WorldState};
use schemas::Tick;
use world_service::journal::{Difference, JournalError, Replayed, TickEntry, verify as replay_all};

use super::progress::Progress;
use super::source::{Opened, file, of, open, open_journal};
use super::{RecordError, log};

/// What is to be replayed.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Exact {
    /// A journal, or a log of CARLA's format with a journal beside it
    file: PathBuf,
    /// The journal of a log that does not lie beside it [default: FILE.journal]
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
}

/// Reads a log, or replays a journal.
///
/// # Errors
/// A file that is neither, is cut or damaged, or differs.
pub(super) fn verify(path: &Path) -> Result<(), RecordError> {
    match open(path)? {
        Opened::Log(reader) => Ok(log::verify(path, reader)?),
        Opened::Journal(_) => replay_journal(path, None),
    }
}

/// # Errors
/// A file that is neither, a log without a journal, or a difference.
pub(super) fn replay(order: &Exact) -> Result<(), RecordError> {
    match open(&order.file)? {
        Opened::Journal(_) => replay_journal(&order.file, None),
        Opened::Log(reader) => {
            let log = States::begin(&order.file, reader)?;
            let beside = || {
                let mut name = order.file.clone().into_os_string();
                name.push(".journal");
                PathBuf::from(name)
            };
            let journal = order.journal.clone().unwrap_or_else(beside);
            if open_journal(&journal)?.head().digest() != log.link.digest {
                let why = format!("wanted the journal that {:?} names, found another", order.file);
                return Err(RecordError::Unfit { path: journal, why });
            }
            replay_journal(&journal, Some(log))
        }
    }
}

fn replay_journal(path: &Path, mut log: Option<States>) -> Result<(), RecordError> {
    let total_secs = open_journal(path)?.index().total_secs();
    let mut progress = Progress::new("replayed", total_secs);
    let mut first_secs = None;
    let replayed = replay_all(file(path)?, |tick| {
        let since_secs = *first_secs.get_or_insert(tick.moment.sim_secs);
        progress.reach(tick.moment.sim_secs - since_secs);
        log.as_mut().map_or(Ok(()), |log| log.compare(tick))
    });
    let replayed = replayed.map_err(of(path))?;
    let speed = progress.speed();
    drop(progress);
    tell(path, &replayed, speed);
    match log {
        None => Ok(()),
        Some(log) => log.finish(replayed.last),
    }
}

fn tell(path: &Path, told: &Replayed, speed: f64) {
    let Replayed { map, first, last, commands, keyframes, ended } = told;
    let end = if *ended { "" } else { "; it ends with its process" };
    println!(
        "{}: {first} to {last} on {map}, {commands} commands, {keyframes} keyframes: the same to \
         the bit, {speed:.0} × real time{end}",
        path.display(),
    );
}

/// The states that a log names, frame after frame.
struct States {
    path: PathBuf,
    reader: LogReader<BufReader<File>>,
    link: JournalLink,
    next: Option<WorldState>,
    compared: u64,
}

impl States {
    fn begin(path: &Path, mut reader: LogReader<BufReader<File>>) -> Result<Self, RecordError> {
        let unfit = |why: &str| RecordError::Unfit { path: path.to_owned(), why: why.to_owned() };
        let first = reader.next_frame().map_err(|cause| unfit(&cause.to_string()))?;
        let first = first.ok_or_else(|| unfit("a log without frames"))?;
        let link = JournalLink::of(&first).ok_or_else(|| {
            unfit(
                "wanted a log with a journal beside it, found one that names none: its poses are \
                 replayed by `replay_file` of CARLA's client only",
            )
        })?;
        let next = WorldState::of(&first);
        Ok(Self { path: path.to_owned(), reader, link, next, compared: 0 })
    }

    fn compare(&mut self, tick: &TickEntry) -> Result<(), JournalError> {
        let Some(state) = self.next.filter(|state| state.tick == tick.moment.tick.0) else {
            return Ok(());
        };
        if state.state_hash != tick.moment.state_hash {
            return Err(JournalError::Differs(Box::new(Difference {
                tick: Tick(state.tick),
                actor: None,
                field: "state hash of the log",
                recorded: format!("{:016x}", state.state_hash),
                replayed: format!("{:016x}", tick.moment.state_hash),
            })));
        }
        self.compared += 1;
        self.next = self.reader.next_frame()?.and_then(|frame| WorldState::of(&frame));
        Ok(())
    }

    fn finish(self, last: Tick) -> Result<(), RecordError> {
        if let Some(state) = self.next {
            let why = format!("its frame of tick {} is not in the journal: {last}", state.tick);
            return Err(RecordError::Unfit { path: self.path, why });
        }
        println!("{}: {} frames, 0 differences", self.path.display(), self.compared);
        Ok(())
    }
}
