//! Loads that wait until the Traffic Managers of others are ready.
//!
//! Traffic Managers of all clients begin anew when a snapshot of another episode reaches them. One
//! that is still about it when the next load replaces that map as well ends its process. So a load
//! waits while Traffic Managers may still be busy with that of another client.

use std::time::Duration;

use tokio::time::Instant;

use super::Endpoint;
use crate::rpc::{Connection, ConnectionId, Request};

/// The call that loads a world.
pub(super) const LOAD: &str = "load_new_episode";
/// How long Traffic Managers are given for a new map.
const READY_AFTER: Duration = Duration::from_secs(2);

/// Loads that may wait; more are not held.
const LOADS_MAX: usize = 64;

/// What clients wait for, and since when.
#[derive(Default)]
pub(super) struct HeldLoads {
    waiting: Vec<(Connection, Request)>,
    /// Who loaded last, and when the Traffic Managers of others are ready.
    last: Option<(ConnectionId, Instant)>,
}

impl HeldLoads {
    /// A client is gone, and with it what it waited for.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.waiting.retain(|(connection, _)| connection.id != client);
    }
}

impl Endpoint {
    /// Keeps a load for later, if it is too early for it; gives every other call back.
    pub(super) fn hold(
        &mut self,
        connection: Connection,
        load: Request,
    ) -> Option<(Connection, Request)> {
        if load.method != LOAD
            || !self.is_too_early(connection.id)
            || self.held.waiting.len() >= LOADS_MAX
        {
            return Some((connection, load));
        }
        self.held.waiting.push((connection, load));
        None
    }

    /// The caller has loaded a world.
    pub(super) fn note_load(&mut self) {
        self.held.last = self.caller.map(|client| (client, Instant::now() + READY_AFTER));
    }

    /// When the next look at what waits is due; the end of a changeover is another occasion.
    pub(super) fn next_load_due(&self) -> Option<Instant> {
        let (_, ready_at) = self.held.last?;
        let waits = !self.held.waiting.is_empty() && self.changeover.is_none();
        waits.then_some(ready_at)
    }

    /// Does one load that has waited long enough.
    pub(super) async fn do_held_load(&mut self) {
        let ready = |(connection, _): &(Connection, Request)| !self.is_too_early(connection.id);
        let Some(at) = self.held.waiting.iter().position(ready) else { return };
        let (connection, load) = self.held.waiting.remove(at);
        self.caller = Some(connection.id);
        self.answer(connection, load).await;
        self.caller = None;
    }

    /// Whether Traffic Managers of others may still be about the last load.
    fn is_too_early(&self, client: ConnectionId) -> bool {
        let changes = self.changeover.as_ref().is_some_and(|changing| changing.client() != client);
        changes
            || self.held.last.is_some_and(|(loader, ready_at)| {
                Instant::now() < ready_at && self.traffic_managers.run_beside(loader)
            })
    }
}
