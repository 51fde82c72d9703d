//! Where each frame of a log lies, and what holds there, so that a replay can begin anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::sync::Arc;

use crate::journal::JournalLink;
use crate::packet::{Kind, Packet};
use crate::reader::{Frame, Reader};
use crate::record::{Add, Door, Parent, SceneLight, Weather};

/// Frames from one keyframe to the next, as long as there is room for that.
const KEYFRAME_INTERVAL: usize = 1_000;
/// What all keyframes keep together: an hour of 10,000 actors, and at most some 100 MB of memory.
const KEPT_MAX: usize = 1_000_000;
/// What lasts at one time.
const LASTING_MAX: usize = 250_000;
/// Bytes of names and attributes of the actors that live at one time.
const LIVING_BYTES_MAX: usize = 64 * 1024 * 1024;
/// Frames of one log: two days at 20 Hz, and 64 MB of memory.
const FRAMES_MAX: usize = 4_000_000;
/// Journals of one log that are known; later ones are not.
const JOURNALS_MAX: usize = 1_000;

/// What happens to actors, in the order of the log.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// An actor is there from now on.
    Add(Arc<Add>),
    /// It is gone from now on.
    Destroy(u32),
    /// It is attached from now on.
    Parent(Parent),
}

/// What was said before a frame and holds until something else is said.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cast {
    pub(crate) actors: BTreeMap<u32, Arc<Add>>,
    pub(crate) parents: BTreeMap<u32, u32>,
    pub(crate) lamps: BTreeMap<i32, SceneLight>,
    pub(crate) doors: BTreeMap<(u32, u8), bool>,
    pub(crate) weather: Option<Weather>,
    /// Of names and attributes of the actors.
    bytes: usize,
}

impl Cast {
    /// Whether packets of this kind say something lasting.
    pub(crate) fn heeds(kind: Kind) -> bool {
        matches!(kind, Kind::Adds | Kind::Destroys | Kind::Parents)
            || matches!(kind, Kind::SceneLights | Kind::Doors | Kind::Weather)
    }

    pub(crate) fn note(&mut self, packet: &Packet) {
        match packet {
            Packet::Adds(adds) => adds.iter().for_each(|add| self.enter(Arc::new(add.clone()))),
            Packet::Destroys(gone) => {
                for one in gone {
                    let gone = self.actors.remove(&one.id);
                    self.bytes -= gone.map_or(0, |add| bytes_of(&add));
                    self.parents.remove(&one.id);
                    self.doors.retain(|(id, _), _| *id != one.id);
                }
            }
            Packet::Parents(parents) => {
                self.parents.extend(parents.iter().map(|one| (one.child, one.parent)));
            }
            Packet::SceneLights(lamps) => {
                self.lamps.extend(lamps.iter().map(|lamp| (lamp.id, lamp.clone())));
            }
            Packet::Doors(doors) => {
                self.doors.extend(doors.iter().map(|door| ((door.id, door.door), door.is_open)));
            }
            Packet::Weather(weather) => self.weather = Some(*weather),
            _ => {}
        }
    }

    /// An actor is there from now on.
    pub(crate) fn enter(&mut self, add: Arc<Add>) {
        self.bytes += bytes_of(&add);
        let before = self.actors.insert(add.id, add);
        self.bytes -= before.map_or(0, |add| bytes_of(&add));
    }

    /// How much there is to keep in mind.
    fn len(&self) -> usize {
        self.actors.len() + self.parents.len() + self.lamps.len() + self.doors.len()
    }

    /// # Errors
    /// More lasts than a log can have to be replayed.
    fn check(&self) -> io::Result<()> {
        let bounds = [
            (self.len(), LASTING_MAX, "actors, lamps and doors at a time"),
            (self.bytes, LIVING_BYTES_MAX, "bytes of attributes at a time"),
        ];
        for (found, limit, what) in bounds {
            if found > limit {
                let why = format!("wanted a recording of at most {limit} {what}, found more");
                return Err(io::Error::other(why));
            }
        }
        Ok(())
    }

    /// Everything that lasts and is no event.
    pub(crate) fn said(&self) -> Vec<Packet> {
        let door = |(&(id, door), &is_open): (&(u32, u8), &bool)| Door { id, door, is_open };
        let lamps = self.lamps.values().cloned().collect();
        let doors = self.doors.iter().map(door).collect();
        let mut said = vec![Packet::SceneLights(lamps), Packet::Doors(doors)];
        said.extend(self.weather.map(Packet::Weather));
        said
    }

    /// Who is attached to whom; nobody to one that is gone.
    pub(crate) fn attachments(&self) -> impl Iterator<Item = Parent> {
        let lives = |id: &u32| self.actors.contains_key(id);
        let both = self.parents.iter().filter(move |(child, parent)| lives(child) && lives(parent));
        both.map(|(&child, &parent)| Parent { child, parent })
    }
}

fn bytes_of(add: &Add) -> usize {
    let attributes = add.attributes.iter().map(|one| one.name.len() + one.value.len());
    add.blueprint.len() + attributes.sum::<usize>()
}

