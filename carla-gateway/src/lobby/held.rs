//! Loads that wait until the Traffic Managers of others are ready.
//!
//! Traffic Managers of all clients begin anew when a snapshot of another episode reaches them. One
//! that is still about it when the next load replaces that map as well ends its process. So a load
//! waits while Traffic Managers may still be busy with that of another client.

use std::time::Duration;

use tokio::time::Instant;

use super::Call;
use super::changeover::Phase;
use super::managers::TrafficManagers;
use crate::rpc::ConnectionId;

/// How long Traffic Managers are given for a new map.
pub(super) const READY_AFTER: Duration = Duration::from_secs(2);

/// Loads that may wait; more are not held.
const LOADS_MAX: usize = 64;

/// What clients wait for, and since when.
#[derive(Debug, Default)]
pub(super) struct HeldLoads {
    waiting: Vec<Call>,
    /// Who loaded last, and when the Traffic Managers of others are ready.
    last: Option<(ConnectionId, Instant)>,
}

impl HeldLoads {
    /// Whether a load of this client would come too early for the Traffic Managers of others.
    pub(super) fn is_too_early(
        &self,
        client: ConnectionId,
        phase: &Phase,
        managers: &TrafficManagers,
        now: Instant,
    ) -> bool {
        let another_changes = phase.client().is_some_and(|changing| changing != client);
        let are_busy = |(loader, ready_at)| now < ready_at && managers.run_beside(loader);
        another_changes || self.last.is_some_and(are_busy)
    }

    /// Keeps a load for later; gives it back when too many wait.
    pub(super) fn hold(&mut self, load: Call) -> Option<Call> {
        if self.waiting.len() >= LOADS_MAX {
            return Some(load);
        }
        self.waiting.push(load);
        None
    }

    /// A client has loaded a world.
    pub(super) fn note_load(&mut self, client: ConnectionId, now: Instant) {
        self.last = Some((client, now + READY_AFTER));
    }

    /// One load that has waited long enough.
    pub(super) fn take_ready(
        &mut self,
        phase: &Phase,
        managers: &TrafficManagers,
        now: Instant,
    ) -> Option<Call> {
        let is_ready = |load: &Call| !self.is_too_early(load.ticket.client, phase, managers, now);
        let at = self.waiting.iter().position(is_ready)?;
        Some(self.waiting.remove(at))
    }

    /// When the next look at what waits is due; the end of a changeover is another occasion.
    pub(super) fn due(&self, phase: &Phase) -> Option<Instant> {
        let (_, ready_at) = self.last?;
        let waits = !self.waiting.is_empty() && phase.client().is_none();
        waits.then_some(ready_at)
    }

    /// A client is gone, and with it what it waited for.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.waiting.retain(|load| load.ticket.client != client);
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }
}
