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

    /// The present call has destroyed an actor, which a step of the caller's Traffic Managers may
    /// be about.
    pub(crate) fn answer_after_managers_step(&mut self, actor: u32) {
        let actor = self.episode.as_ref().and_then(|episode| episode.actor(actor));
        let is_vehicle =
            actor.is_some_and(|actor| actor.description.type_id.starts_with("vehicle."));
        let managers = self.caller.map_or(0, |client| self.traffic_managers.count(client));
        if is_vehicle && managers > 0 {
            self.answer_with_next_frame();
        }
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
