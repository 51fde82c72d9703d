//! Doing again what a journal tells.

use std::io::{self, Read};
use std::sync::Arc;

use schemas::wire::decode_frame;
use schemas::{Error, Frame, Tick, WorldId};
use world::{Town, World};

use super::chunk::{self, Kind, damaged};
use super::compare::{Difference, difference};
use super::entry::{Head, Step, TickEntry};
use super::reader::{self, Way};

/// A journal that was replayed without a difference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replayed {
    /// Name of its map.
    pub map: String,
    /// Where it began.
    pub first: Tick,
    /// Where it ended.
    pub last: Tick,
    /// Commands that were carried out again.
    pub commands: usize,
    /// Keyframes that were the same.
    pub keyframes: usize,
    /// Whether it was ended in order, and not cut off with its process.
    pub ended: bool,
}

/// Why a journal was not replayed to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The file cannot be read, or is no journal.
    #[error("the journal cannot be read: {0}")]
    Read(#[from] io::Error),
    /// A part of it cannot be used.
    #[error("the journal cannot be replayed: {0}")]
    Part(#[from] Error),
    /// A replayed world went another way.
    #[error("the replay differs at {0}")]
    Differs(Box<Difference>),
}

/// Replays a journal and compares every frame and keyframe; `watch` sees each tick before.
///
/// # Errors
/// [`JournalError`], also of `watch`; `Differs` names the first difference.
pub fn verify(
    mut from: impl Read,
    mut watch: impl FnMut(&TickEntry) -> Result<(), JournalError>,
) -> Result<Replayed, JournalError> {
    let head = reader::read_front(&mut from)?;
    let mut replay = Replay::begin(&head)?;
    let (first, map) = (head.first.tick, head.map_name);
    let (commands, keyframes, ended) = (0, 0, false);
    let mut told = Replayed { map, first, last: first, commands, keyframes, ended };
    while let Some((kind, content)) = chunk::read(&mut from)? {
        match kind {
            Kind::Commands => {
                let step = reader::commands_in(&content)?;
                if let Step::Commands(commands) = &step {
                    told.commands += commands.len();
                }
                replay.step(&step)?;
            }
            Kind::Tick => {
                let tick = reader::tick_in(&content)?;
                watch(&tick)?;
                told.last = tick.moment.tick;
                replay.step(&Step::Tick(tick))?;
            }
            Kind::Keyframe => {
                let (_, packed) = reader::moment_in(&content)?;
                replay.compare_snapshot(&chunk::unpack(packed)?)?;
                told.keyframes += 1;
            }
            Kind::Index => {}
            Kind::End => {
                told.ended = true;
                break;
            }
            other => return Err(damaged(&format!("{other:?} in the middle of it")).into()),
        }
    }
    Ok(told)
}

/// A world that does again what a journal tells.
pub struct Replay {
    world: World,
    town: Arc<Town>,
}

impl Replay {
    /// At the beginning of a journal.
    ///
    /// # Errors
    /// A map or a snapshot that cannot be used.
    pub fn begin(head: &Head) -> Result<Self, JournalError> {
        let roads = roads::Map::parse(&head.map_name, &head.map_text)
            .map_err(|error| damaged(&format!("its map cannot be used: {error}")))?;
        let town = Arc::new(Town::new(Arc::new(roads)));
        let world = restored(&head.snapshot, &town)?;
        Ok(Self { world, town })
    }

    /// The world as it is now.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Goes to another state of the journal.
    ///
    /// # Errors
    /// As for [`step`](Self::step), and a snapshot that cannot be used; then it is where it was, or
    /// on the way.
    pub fn go(&mut self, way: &Way) -> Result<(), JournalError> {
        self.world = restored(&way.snapshot, &self.town)?;
        way.steps.iter().try_for_each(|step| self.step(step))
    }

    /// Does the next step again; after a tick the frame is compared.
    ///
    /// # Errors
    /// [`JournalError`]; `Differs` names the first difference.
    pub fn step(&mut self, step: &Step) -> Result<(), JournalError> {
        match step {
            Step::Commands(commands) => {
                for command in commands {
                    // What was carried out and is refused now shows in the next frame.
                    let _ = self.world.apply(command);
                }
                Ok(())
            }
            Step::Tick(tick) => self.tick(tick),
        }
    }

    fn tick(&mut self, tick: &TickEntry) -> Result<(), JournalError> {
        match tick.wanted_secs {
            None => self.world.tick(),
            Some(dt_secs) => self.world.tick_by(dt_secs),
        }?;
        let recorded = decode_frame(&tick.frame.0)?;
        let replayed = Frame { world: recorded.world, epoch: recorded.epoch, ..self.world.frame() };
        match difference(&recorded, &replayed) {
            Some(difference) => Err(JournalError::Differs(Box::new(difference))),
            None => Ok(()),
        }
    }

    fn compare_snapshot(&self, recorded: &[u8]) -> Result<(), JournalError> {
        let replayed = self.world.snapshot();
        if replayed == recorded {
            return Ok(());
        }
        let digest = |bytes: &[u8]| blake3::hash(bytes).to_hex().to_string();
        Err(JournalError::Differs(Box::new(Difference {
            tick: self.world.tick_number(),
            actor: None,
            field: "snapshot",
            recorded: digest(recorded),
            replayed: digest(&replayed),
        })))
    }
}

fn restored(snapshot: &[u8], town: &Arc<Town>) -> Result<World, JournalError> {
    let id = WorldId::new(1).ok_or_else(|| damaged("no world has the id 0"))?;
    Ok(World::restore(snapshot, id, 0, |_| Some(Arc::clone(town)))?)
}
