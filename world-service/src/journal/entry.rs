//! What a journal holds, one after the other.

use std::io;

use schemas::wire::encode_request;
use schemas::{Command, EncodedFrame, Frame, Request, Tick, WorldId};

/// When a state was, and what it was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Its tick.
    pub tick: Tick,
    /// Simulated seconds since its world began.
    pub sim_secs: f64,
    /// Of the state.
    pub state_hash: u64,
}

impl Moment {
    /// That of a frame.
    pub fn of(frame: &Frame) -> Self {
        Self { tick: frame.tick, sim_secs: frame.sim_secs, state_hash: frame.state_hash }
    }
}

/// From where a journal goes on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Head {
    /// Name of the map.
    pub map_name: String,
    /// OpenDRIVE.
    pub map_text: String,
    /// The world when the journal began.
    pub snapshot: Vec<u8>,
    /// When that was.
    pub first: Moment,
}

impl Head {
    /// What tells journals apart that began otherwise: of the BLAKE3 digest of map and snapshot.
    pub fn digest(&self) -> u64 {
        let mut hasher = blake3::Hasher::new();
        for part in [self.map_name.as_bytes(), self.map_text.as_bytes(), &self.snapshot] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        let digest = *hasher.finalize().as_bytes();
        digest.first_chunk::<8>().map_or(0, |first| u64::from_le_bytes(*first))
    }
}

/// A tick and what came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct TickEntry {
    /// The length it was asked for, in seconds; `None`: the world's own.
    pub wanted_secs: Option<f64>,
    /// After it.
    pub moment: Moment,
    /// After it.
    pub frame: EncodedFrame,
}

/// What is written after the head.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// Commands that the world carried out, as the request to run them.
    Commands(Vec<u8>),
    /// A tick.
    Tick(TickEntry),
    /// The world as it is here, from where a replay may begin.
    Keyframe {
        /// When.
        moment: Moment,
        /// As bytes.
        snapshot: Vec<u8>,
    },
}

impl Entry {
    /// Commands that a world carried out. Refused ones change nothing and need no record.
    pub fn commands(world: WorldId, commands: Vec<Command>) -> Self {
        Self::Commands(encode_request(&Request::RunCommands { world, commands }))
    }

    /// About how much memory it takes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Commands(request) => request.len(),
            Self::Tick(tick) => tick.frame.0.len(),
            Self::Keyframe { snapshot, .. } => snapshot.len(),
        }
    }
}

/// What is to be done again in a replay.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// To carry out commands.
    Commands(Vec<Command>),
    /// To tick.
    Tick(TickEntry),
}

/// Takes the entries of one journal, in order, and holds nobody up.
pub trait Scribe: Send {
    /// Takes the next one.
    ///
    /// # Errors
    /// It cannot be written, or only later than may be waited for; the journal is at its end.
    fn put(&mut self, entry: Entry) -> io::Result<()>;

    /// Ends the journal in order, and says when all is written.
    fn end(self: Box<Self>, then: Box<dyn FnOnce() + Send>);
}
