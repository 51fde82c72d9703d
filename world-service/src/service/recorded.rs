//! A world whose commands and ticks may be written down.

use std::io;
use std::ops::Deref;
use std::time::Instant;

use schemas::wire::encode_frame;
use schemas::{Command, CommandReply, EncodedFrame, Error, Frame, WorldId};

use super::Simulation;
use crate::journal::{Entry, Moment, Pace, Scribe, TickEntry};

/// A world and, while one is kept, its journal. What only looks goes to the world.
pub struct Recorded<S> {
    world: S,
    journal: Option<Journal>,
}

/// A journal that is being kept.
struct Journal {
    scribe: Box<dyn Scribe>,
    /// Of its keyframes.
    pace: Pace,
}

impl<S: Simulation> Recorded<S> {
    /// Without a journal.
    pub fn new(world: S) -> Self {
        Self { world, journal: None }
    }

    /// Keeps this journal from now on, or none; gives the one before, which is to be ended.
    #[must_use = "a journal that is only dropped has no end"]
    pub fn record(&mut self, scribe: Option<Box<dyn Scribe>>) -> Option<Box<dyn Scribe>> {
        let journal = scribe.map(|scribe| Journal { scribe, pace: Pace::default() });
        std::mem::replace(&mut self.journal, journal).map(|before| before.scribe)
    }

    /// Carries out commands, one reply each, in order.
    pub fn run(&mut self, id: WorldId, commands: &[Command]) -> Vec<CommandReply> {
        let replies: Vec<CommandReply> =
            commands.iter().map(|command| self.world.apply(command)).collect();
        if self.journal.is_some() {
            let done = commands.iter().zip(&replies).filter(|(_, reply)| reply.is_ok());
            let done: Vec<Command> = done.map(|(command, _)| command.clone()).collect();
            if !done.is_empty() {
                self.note(id, |journal, _| journal.scribe.put(Entry::commands(id, done)));
            }
        }
        replies
    }

    /// Advances by one tick. The frame comes back where a journal needed it, with its bytes.
    ///
    /// # Errors
    /// As [`Simulation::tick`].
    pub fn tick(
        &mut self,
        id: WorldId,
        wanted_secs: Option<f64>,
    ) -> Result<Option<(Frame, EncodedFrame)>, Error> {
        if self.journal.is_none() {
            self.world.tick(wanted_secs)?;
            return Ok(None);
        }
        let began = Instant::now();
        self.world.tick(wanted_secs)?;
        let took = began.elapsed();
        let frame = self.world.frame();
        let encoded = encode_frame(&frame);
        let moment = Moment::of(&frame);
        let entry = TickEntry { wanted_secs, moment, frame: encoded.clone() };
        self.note(id, |journal, world| {
            journal.scribe.put(Entry::Tick(entry))?;
            if !journal.pace.tick(took) {
                return Ok(());
            }
            journal.scribe.put(Entry::Keyframe { moment, snapshot: world.snapshot() })
        });
        Ok(Some((frame, encoded)))
    }

    /// A journal that cannot go on ends; the world goes on.
    fn note(&mut self, id: WorldId, write: impl FnOnce(&mut Journal, &S) -> io::Result<()>) {
        let Some(journal) = &mut self.journal else { return };
        if let Err(error) = write(journal, &self.world) {
            tracing::warn!(world = id.get(), %error, "the journal of a world has ended early");
            self.journal = None;
        }
    }
}

impl<S> Deref for Recorded<S> {
    type Target = S;

    fn deref(&self) -> &S {
        &self.world
    }
}