/// Where each frame of a log lies; about 16 bytes a frame.
#[derive(Debug, Default)]
pub struct Index {
    frames: Vec<Place>,
    keyframes: Vec<Keyframe>,
    at_start: BTreeSet<u32>,
    /// What holds after the last frame.
    at_end: Cast,
    /// In the order of the log.
    journals: Vec<JournalLink>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    offset: u64,
    elapsed_secs: f64,
}

/// What holds before the packets of a frame.
#[derive(Debug)]
struct Keyframe {
    frame: usize,
    cast: Cast,
}

/// Which part of a log is replayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Since the first frame.
    pub from_secs: f64,
    /// Since the first frame; may lie after the last one.
    pub to_secs: f64,
    /// Of the last frame.
    pub total_secs: f64,
}

impl Index {
    /// Reads a whole log; one that is cut or damaged, up to there.
    ///
    /// # Errors
    /// Those of the source, and a log of more than two days or with too many actors.
    pub fn build(reader: &mut Reader<impl Read>) -> io::Result<Self> {
        let mut index = Self::default();
        let mut cast = Cast::default();
        let (mut damage, mut kept) = (None, 0);
        while let Some(frame) = reader.next_frame()? {
            if index.frames.len() >= FRAMES_MAX {
                let why = format!("wanted a recording of at most {FRAMES_MAX} frames, found more");
                return Err(io::Error::other(why));
            }
            let is_due = index.frames.len().is_multiple_of(KEYFRAME_INTERVAL);
            if is_due && (index.frames.is_empty() || kept + cast.len() <= KEPT_MAX) {
                let frame = index.frames.len();
                kept += cast.len();
                index.keyframes.push(Keyframe { frame, cast: cast.clone() });
            }
            if let Err(malformed) = heed(&frame, &mut cast) {
                damage = Some((frame.offset, malformed));
                break;
            }
            cast.check()?;
            let elapsed_secs = frame.start.elapsed_secs;
            if index.frames.is_empty() {
                index.at_start = cast.actors.keys().copied().collect();
            }
            if index.journals.len() < JOURNALS_MAX {
                index.journals.extend(JournalLink::of(&frame));
            }
            index.frames.push(Place { offset: frame.offset, elapsed_secs });
        }
        if let Some((offset, malformed)) = damage {
            reader.end_at(offset, &malformed);
        }
        index.at_end = cast;
        Ok(index)
    }

    /// Whether an actor is in the first frame: then its place is that in the world, also when it is
    /// attached.
    pub fn was_there_at_start(&self, id: u32) -> bool {
        self.at_start.contains(&id)
    }

    /// What is left to happen until the end of the log when these actors live.
    pub(crate) fn events_to_end(&self, living: &BTreeSet<u32>) -> Vec<Event> {
        let last = &self.at_end;
        let gone = living.iter().filter(|id| !last.actors.contains_key(id));
        let new = last.actors.values().filter(|add| !living.contains(&add.id));
        let hang = last.attachments().filter(|parent| !living.contains(&parent.child));
        let gone = gone.map(|id| Event::Destroy(*id));
        let new = new.map(|add| Event::Add(Arc::clone(add)));
        gone.chain(new).chain(hang.map(Event::Parent)).collect()
    }

    /// The journals beside the log, one after the other: a world that goes on in another service
    /// has a new one.
    pub fn journals(&self) -> &[JournalLink] {
        &self.journals
    }

    /// How many frames there are.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// When the last frame is.
    pub fn total_secs(&self) -> f64 {
        self.frames.last().map_or(0.0, |frame| frame.elapsed_secs)
    }

    /// The part that begins at `start_secs`, from the end if that is negative, and lasts
    /// `duration_secs`, to the end if that is not above zero.
    pub fn span(&self, start_secs: f64, duration_secs: f64) -> Span {
        let total_secs = self.total_secs();
        let start_secs = if start_secs.is_finite() { start_secs } else { 0.0 };
        let from_end = (total_secs + start_secs).max(0.0);
        let from_secs = if start_secs < 0.0 { from_end } else { start_secs };
        let to_secs = if duration_secs > 0.0 { from_secs + duration_secs } else { total_secs };
        Span { from_secs, to_secs, total_secs }
    }

    /// The last frame that is not after this time, or the first one.
    pub(crate) fn frame_at(&self, secs: f64) -> Option<usize> {
        let after = self.frames.partition_point(|frame| frame.elapsed_secs <= secs);
        (!self.frames.is_empty()).then(|| after.saturating_sub(1))
    }

    /// A frame at or before this one from where to read on, and what holds before it.
    pub(crate) fn keyframe(&self, frame: usize) -> Option<(usize, u64, Cast)> {
        let after = self.keyframes.partition_point(|keyframe| keyframe.frame <= frame);
        let keyframe = self.keyframes.get(after.checked_sub(1)?)?;
        let place = self.frames.get(keyframe.frame)?;
        Some((keyframe.frame, place.offset, keyframe.cast.clone()))
    }
}

/// Notes what lasts of a frame.
fn heed(frame: &Frame<'_>, cast: &mut Cast) -> Result<(), crate::bytes::Malformed> {
    for packet in frame.packets().filter(|packet| Cast::heeds(packet.kind)) {
        cast.note(&packet.decode()?);
    }
    Ok(())
}
