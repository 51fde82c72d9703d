//! When answers are given, and Traffic Managers woken.

use tokio::time::Instant;

use super::Lobby;
use super::messages::{Do, Timing};
use crate::rpc::{Answer, Ticket};

impl Lobby {
    /// Answers now, or with the next frame.
    pub(super) fn answer_in_time(
        &mut self,
        ticket: Ticket,
        answer: Answer,
        timing: Timing,
        now: Instant,
        acts: &mut Vec<Do>,
    ) {
        let (waits, steps) = match timing {
            Timing::Now => (false, 0),
            Timing::AfterManagersStep => {
                let steps = self.late.steps_of(ticket.client, now);
                (self.managers.count(ticket.client) > 0, steps)
            }
            Timing::WithNextFrame => (true, 0),
        };
        let given = if waits && self.ticks_by_itself() {
            self.late.keep(ticket, answer, self.frame_number, steps)
        } else {
            Some((ticket, answer))
        };
        acts.extend(given.map(|(ticket, answer)| Do::Answer(ticket, answer)));
    }

    /// Gives the answers whose time has come or whose frame will not come.
    pub(super) fn give_late_answers(&mut self, now: Instant, acts: &mut Vec<Do>) {
        let due = self.late.take_due(now, self.ticks_by_itself());
        acts.extend(due.into_iter().map(|(ticket, answer)| Do::Answer(ticket, answer)));
    }

    pub(super) fn wake_late_managers(&mut self, now: Instant, acts: &mut Vec<Do>) {
        for (port, client) in self.managers.take_late(now) {
            let host = self.clients.get(&client).map(|client| client.address());
            acts.extend(host.map(|host| Do::Wake(host, port)));
        }
    }
}
