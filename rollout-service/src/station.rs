//! Some worlds and the arrays that they write, whoever's thread they are on.

use rollouts::{Reset, Shard, Snapshot};
use schemas::wire::encode_frame;
use schemas::{ActorId, Error};

use crate::memory::{Header, Window};

/// What a station can be asked for. Worlds are numbered within the station.
pub(crate) enum Job {
    /// Steps all worlds with the actions of a slot, and writes that slot.
    Step { slot: usize },
    /// Writes a slot with all worlds as they are.
    Show { slot: usize },
    /// Begins worlds anew and writes a slot; what of the other slot goes on is carried over.
    Reset { from: usize, slot: usize, resets: Vec<Reset> },
    /// Takes a snapshot of a world.
    Snapshot { world: usize },
    /// Tells a world as a frame.
    Frame { world: usize },
    /// Lets worlds go on from snapshots, each with a stream of its own or the snapshot's, and
    /// writes a slot.
    Restore { from: usize, slot: usize, worlds: Vec<(usize, SharedSnapshot, Option<u64>)> },
}

/// A snapshot that several worlds may go on from.
pub(crate) type SharedSnapshot = std::sync::Arc<Snapshot>;

/// What came of a job.
pub(crate) enum Answer {
    Done,
    Snapshot(Snapshot),
    /// Encoded, with the actors that agents drive.
    Frame(Vec<u8>, Vec<ActorId>),
}

/// Some worlds, the window that they write, and the header with everybody's actions.
pub(crate) struct Station {
    shard: Shard,
    window: Window,
    header: Header,
    /// Position of the first action among those of all worlds.
    first_action: usize,
    action_count: usize,
    actions: Vec<f32>,
}

impl Station {
    /// - **Domain:** `first_action` and `action_count` say which numbers among all actions are for
    ///   the shard's worlds.
    pub(crate) fn new(
        shard: Shard,
        window: Window,
        header: Header,
        (first_action, action_count): (usize, usize),
    ) -> Self {
        Self { shard, window, header, first_action, action_count, actions: Vec::new() }
    }

    /// # Errors
    /// What was refused; then no world of this station has changed.
    pub(crate) fn work(&mut self, job: Job) -> Result<Answer, Error> {
        match job {
            Job::Step { slot } => {
                self.read_actions(slot);
                self.shard.step(&self.actions, &mut self.window.rows(slot))?;
            }
            Job::Show { slot } => self.shard.show(&mut self.window.rows(slot)),
            Job::Reset { from, slot, resets } => {
                self.window.carry(from, slot);
                self.shard.reset(Some(&resets), &mut self.window.rows(slot))?;
            }
            Job::Snapshot { world } => return self.shard.snapshot(world).map(Answer::Snapshot),
            Job::Frame { world } => {
                let (frame, cars) = self.shard.frame(world)?;
                return Ok(Answer::Frame(encode_frame(&frame).0, cars));
            }
            Job::Restore { from, slot, worlds } => {
                self.window.carry(from, slot);
                for (world, snapshot, stream) in worlds {
                    self.shard.restore(world, &snapshot, stream)?;
                    self.shard.show_one(world, &mut self.window.rows(slot));
                }
            }
        }
        Ok(Answer::Done)
    }

    /// Whether a step can be taken with the actions of a slot.
    ///
    /// # Errors
    /// What speaks against it.
    pub(crate) fn check(&mut self, slot: usize) -> Result<(), Error> {
        self.read_actions(slot);
        self.shard.check(&self.actions)
    }

    fn read_actions(&mut self, slot: usize) {
        let range = self.first_action..self.first_action + self.action_count;
        self.header.actions(slot, range, &mut self.actions);
    }
}
