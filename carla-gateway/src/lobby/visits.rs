//! Frames of a world that clients visit: they come when its session steps, and are shown in their
//! turn.
//!
//! In asynchronous mode a client that connects, or has loaded, waits for a frame that comes later.
//! So the world is shown again, as it is, while its session does not step.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

use super::changeover::Phase;
use super::pace::QUIET_AFTER_LOAD;
use crate::rpc::ConnectionId;
use crate::visited::VisitedTick;

/// From a frame of a world that stands still to the next one.
pub(super) const STANDING: Duration = Duration::from_millis(250);

/// What has come, and who waits for it.
#[derive(Debug, Default)]
pub(super) struct Visits {
    /// No more than the endpoint asks for at once.
    ticks: VecDeque<VisitedTick>,
    /// Clients that were promised the next frame.
    promised: Vec<ConnectionId>,
    /// Clients that follow the episode before would not survive a frame of this one.
    quiet_until: Option<Instant>,
    /// When a frame was shown last.
    shown: Option<Instant>,
}

impl Visits {
    /// The world has ticked.
    pub(super) fn note_tick(&mut self, tick: VisitedTick) {
        self.ticks.push_back(tick);
    }

    /// These clients have ticked, and the world has not yet.
    pub(super) fn promise(&mut self, clients: Vec<ConnectionId>) {
        self.promised.extend(clients);
    }

    /// A frame was shown.
    pub(super) fn note_frame(&mut self, now: Instant) {
        self.shown = Some(now);
    }

    /// Another episode begins.
    pub(super) fn note_load(&mut self, now: Instant) {
        self.ticks.clear();
        self.promised.clear();
        self.shown = None;
        self.be_quiet(now);
    }

    /// A client gets to know the episode from now on.
    pub(super) fn be_quiet(&mut self, now: Instant) {
        self.quiet_until = Some(now + QUIET_AFTER_LOAD);
    }

    /// A client is gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.promised.retain(|promised| *promised != client);
    }

    /// When the next tick is shown.
    pub(super) fn due(&self, phase: &Phase) -> Option<Instant> {
        if self.ticks.is_empty() || phase.is_loading() { None } else { self.quiet_until }
    }

    /// When the world is shown again if it does not tick.
    pub(super) fn stands_until(&self) -> Option<Instant> {
        self.shown.map(|shown| shown + STANDING).max(self.quiet_until)
    }

    /// The next tick that is to be shown, and who was promised it.
    pub(super) fn take_due(
        &mut self,
        phase: &Phase,
        now: Instant,
    ) -> Option<(VisitedTick, Vec<ConnectionId>)> {
        if phase.is_loading() || self.quiet_until.is_some_and(|until| now < until) {
            return None;
        }
        let tick = self.ticks.pop_front()?;
        Some((tick, std::mem::take(&mut self.promised)))
    }
}
