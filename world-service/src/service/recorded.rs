//! A world whose commands and ticks may be written down.

use std::io;
use std::ops::Deref;

use schemas::wire::encode_frame;
use schemas::{Command, CommandReply, Error, WorldId};

use super::Simulation;
use crate::journal::Journal;

/// A world and, while one is kept, its journal. What only looks goes to the world.
pub struct Recorded<S> {
    world: S,
    journal: Option<Journal>,
}

impl<S: Simulation> Recorded<S> {
    /// Without a journal.
    pub fn new(world: S) -> Self {
        Self { world, journal: None }
    }

    /// Keeps this journal from now on, or none, and ends the one before.
    pub fn record(&mut self, journal: Option<Journal>) {
        if let Some(before) = std::mem::replace(&mut self.journal, journal)
            && let Err(error) = before.end()
        {
            tracing::warn!(%error, "a journal has no end");
        }
    }

    /// Carries out commands, one reply each, in order.
    pub fn run(&mut self, id: WorldId, commands: &[Command]) -> Vec<CommandReply> {
        let replies: Vec<CommandReply> =
            commands.iter().map(|command| self.world.apply(command)).collect();
        if self.journal.is_some() {
            let done = commands.iter().zip(&replies).filter(|(_, reply)| reply.is_ok());
            let done: Vec<Command> = done.map(|(command, _)| command.clone()).collect();
            if !done.is_empty() {
                self.note(id, |journal, _| journal.commands(id, done));
            }
        }
        replies
    }

    /// Advances by one tick.
    ///
    /// # Errors
    /// As [`Simulation::tick`].
    pub fn tick(&mut self, id: WorldId, dt_secs: Option<f64>) -> Result<(), Error> {
        self.world.tick(dt_secs)?;
        self.note(id, |journal, world| journal.tick(dt_secs, &encode_frame(&world.frame())));
        Ok(())
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
