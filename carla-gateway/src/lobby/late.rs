//! Answers that wait for a frame.
//!
//! Without clients that tick, a call that spawns is answered half a frame after the first snapshot
//! with the new actors, so that one such call takes a frame, as it does in CARLA. Clients look up
//! where actors are in the newest snapshot that has reached them, and their walker controllers end
//! the process when they start a walker that is not in it.
//!
//! The same holds for a call that destroys a vehicle, from a client with a Traffic Manager: the
//! client takes the vehicle away when it reads the answer, and a Traffic Manager that is in the
//! middle of a step with a snapshot that has the vehicle still ends the process. One frame later
//! that step is over.

use tokio::time::Instant;

use super::CALLS_MAX;
use crate::rpc::{Answer, ConnectionId, Ticket};

/// What clients wait for.
#[derive(Debug, Default)]
pub(super) struct LateAnswers {
    waiting: Vec<LateAnswer>,
}

#[derive(Debug)]
struct LateAnswer {
    ticket: Ticket,
    answer: Answer,
    /// Number of the frame in which it was called.
    called_in: u64,
    /// Known when the next frame is there.
    due: Option<Instant>,
}

impl LateAnswers {
    /// Keeps an answer until after the next frame; gives it back when too many wait.
    pub(super) fn keep(
        &mut self,
        ticket: Ticket,
        answer: Answer,
        called_in: u64,
    ) -> Option<(Ticket, Answer)> {
        if self.waiting.len() >= CALLS_MAX {
            return Some((ticket, answer));
        }
        self.waiting.push(LateAnswer { ticket, answer, called_in, due: None });
        None
    }

    /// A frame was shown: what was called before it is due at that time.
    pub(super) fn note_frame(&mut self, frame_number: u64, due: Instant) {
        for late in &mut self.waiting {
            if late.called_in != frame_number {
                late.due.get_or_insert(due);
            }
        }
    }

    /// Those whose time has come; all of them when no frame will come.
    pub(super) fn take_due(&mut self, now: Instant, frames_come: bool) -> Vec<(Ticket, Answer)> {
        let is_due = |late: &mut LateAnswer| !frames_come || late.due.is_some_and(|due| due <= now);
        self.waiting.extract_if(.., is_due).map(|late| (late.ticket, late.answer)).collect()
    }

    /// When the next answer is to be given.
    pub(super) fn due(&self) -> Option<Instant> {
        self.waiting.iter().filter_map(|late| late.due).min()
    }

    /// A client is gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.waiting.retain(|late| late.ticket.client != client);
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }
}
