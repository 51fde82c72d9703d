//! Clients that tick one world together: it advances once when all of them have asked.
//!
//! A client takes part from its first tick until it disconnects. Who has not asked a lease after
//! the first of a round is absent: nobody waits for it until it asks again.

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::time::Instant;

use crate::rpc::ConnectionId;

/// What a participant does in the present round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// It is waited for.
    Awaited,
    /// It has asked for the frame to come.
    Asked,
    /// It came too late once, and has not asked since.
    Absent,
}

/// Who ticks, and who is waited for.
#[derive(Debug, Default)]
pub(super) struct Participants {
    /// How long a round waits; without one every tick counts, as in CARLA.
    lease: Option<Duration>,
    parts: BTreeMap<ConnectionId, Part>,
    /// When the present round waits for nobody any more.
    ends_at: Option<Instant>,
}

/// A frame that those who asked for it were promised.
#[derive(Debug, Default)]
pub(super) struct Round {
    pub(super) asked: Vec<ConnectionId>,
    /// How many were waited for in vain.
    pub(super) missed: usize,
}

impl Participants {
    pub(super) fn new(lease: Option<Duration>) -> Self {
        Self { lease, ..Self::default() }
    }

    /// Whether a tick waits for those of others.
    pub(super) fn share_clock(&self) -> bool {
        self.lease.is_some()
    }

    /// A client was promised the frame to come.
    pub(super) fn note_ask(&mut self, client: ConnectionId, now: Instant) {
        self.parts.insert(client, Part::Asked);
        let ends_at = now + self.lease.unwrap_or_default();
        self.ends_at.get_or_insert(ends_at);
    }

    /// The round that is complete, or has waited long enough; the next one begins.
    pub(super) fn take_round(&mut self, now: Instant) -> Option<Round> {
        let ends_at = self.ends_at?;
        let waits = self.parts.values().any(|part| *part == Part::Awaited);
        if waits && now < ends_at {
            return None;
        }
        self.ends_at = None;
        let mut round = Round::default();
        for (client, part) in &mut self.parts {
            *part = match *part {
                Part::Asked => {
                    round.asked.push(*client);
                    Part::Awaited
                }
                Part::Awaited => {
                    round.missed += 1;
                    Part::Absent
                }
                Part::Absent => Part::Absent,
            };
        }
        // Without others' ticks to wait for nobody need be remembered.
        if self.lease.is_none() {
            self.parts.clear();
        }
        Some(round)
    }

    /// Frames come without anybody's tick, or of another world: nothing is owed any more.
    pub(super) fn forget_round(&mut self) {
        self.ends_at = None;
        for part in self.parts.values_mut() {
            *part = if *part == Part::Asked { Part::Awaited } else { *part };
        }
    }

    /// A client is gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.parts.remove(&client);
        if !self.parts.values().any(|part| *part == Part::Asked) {
            self.ends_at = None;
        }
    }

    /// When the present round has waited long enough.
    pub(super) fn due(&self) -> Option<Instant> {
        self.ends_at
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.parts.len()
    }
}
