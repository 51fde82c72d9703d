//! Doing again what a journal tells.

use std::io::{self, ErrorKind, Read};
use std::sync::Arc;

use schemas::wire::{decode_frame, decode_request};
use schemas::{Error, Frame, Request, Tick, WorldId};
use world::{Town, World};

use super::chunk::{self, HEAD, Kind};
use super::compare::{Difference, difference};

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

/// Replays a journal and compares every frame.
///
/// # Errors
/// [`JournalError`]; `Differs` names the first difference.
pub fn verify(mut from: impl Read) -> Result<Replayed, JournalError> {
    let mut head = [0; HEAD.len()];
    if !chunk::fill(&mut from, &mut head)? || head != HEAD {
        return Err(damaged("it does not begin as a journal of this version"));
    }
    let name = text(part(&mut from, Kind::MapName)?)?;
    let map_text = text(part(&mut from, Kind::MapText)?)?;
    let snapshot = part(&mut from, Kind::Snapshot)?;
    let mut replay = Replay::begin(name, &map_text, &snapshot)?;
    while let Some((kind, content)) = chunk::read(&mut from)? {
        match kind {
            Kind::Commands => replay.commands(&content)?,
            Kind::Tick => replay.tick(&content)?,
            Kind::End => {
                replay.told.ended = true;
                break;
            }
            other => return Err(damaged(&format!("{other:?} in the middle of it"))),
        }
    }
    Ok(replay.told)
}

struct Replay {
    world: World,
    told: Replayed,
}

impl Replay {
    fn begin(map: String, map_text: &str, snapshot: &[u8]) -> Result<Self, JournalError> {
        let roads = roads::Map::parse(&map, map_text)
            .map_err(|error| damaged(&format!("its map cannot be used: {error}")))?;
        let town = Arc::new(Town::new(Arc::new(roads)));
        let id = WorldId::new(1).ok_or_else(|| damaged("no world has the id 0"))?;
        let world = World::restore(snapshot, id, 0, |_| Some(town))?;
        let first = world.tick_number();
        let told = Replayed { map, first, last: first, commands: 0, ended: false };
        Ok(Self { world, told })
    }

    fn commands(&mut self, content: &[u8]) -> Result<(), JournalError> {
        let Request::RunCommands { commands, .. } = decode_request(content)? else {
            return Err(damaged("a request that is no commands"));
        };
        for command in &commands {
            // What was carried out and is refused now shows in the next frame.
            let _ = self.world.apply(command);
        }
        self.told.commands += commands.len();
        Ok(())
    }

    fn tick(&mut self, content: &[u8]) -> Result<(), JournalError> {
        let (dt_secs, frame) =
            content.split_first_chunk::<8>().ok_or_else(|| damaged("a tick without its length"))?;
        let recorded = decode_frame(frame)?;
        let dt_secs = f64::from_le_bytes(*dt_secs);
        if dt_secs.is_nan() { self.world.tick() } else { self.world.tick_by(dt_secs) }?;
        let replayed = Frame { world: recorded.world, epoch: recorded.epoch, ..self.world.frame() };
        match difference(&recorded, &replayed) {
            Some(difference) => Err(JournalError::Differs(Box::new(difference))),
            None => {
                self.told.last = recorded.tick;
                Ok(())
            }
        }
    }
}

fn part(from: &mut dyn Read, wanted: Kind) -> Result<Vec<u8>, JournalError> {
    match chunk::read(from)? {
        Some((kind, content)) if kind == wanted => Ok(content),
        _ => Err(damaged(&format!("its {wanted:?} is missing"))),
    }
}

fn text(bytes: Vec<u8>) -> Result<String, JournalError> {
    String::from_utf8(bytes).map_err(|_| damaged("a text that is no UTF-8"))
}

fn damaged(why: &str) -> JournalError {
    JournalError::Read(io::Error::new(ErrorKind::InvalidData, why.to_owned()))
}
