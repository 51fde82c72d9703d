//! Traffic Managers of clients, and which of them have slept through a frame.
//!
//! A Traffic Manager in synchronous mode steps on a thread of the client, once for each of its
//! ticks and changes of the settings: it sends a batch of controls, reads the settings and goes to
//! sleep. The client library signals a new frame without the lock under which that thread falls
//! asleep: a signal in between is lost, and then both threads wait for each other for ever. On a
//! busy machine that happens once in some thousand ticks. Switched to asynchronous mode and back,
//! the Traffic Manager gets the signal again and goes on with the step that it owes.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Duration;

use tokio::time::Instant;

use crate::rpc::{Answer, ConnectionId, Meta, Payload, Request};

/// Traffic Managers of one endpoint.
const MANAGERS_MAX: usize = 1_024;
/// Letters of a host's name.
const HOST_BYTES_MAX: usize = 255;
/// How long a client may be silent while its step is awaited; real steps are full of calls.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
/// Reads of the settings between two ticks of its client that one in synchronous mode never makes.
const READS_OF_RESTLESS: u32 = 16;
/// Ticks with so many reads after which it is told.
const RESTLESS_TICKS: u32 = 10;

/// All Traffic Managers of an endpoint, by their ports.
#[derive(Debug, Default)]
pub(super) struct TrafficManagers {
    running: BTreeMap<u16, Manager>,
    /// The port about which each client asked last.
    asked: BTreeMap<ConnectionId, u16>,
}

#[derive(Debug)]
struct Manager {
    host: String,
    owner: ConnectionId,
    /// Whether a batch has come since the last tick of its client.
    steps: bool,
    /// Until when the batch of the newest frame, or another sign of life, is awaited.
    due: Option<Instant>,
    /// Reads of the settings since the last tick of its client.
    reads: u32,
    /// Ticks of its client before which it read more than one in synchronous mode does.
    restless_ticks: u32,
}

impl Manager {
    fn new(host: String, owner: ConnectionId) -> Self {
        Self { host, owner, steps: false, due: None, reads: 0, restless_ticks: 0 }
    }
}

impl TrafficManagers {
    /// The host that a client gave for a port.
    fn host(&self, port: u16) -> Option<&str> {
        self.running.get(&port).map(|manager| manager.host.as_str())
    }

    /// Notes a new one; `false` when the port is taken or there are too many.
    fn add(&mut self, port: u16, host: String, owner: ConnectionId) -> bool {
        let is_free = !self.running.contains_key(&port)
            && self.running.len() < MANAGERS_MAX
            && host.len() <= HOST_BYTES_MAX;
        if is_free {
            self.running.insert(port, Manager::new(host, owner));
        }
        is_free
    }

    /// Whether there was one.
    fn remove(&mut self, port: u16) -> bool {
        self.running.remove(&port).is_some()
    }

    /// How many run in a client.
    pub(super) fn count(&self, client: ConnectionId) -> usize {
        self.running.values().filter(|manager| manager.owner == client).count()
    }

    /// Whether any runs in another client.
    pub(super) fn run_beside(&self, client: ConnectionId) -> bool {
        self.running.values().any(|manager| manager.owner != client)
    }

