//! Answers that wait for a frame.
//!
//! Without clients that tick, a call that spawns is answered half a frame after the first snapshot
//! with the new actors, so that one such call takes a frame, as it does in CARLA. Clients look up
//! where actors are in the newest snapshot that has reached them, and their walker controllers end
//! the process when they start a walker that is not in it.

use tokio::time::Instant;

use super::{EVENTS_MAX, Endpoint};
use crate::rpc::{Answer, Connection, Request};

/// What clients wait for.
#[derive(Default)]
pub(super) struct LateAnswers {
    /// Whether the answer to the present call waits.
    next_is_late: bool,
    waiting: Vec<LateAnswer>,
}

struct LateAnswer {
    connection: Connection,
    request: Request,
    answer: Answer,
    /// Number of the frame in which it was called.
    called_in: u64,
    /// Known when the next frame is there.
    due: Option<Instant>,
}

impl LateAnswers {
    /// When the next answer is to be given.
    pub(super) fn next_due(&self) -> Option<Instant> {
        self.waiting.iter().filter_map(|late| late.due).min()
    }
}

impl Endpoint {
    /// The present call has put actors into the world: its answer waits for a frame.
    pub(crate) fn answer_with_next_frame(&mut self) {
        self.late.next_is_late = self.ticks_by_itself();
    }

    /// Answers now, or with the next frame.
    pub(super) fn answer_in_time(
        &mut self,
        connection: Connection,
        request: Request,
        answer: Answer,
    ) {
        let is_late = std::mem::take(&mut self.late.next_is_late);
        if is_late && self.late.waiting.len() < EVENTS_MAX {
            let called_in = self.frame_number;
            self.late.waiting.push(LateAnswer {
                connection,
                request,
                answer,
                called_in,
                due: None,
            });
        } else {
            connection.outbox.answer(&request, &answer);
        }
    }

    /// Gives the answers whose time has come or whose frame will not come.
    pub(super) fn give_late_answers(&mut self) {
        let (now, frame_number, may_wait) =
            (Instant::now(), self.frame_number, self.ticks_by_itself());
        let half_frame = self.config.period / 2;
        self.late.waiting.retain_mut(|late| {
            if late.due.is_none() && late.called_in != frame_number {
                late.due = Some(now + half_frame);
            }
            let waits = may_wait && late.due.is_none_or(|due| due > now);
            if !waits {
                late.connection.outbox.answer(&late.request, &late.answer);
            }
            waits
        });
    }

    fn ticks_by_itself(&self) -> bool {
        !self.settings.synchronous_mode && self.next_tick_at().is_some()
    }
}
