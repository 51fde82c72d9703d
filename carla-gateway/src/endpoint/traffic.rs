//! Traffic Managers of clients, and waking one that has slept through a frame.
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

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::Instant;

use super::Endpoint;
use crate::rpc::ConnectionId;

/// Traffic Managers of one endpoint.
const MANAGERS_MAX: usize = 1_024;
/// Letters of a host's name.
const HOST_BYTES_MAX: usize = 255;
/// How long a client may be silent while its step is awaited; real steps are full of calls.
const PATIENCE: Duration = Duration::from_secs(2);
/// Deadline of a call to a Traffic Manager.
const CALL_DEADLINE: Duration = Duration::from_secs(2);

/// All Traffic Managers of an endpoint, by their ports.
#[derive(Default)]
pub(crate) struct TrafficManagers {
    running: BTreeMap<u16, Manager>,
}

struct Manager {
    host: String,
    owner: ConnectionId,
    /// Whether a batch has come since the last tick of its client.
    steps: bool,
    /// Until when the batch of the newest frame, or another sign of life, is awaited.
    due: Option<Instant>,
}

impl TrafficManagers {
    /// The host that a client gave for a port.
    pub(crate) fn host(&self, port: u16) -> Option<&str> {
        self.running.get(&port).map(|manager| manager.host.as_str())
    }

    /// Notes a new one; `false` when the port is taken or there are too many.
    pub(crate) fn add(&mut self, port: u16, host: String, owner: ConnectionId) -> bool {
        let is_free = !self.running.contains_key(&port)
            && self.running.len() < MANAGERS_MAX
            && host.len() <= HOST_BYTES_MAX;
        if is_free {
            self.running.insert(port, Manager { host, owner, steps: false, due: None });
        }
        is_free
    }

    /// Whether there was one.
    pub(crate) fn remove(&mut self, port: u16) -> bool {
        self.running.remove(&port).is_some()
    }

    /// How many run in a client.
    pub(super) fn count(&mut self, client: ConnectionId) -> usize {
        self.of(client).count()
    }

    /// Whether any runs in another client.
    pub(super) fn run_beside(&self, client: ConnectionId) -> bool {
        self.running.values().any(|manager| manager.owner != client)
    }

    /// A client and all it runs are gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
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

    /// A client waits for the steps of its Traffic Managers.
    pub(super) fn note_frame(&mut self, client: ConnectionId, now: Instant) {
        for manager in self.of(client).filter(|manager| manager.steps) {
            manager.steps = false;
            manager.due = Some(now + PATIENCE);
        }
    }

    /// When the next look at who is late is due.
    pub(super) fn next_due(&self) -> Option<Instant> {
        self.running.values().filter_map(|manager| manager.due).min()
    }

    /// Ports and clients of those that have slept through a frame; each is told once.
    pub(super) fn take_late(&mut self, now: Instant) -> Vec<(u16, ConnectionId)> {
        let late = self.running.iter_mut().filter_map(|(port, manager)| {
            manager.due.take_if(|due| *due <= now).map(|_| (*port, manager.owner))
        });
        late.collect()
    }

    fn of(&mut self, client: ConnectionId) -> impl Iterator<Item = &mut Manager> {
        self.running.values_mut().filter(move |manager| manager.owner == client)
    }
}

impl Endpoint {
    /// Wakes Traffic Managers that have slept through a frame.
    pub(super) fn wake_late_managers(&mut self) {
        for (port, client) in self.traffic_managers.take_late(Instant::now()) {
            if let Some(host) = self.clients.get(&client) {
                tokio::spawn(wake(host.address, port));
            }
        }
    }
}

/// Signals the newest frame once more to a Traffic Manager.
async fn wake(host: IpAddr, port: u16) {
    tracing::warn!(%host, port, "a Traffic Manager has slept through a frame and is woken");
    let waking = async {
        let mut manager = TcpStream::connect((host, port)).await?;
        for mode in [false, true] {
            let call = rmp_serde::to_vec(&(0, u32::from(mode), "set_synchronous_mode", (mode,)));
            manager.write_all(&call.map_err(std::io::Error::other)?).await?;
            // Of no use but for the order: the first call is over before the second.
            let _ = manager.read(&mut [0; 64]).await?;
        }
        Ok::<(), std::io::Error>(())
    };
    match tokio::time::timeout(CALL_DEADLINE, waking).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::warn!(%host, port, %error, "a Traffic Manager cannot be woken"),
        Err(_) => tracing::warn!(%host, port, "a Traffic Manager does not answer"),
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use tokio::net::TcpListener;

    use super::*;

    const CLIENT: ConnectionId = ConnectionId(1);

    fn one() -> TrafficManagers {
        let mut managers = TrafficManagers::default();
        assert!(managers.add(8_000, "127.0.0.1".to_owned(), CLIENT));
        assert!(!managers.add(8_000, "127.0.0.1".to_owned(), ConnectionId(2)));
        managers
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
        assert_eq!(managers.next_due(), None);
    }

    #[test]
    fn who_has_stepped_or_never_did_is_not_late() {
        let (mut managers, begun) = (one(), Instant::now());
        managers.note_frame(CLIENT, begun);
        assert_eq!(managers.next_due(), None);
        managers.note_batch(CLIENT);
        managers.note_frame(CLIENT, begun);
        managers.note_frame(ConnectionId(2), begun);
        managers.note_batch(CLIENT);
        assert!(managers.take_late(begun + PATIENCE * 9).is_empty());
    }

    #[tokio::test]
    async fn waking_signals_and_leaves_the_mode_as_it_was() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let port = listener.local_addr().unwrap().port();
        let waking = tokio::spawn(wake(Ipv4Addr::LOCALHOST.into(), port));
        let (mut socket, _) = listener.accept().await.unwrap();
        let mut modes = Vec::new();
        for _ in 0..2 {
            let mut call = [0; 64];
            let count = socket.read(&mut call).await.unwrap();
            let call: (u8, u32, String, (bool,)) = rmp_serde::from_slice(&call[..count]).unwrap();
            assert_eq!(call.2, "set_synchronous_mode");
            modes.push(call.3.0);
            socket.write_all(&[0x94, 1, call.1 as u8, 0xc0, 0xc0]).await.unwrap();
        }
        assert_eq!(modes, [false, true]);
        waking.await.unwrap();
    }
}