    /// A client and all it runs are gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        self.asked.remove(&client);
        self.running.retain(|_, manager| manager.owner != client);
    }

    /// A client sends a batch: its Traffic Manager has stepped.
    pub(super) fn note_batch(&mut self, client: ConnectionId) {
        for manager in self.of(client) {
            manager.steps = true;
            manager.due = None;
        }
    }

    /// A client calls: it does not stand still. In asynchronous mode Traffic Managers read the
    /// settings all the time.
    pub(super) fn note_call(&mut self, client: ConnectionId, now: Instant) {
        for manager in self.of(client).filter(|manager| manager.due.is_some()) {
            manager.due = Some(now + PATIENCE);
        }
    }

    /// A client reads the settings, which a Traffic Manager in synchronous mode does once in a
    /// step.
    pub(super) fn note_read(&mut self, client: ConnectionId) {
        for manager in self.of(client) {
            manager.reads = manager.reads.saturating_add(1);
        }
    }

    /// A client has ticked: ports of its Traffic Managers that do not wait for that, each once.
    pub(super) fn take_restless(&mut self, client: ConnectionId) -> Vec<u16> {
        let mut restless = Vec::new();
        let own = self.running.iter_mut().filter(|(_, manager)| manager.owner == client);
        for (port, manager) in own {
            if std::mem::take(&mut manager.reads) >= READS_OF_RESTLESS {
                manager.restless_ticks = manager.restless_ticks.saturating_add(1);
                if manager.restless_ticks == RESTLESS_TICKS {
                    restless.push(*port);
                }
            }
        }
        restless
    }

    /// A client waits for the steps of its Traffic Managers.
    pub(super) fn note_frame(&mut self, client: ConnectionId, now: Instant) {
        for manager in self.of(client).filter(|manager| manager.steps) {
            manager.steps = false;
            manager.due = Some(now + PATIENCE);
        }
    }

    /// When the next look at who is late is due.
    pub(super) fn due(&self) -> Option<Instant> {
        self.running.values().filter_map(|manager| manager.due).min()
    }

    /// Ports and clients of those that have slept through a frame; each is told once.
    pub(super) fn take_late(&mut self, now: Instant) -> Vec<(u16, ConnectionId)> {
        let late = self.running.iter_mut().filter_map(|(port, manager)| {
            manager.due.take_if(|due| *due <= now).map(|_| (*port, manager.owner))
        });
        late.collect()
    }

    /// Where a Traffic Manager listens. On a machine without a default route the client library
    /// finds no address and says `("", 0)`: it is where the client asked last whether one runs.
    fn place(&self, client: ConnectionId, from: IpAddr, told: (String, u16)) -> (String, u16) {
        match self.asked.get(&client) {
            Some(port) if told == (String::new(), 0) => (from.to_string(), *port),
            _ => told,
        }
    }

    /// Answers a call about Traffic Managers, and tells the port of one that its client is about to
    /// start. Gives nothing for other calls.
    pub(super) fn answer(
        &mut self,
        client: ConnectionId,
        from: IpAddr,
        request: &Request,
    ) -> Option<(Answer, Option<u16>)> {
        let port = || request.args().map(|(_, port): (Meta, u16)| port);
        let mut starts = None;
        let answer = match request.method.as_str() {
            "is_traffic_manager_running" => port().and_then(|port| {
                self.asked.insert(client, port);
                let is_running = self.host(port).is_some();
                starts = (!is_running).then_some(port);
                Payload::value(&is_running)
            }),
            "get_traffic_manager_running" => port().and_then(|port| {
                let host = self.host(port);
                Payload::value(&host.map_or(("", 0), |host| (host, port)))
            }),
            "add_traffic_manager_running" => request.args().and_then(|args| {
                let (_, told): (Meta, (String, u16)) = args;
                let (host, port) = self.place(client, from, told);
                Payload::value(&self.add(port, host, client))
            }),
            "destroy_traffic_manager" => port().and_then(|port| Payload::value(&self.remove(port))),
            _ => return None,
        };
        Some((answer, starts))
    }

    /// How many there are.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.running.len()
    }

    fn of(&mut self, client: ConnectionId) -> impl Iterator<Item = &mut Manager> {
        self.running.values_mut().filter(move |manager| manager.owner == client)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLIENT: ConnectionId = ConnectionId(1);

    fn one() -> TrafficManagers {
        let mut managers = TrafficManagers::default();
        assert!(managers.add(8_000, "127.0.0.1".to_owned(), CLIENT));
        assert!(!managers.add(8_000, "127.0.0.1".to_owned(), ConnectionId(2)));
        managers
    }

    #[test]
    fn one_that_tells_no_place_is_where_its_client_asked() {
        let mut managers = TrafficManagers::default();
        let (from, unknown) = (IpAddr::from([127, 0, 0, 1]), || (String::new(), 0));
        assert_eq!(managers.place(CLIENT, from, unknown()), unknown());
        managers.asked.insert(CLIENT, 8_000);
        assert_eq!(managers.place(CLIENT, from, unknown()), ("127.0.0.1".to_owned(), 8_000));
        assert_eq!(managers.place(ConnectionId(2), from, unknown()), unknown());
        let told = ("10.0.0.7".to_owned(), 8_001);
        assert_eq!(managers.place(CLIENT, from, told.clone()), told);
    }

    #[test]
    fn who_sends_no_batch_after_a_frame_is_late_once() {
        let (mut managers, begun) = (one(), Instant::now());
        managers.note_batch(CLIENT);
        managers.note_frame(CLIENT, begun);
        managers.note_call(CLIENT, begun + PATIENCE / 2);
        assert!(managers.take_late(begun + PATIENCE).is_empty());
        assert_eq!(managers.take_late(begun + PATIENCE * 2), [(8_000, CLIENT)]);
        assert!(managers.take_late(begun + PATIENCE * 9).is_empty());
        assert_eq!(managers.due(), None);
    }

    #[test]
    fn who_has_stepped_or_never_did_is_not_late() {
        let (mut managers, begun) = (one(), Instant::now());
        managers.note_frame(CLIENT, begun);
        assert_eq!(managers.due(), None);
        managers.note_batch(CLIENT);
        managers.note_frame(CLIENT, begun);
        managers.note_frame(ConnectionId(2), begun);
        managers.note_batch(CLIENT);
        assert!(managers.take_late(begun + PATIENCE * 9).is_empty());
    }
}
