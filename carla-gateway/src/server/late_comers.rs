//! Clients that come while the gateway takes no new ones: they are told so whatever they call.

use std::collections::BTreeSet;

use monitoring::Monitor;

use crate::rpc::{ConnectionId, Refusal};

/// Clients that came too late.
pub(crate) struct LateComers {
    monitor: Monitor,
    clients: BTreeSet<ConnectionId>,
}

impl LateComers {
    /// Nobody has come.
    pub(crate) fn new(monitor: Monitor) -> Self {
        Self { monitor, clients: BTreeSet::new() }
    }

    /// A client has come; whether it is too late. Who joins others belongs to them: a script has
    /// several connections.
    pub(super) fn take(&mut self, client: ConnectionId, others: usize) -> bool {
        let is_late = others == 0 && self.monitor.is_draining();
        is_late && self.clients.insert(client)
    }

    /// A client is gone; whether it had come too late.
    pub(super) fn forget(&mut self, client: ConnectionId) -> bool {
        self.clients.remove(&client)
    }

    /// What its calls are answered with.
    pub(super) fn refusal_of(&self, client: ConnectionId) -> Option<Refusal> {
        self.clients.contains(&client).then(|| {
            Refusal(
                "this server is ending and takes no new clients; connect to another, or to the \
                 same port a little later"
                    .to_owned(),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_comes_first_while_it_drains_is_late_and_who_joins_others_is_not() {
        let monitor = Monitor::default();
        let mut late = LateComers::new(monitor.clone());
        let [early, joining, alone] = [1, 2, 3].map(ConnectionId);
        assert!(!late.take(early, 0));
        monitor.drain();
        assert!(!late.take(joining, 1));
        assert!(late.take(alone, 0));
        assert!(late.refusal_of(joining).is_none());
        assert!(late.refusal_of(alone).unwrap().0.contains("ending"));
        assert!(late.forget(alone) && !late.forget(early));
        assert!(late.refusal_of(alone).is_none());
    }
}
