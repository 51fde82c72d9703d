//! Answers that wait for a frame.
//!
//! Without clients that tick, a call that spawns is answered half a frame after the first snapshot
//! with the new actors, so that one such call takes a frame, as it does in CARLA. Clients look up
//! where actors are in the newest snapshot that has reached them, and their walker controllers end
//! the process when they start a walker that is not in it.
//!
//! The same holds for a call that destroys a vehicle, from a client with a Traffic Manager: the
//! client takes the vehicle away when it reads the answer, and a Traffic Manager that is in the
//! middle of a step with a snapshot that has the vehicle still ends the process. Each step ends
//! with a batch: where they come, the second one after that frame is awaited. The first may be that
//! of a step which began before the snapshot was read, and on a busy machine steps are long.
//!
//! Where clients tick, the newest snapshot has a vehicle until the tick after it was destroyed. A
//! change of the settings has the Traffic Managers of its client take a step: in one with such a
//! vehicle they end the process. When the change is to asynchronous mode its answer waits for the
//! frame without it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use tokio::time::Instant;

use super::CALLS_MAX;
use super::messages::Timing;
use crate::rpc::{Answer, ConnectionId, Ticket};

/// Batches of Traffic Managers after which none is in the middle of a step with an old snapshot.
const STEPS: u8 = 2;
/// How long batches are awaited; none come once the last vehicle of a Traffic Manager is gone.
pub(super) const STEPS_PATIENCE: Duration = Duration::from_millis(150);
/// Who sent a batch no longer ago sends the next ones soon.
const STEPPING: Duration = Duration::from_millis(500);

/// What clients wait for.
#[derive(Debug, Default)]
pub(super) struct LateAnswers {
    waiting: Vec<LateAnswer>,
    /// When each client sent its newest batch.
    batches: BTreeMap<ConnectionId, Instant>,
    /// Who has destroyed vehicles that the newest snapshot still has.
    destroyers: BTreeSet<ConnectionId>,
}

#[derive(Debug)]
struct LateAnswer {
    ticket: Ticket,
    answer: Answer,
    /// Number of the frame in which it was called.
    called_in: u64,
    /// Known when the next frame is there.
    due: Option<Instant>,
    /// Batches that are awaited after that frame, and for how long.
    steps: u8,
    patience: Duration,
}

impl LateAnswer {
    /// When it is given, whatever comes or does not.
    fn ends(&self) -> Option<Instant> {
        self.due.map(|due| due + self.patience)
    }
}

impl LateAnswers {
    /// Keeps an answer until after the next frame and so many batches of its client; gives it back
    /// when too many wait.
    pub(super) fn keep(
        &mut self,
        ticket: Ticket,
        answer: Answer,
        called_in: u64,
        steps: u8,
    ) -> Option<(Ticket, Answer)> {
        if self.waiting.len() >= CALLS_MAX {
            return Some((ticket, answer));
        }
        let patience = if steps > 0 { STEPS_PATIENCE } else { Duration::ZERO };
        self.waiting.push(LateAnswer { ticket, answer, called_in, due: None, steps, patience });
        None
    }

    /// How many batches of a client's Traffic Managers to wait for.
    pub(super) fn steps_of(&self, client: ConnectionId, now: Instant) -> u8 {
        let steps = self.batches.get(&client).is_some_and(|last| now < *last + STEPPING);
        if steps { STEPS } else { 0 }
    }

    /// When a call is answered after which its client's Traffic Managers step, if they do. A batch
    /// that destroys vehicles and ticks has shown a new frame, which is without them.
    pub(super) fn timing(
        &mut self,
        client: ConnectionId,
        told: Timing,
        steps: bool,
        is_new_frame: bool,
    ) -> Timing {
        if told == Timing::AfterManagersStep && !is_new_frame {
            self.destroyers.insert(client);
        }
        let has_destroyed = self.destroyers.contains(&client);
        if steps && has_destroyed { Timing::WithNextFrame } else { told }
    }

    /// A client sends a batch: its Traffic Manager has stepped.
    pub(super) fn note_batch(&mut self, client: ConnectionId, now: Instant) {
        self.batches.insert(client, now);
        for late in &mut self.waiting {
            if late.ticket.client == client && late.due.is_some() && late.steps > 0 {
                late.steps -= 1;
                if late.steps == 0 {
                    late.patience = Duration::ZERO;
                }
            }
        }
    }

    /// A frame was shown: what was called before it is due at that time.
    pub(super) fn note_frame(&mut self, frame_number: u64, due: Instant) {
        self.destroyers.clear();
        for late in &mut self.waiting {
            if late.called_in != frame_number {
                late.due.get_or_insert(due);
            }
        }
    }

    /// Those whose time has come; all of them when no frame will come.
    pub(super) fn take_due(&mut self, now: Instant, frames_come: bool) -> Vec<(Ticket, Answer)> {
        let is_due =
            |late: &mut LateAnswer| !frames_come || late.ends().is_some_and(|due| due <= now);
        self.waiting.extract_if(.., is_due).map(|late| (late.ticket, late.answer)).collect()
    }

    /// When the next answer is to be given.
    pub(super) fn due(&self) -> Option<Instant> {
        self.waiting.iter().filter_map(LateAnswer::ends).min()
    }

    /// A client is gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.waiting.retain(|late| late.ticket.client != client);
        self.batches.remove(&client);
        self.destroyers.remove(&client);
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }
}
