//! Journals made again from MCAP files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::time::Instant;

use mcap_export::{COMMANDS, Done, FRAMES, Item, ORIGIN, Origin, ReadError, Reader, SNAPSHOT};
use schemas::wire::{decode_frame, decode_request};
use schemas::{EncodedFrame, Request, Tick};
use world_service::journal::{Entry, Head, Moment, Pace, Replay, Step, TickEntry, Writer};

use super::RecordError;
use super::piece::NewFile;
use super::progress::Progress;
use super::source::{file, of};

/// What maps are called in a file.
const MAP_EXTENSION: &str = ".xodr";

/// What is to be imported.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Import {
    /// An MCAP file to which every tick of a journal was exported
    file: PathBuf,
    /// The new journal; one that is there is never replaced
    #[arg(long, value_name = "FILE.journal")]
    to: PathBuf,
}

/// A journal that is being made again.
struct Made {
    writer: Writer<NewFile>,
    replay: Replay,
    /// Before the next frame.
    done: Done,
    last: Tick,
    first_secs: f64,
    ticks: u64,
    /// Of its keyframes.
    pace: Pace,
}

/// # Errors
/// A file of another program, one of which parts are missing, a world that goes another way, and a
/// new file that cannot be written.
pub(super) fn import(order: &Import) -> Result<(), RecordError> {
    let mut reader = Reader::open(file(&order.file)?).map_err(order.damaged())?;
    let mut made = order.begin(&mut reader)?;
    // How long it is nobody knows before its end.
    let mut progress = Progress::new("imported", f64::INFINITY);
    while let Some(item) = reader.next_item().map_err(order.damaged())? {
        let Item::Message { topic, data } = item else { continue };
        match topic.as_str() {
            COMMANDS => {
                let done = Done::of(&data);
                made.done =
                    done.ok_or_else(|| order.unfit("what was done cannot be read".to_owned()))?;
            }
            FRAMES => progress.reach(order.tick(&mut made, data)?),
            _ => {}
        }
    }
    if made.ticks == 0 {
        return Err(order.unfit("wanted frames, found none".to_owned()));
    }
    let ticks = made.ticks;
    let out = made.writer.finish().map_err(|cause| order.unwritten(cause))?;
    out.keep()?;
    println!("{}: {ticks} ticks, the same to the bit", order.to.display());
    Ok(())
}

impl Import {
    /// Reads what comes before the first frame.
    fn begin(&self, reader: &mut Reader<BufReader<File>>) -> Result<Made, RecordError> {
        let mut map = None;
        let mut snapshot = None;
        let mut origin = None;
        // Those are the first things in a file.
        while let Some(item) = reader.next_item().map_err(self.damaged())? {
            match item {
                Item::Attachment { name, data } if name == SNAPSHOT => snapshot = Some(data),
                Item::Attachment { name, data } => {
                    let text = String::from_utf8(data).ok();
                    map = name.strip_suffix(MAP_EXTENSION).map(str::to_owned).zip(text).or(map);
                }
                Item::Metadata { name, told } if name == ORIGIN => {
                    origin = Some(told);
                    break;
                }
                Item::Metadata { .. } => {}
                Item::Message { .. } => break,
            }
        }
        let parts = map.zip(snapshot).zip(origin);
        let Some((((map_name, map_text), snapshot), told)) = parts else {
            let topics: Vec<&str> = reader.topics().collect();
            let why = format!(
                "wanted a file to which every tick of a journal was exported, found one with the \
                 topics {}",
                topics.join(", ")
            );
            return Err(self.unfit(why));
        };
        self.began(&map_name, map_text, snapshot, &told)
    }

    fn began(
        &self,
        map_name: &str,
        map_text: String,
        snapshot: Vec<u8>,
        told: &BTreeMap<String, String>,
    ) -> Result<Made, RecordError> {
        let origin = Origin::of(told, snapshot)
            .ok_or_else(|| self.unfit("its first state has no moment".to_owned()))?;
        let Origin { tick, sim_secs, state_hash, snapshot } = origin;
        let first = Moment { tick: Tick(tick), sim_secs, state_hash };
        let head = Head { map_name: map_name.to_owned(), map_text, snapshot, first };
        let replay = Replay::begin(&head).map_err(of(&self.file))?;
        let writer = Writer::begin(NewFile::create(&self.to)?, u64::MAX, &head);
        let writer = writer.map_err(|cause| self.unwritten(cause))?;
        let (done, last, first_secs) = (Done::default(), first.tick, first.sim_secs);
        Ok(Made { writer, replay, done, last, first_secs, ticks: 0, pace: Pace::default() })
    }

    /// Does again what led to a frame, and compares it; gives the seconds since the beginning.
    fn tick(&self, made: &mut Made, frame: Vec<u8>) -> Result<f64, RecordError> {
        let decoded = decode_frame(&frame).map_err(RecordError::Refused)?;
        let done = std::mem::take(&mut made.done);
        let moment = Moment::of(&decoded);
        if moment.tick != Tick(made.last.0 + 1) {
            let (wanted, found) = (made.last.0 + 1, moment.tick);
            return Err(self.unfit(format!("wanted tick {wanted}, found {found}")));
        }
        made.last = moment.tick;
        let is_of_it = done.tick == moment.tick.0 || done == Done::default();
        if !is_of_it {
            let (wanted, found) = (moment.tick, done.tick);
            return Err(
                self.unfit(format!("wanted what was done for tick {wanted}, found {found}"))
            );
        }
        for request in done.requests {
            let commands = match decode_request(&request).map_err(RecordError::Refused)? {
                Request::RunCommands { commands, .. } => commands,
                _ => return Err(self.unfit("a request that is no commands".to_owned())),
            };
            made.replay.step(&Step::Commands(commands)).map_err(of(&self.file))?;
            self.write(made, &Entry::Commands(request))?;
        }
        let wanted_secs = done.wanted_secs;
        let entry = TickEntry { wanted_secs, moment, frame: EncodedFrame(frame) };
        let began = Instant::now();
        made.replay.step(&Step::Tick(entry.clone())).map_err(of(&self.file))?;
        let is_due = made.pace.tick(began.elapsed());
        self.write(made, &Entry::Tick(entry))?;
        made.ticks += 1;
        if is_due {
            let snapshot = made.replay.world().snapshot();
            self.write(made, &Entry::Keyframe { moment, snapshot })?;
        }
        Ok(moment.sim_secs - made.first_secs)
    }

    fn write(&self, made: &mut Made, entry: &Entry) -> Result<(), RecordError> {
        made.writer.write(entry).map_err(|cause| self.unwritten(cause))
    }

    fn damaged(&self) -> impl Fn(ReadError) -> RecordError {
        |cause| RecordError::Mcap { path: self.file.clone(), cause }
    }

    fn unfit(&self, why: String) -> RecordError {
        RecordError::Unfit { path: self.file.clone(), why }
    }

    fn unwritten(&self, cause: std::io::Error) -> RecordError {
        RecordError::Write { path: self.to.clone(), cause }
    }
}
