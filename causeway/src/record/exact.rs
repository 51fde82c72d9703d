//! Replays to the bit, of journals and of the logs they lie beside.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufReader};
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
        Opened::Journal(_) => replay_journal(path, None).map(drop),
    }
}

/// # Errors
/// A file that is neither, a log without a journal, or a difference.
pub(super) fn replay(order: &Exact) -> Result<(), RecordError> {
    match open(&order.file)? {
        Opened::Journal(_) => replay_journal(&order.file, None).map(drop),
        Opened::Log(reader) => replay_log(order, reader),
    }
}

/// Replays the journals of a log, one after the other.
fn replay_log(order: &Exact, reader: LogReader<BufReader<File>>) -> Result<(), RecordError> {
    let mut log = States::begin(&order.file, reader)?;
    let first = order.journal.clone().unwrap_or_else(|| with_end(&order.file, "journal"));
    let mut number = 1;
    loop {
        let path = match number {
            1 => first.clone(),
            _ => with_end(&first.with_extension(""), &format!("{number}.journal")),
        };
        if open_journal(&path)?.head().digest() != log.link.digest {
            let why = format!("wanted the journal that {:?} names, found another", order.file);
            return Err(RecordError::Unfit { path, why });
        }
        let last = replay_journal(&path, Some(&mut log))?;
        if !log.go_on()? {
            return log.finish(last);
        }
        number += 1;
    }
}

fn with_end(path: &Path, end: &str) -> PathBuf {
    let mut name = path.to_owned().into_os_string();
    name.push(".");
    name.push(end);
    PathBuf::from(name)
}

/// Replays a journal to its last tick, and compares the states of a log.
fn replay_journal(path: &Path, mut log: Option<&mut States>) -> Result<Tick, RecordError> {
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
    Ok(replayed.last)
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
    /// The journal that has the next ones.
    link: JournalLink,
    /// Those that frames name that were read later.
    following: VecDeque<JournalLink>,
    /// Of frames that were read, but not compared.
    next: VecDeque<WorldState>,
    compared: u64,
    /// Those of ticks that no journal has.
    missing: u64,
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
        let next = WorldState::of(&first).into_iter().collect();
        let (path, following) = (path.to_owned(), VecDeque::new());
        Ok(Self { path, reader, link, following, next, compared: 0, missing: 0 })
    }

    /// Reads one more frame; `false` at the end.
    fn read(&mut self) -> io::Result<bool> {
        let Some(frame) = self.reader.next_frame()? else { return Ok(false) };
        self.next.extend(WorldState::of(&frame));
        self.following.extend(JournalLink::of(&frame));
        Ok(true)
    }

    fn compare(&mut self, tick: &TickEntry) -> Result<(), JournalError> {
        let next = self.next.front().copied();
        let Some(state) = next.filter(|state| state.tick == tick.moment.tick.0) else {
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
        self.next.pop_front();
        if self.next.is_empty() {
            self.read()?;
        }
        Ok(())
    }

    /// Whether another journal has frames that are left. Those before it that were not compared are
    /// of ticks that the one before lost with its world service.
    fn go_on(&mut self) -> Result<bool, RecordError> {
        if self.next.is_empty() {
            return Ok(false);
        }
        while self.following.is_empty() {
            let read = self.read();
            let refused = |cause| RecordError::Open { path: self.path.clone(), cause };
            if !read.map_err(refused)? {
                return Ok(false);
            }
        }
        let Some(link) = self.following.pop_front() else { return Ok(false) };
        let before = self.next.len();
        self.next.retain(|state| state.tick > link.tick);
        self.missing += (before - self.next.len()) as u64;
        self.link = link;
        Ok(true)
    }

    fn finish(self, last: Tick) -> Result<(), RecordError> {
        if let Some(state) = self.next.front() {
            let why = format!("its frame of tick {} is not in the journal: {last}", state.tick);
            return Err(RecordError::Unfit { path: self.path, why });
        }
        println!("{}: {} frames, 0 differences", self.path.display(), self.compared);
        if self.missing > 0 {
            println!(
                "{} frames more are in no journal: their world service ended without an end",
                self.missing
            );
        }
        Ok(())
    }
}
