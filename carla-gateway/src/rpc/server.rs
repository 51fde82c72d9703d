//! Connections: one task that reads and one that writes each.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use schemas::Tenant;
use seats::Seat;
use tokio::io::{AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::{Notify, mpsc};

use super::backlog::{Backlog, Counted, Share};
use super::intake::{Room, read};
use super::message::{Answer, ConnectionId, Payload, Request, Ticket, encode_reply};
use crate::guests::Entrance;
use crate::whereabouts::Whereabouts;

/// Connections of one endpoint at once.
pub(crate) const CONNECTIONS_MAX: usize = 256;
/// Replies that may wait for a client that does not read.
const REPLIES_MAX: usize = 4_096;
/// How long a client may take none of the bytes of a reply.
const WRITE_WAIT: Duration = Duration::from_secs(30);
/// Bytes written at once.
const WRITE_BYTES: usize = 256 * 1024;

/// What connections tell, in the order in which it happens.
#[derive(Debug)]
pub(crate) enum Event {
    /// A client connected; replies to it go there.
    Connected(ConnectionId, Whereabouts, Outbox),
    /// A client calls.
    Called(Ticket, Request),
    /// A client is gone.
    Disconnected(ConnectionId),
}

/// Where replies to one client go. Never waits.
#[derive(Clone, Debug)]
pub(crate) struct Outbox {
    replies: mpsc::Sender<Reply>,
    share: Share,
    overrun: Arc<Notify>,
}

/// A reply that waits to be written.
#[derive(Debug)]
struct Reply {
    bytes: Vec<u8>,
    _counted: Counted,
}

impl Outbox {
    /// Answers a call. A client that does not read what it asked for is disconnected.
    pub(crate) fn answer(&self, ticket: &Ticket, answer: &Answer) {
        if !ticket.asynchronous {
            self.send(ticket.reply(answer));
        }
    }

    /// Tells that an asynchronous call has come.
    pub(super) fn acknowledge(&self, id: u32) {
        self.send(encode_reply(id, &Ok(Payload::Void), true));
    }

    fn send(&self, bytes: Vec<u8>) {
        let counted = self.share.count(bytes.len());
        let reply = counted.map(|counted| Reply { bytes, _counted: counted });
        if reply.is_none_or(|reply| self.replies.try_send(reply).is_err()) {
            self.overrun.notify_one();
        }
    }

    /// One that nobody reads.
    #[cfg(test)]
    pub(super) fn for_test() -> Self {
        let (replies, _) = mpsc::channel(1);
        Self { replies, share: Backlog::default().share(), overrun: Arc::default() }
    }
}

/// Accepts clients for ever, and tells of their calls in the order of arrival.
pub(crate) async fn serve(entrance: Entrance, events: mpsc::Sender<Event>) {
    let ids = AtomicU64::new(1);
    let (room, backlog) = (Room::new(), Backlog::default());
    loop {
        let (socket, seat) = entrance.accept().await;
        let id = ConnectionId(ids.fetch_add(1, Ordering::Relaxed));
        let (room, share, events) = (room.clone(), backlog.share(), events.clone());
        let tenant = entrance.tenant.clone();
        tokio::spawn(async move {
            converse((socket, &seat), (id, tenant), share, &room, events).await;
        });
    }
}

/// Serves a client until it is gone. One that has never called gives way to who comes when seats
/// are rare.
async fn converse(
    (socket, seat): (TcpStream, &Seat),
    (id, tenant): (ConnectionId, Tenant),
    share: Share,
    room: &Room,
    events: mpsc::Sender<Event>,
) {
    let (Ok(here), Ok(there)) = (socket.local_addr(), socket.peer_addr()) else { return };
    let whereabouts = Whereabouts { here, there };
    let tell = |what: &str| {
        let (port, connection) = (here.port(), id.0);
        tracing::debug!(target: "audit", %tenant, peer = %there, port, connection, "{what}");
    };
    tell("a CARLA client connects");
    let (reader, writer) = socket.into_split();
    let (replies, outgoing) = mpsc::channel(REPLIES_MAX);
    let outbox = Outbox { replies, share, overrun: Arc::new(Notify::new()) };
    let writing = tokio::spawn(write(writer, outgoing, Arc::clone(&outbox.overrun), WRITE_WAIT));
    if events.send(Event::Connected(id, whereabouts, outbox.clone())).await.is_ok() {
        let overrun = Arc::clone(&outbox.overrun);
        tokio::select! {
            reason = read(reader, (id, seat), &outbox, room, &events) => {
                if let Some(reason) = reason {
                    tracing::warn!(connection = id.0, reason, "a client is disconnected");
                }
            }
            _ = seat.wanted() => {
                tracing::warn!(connection = id.0, "a client that never called gives way to another");
            }
            () = overrun.notified() => {
                tracing::warn!(connection = id.0, "a client that does not read is disconnected");
            }
        }
    }
    writing.abort();
    tell("a CARLA client is gone");
    // An endpoint that has ended needs no telling.
    let _ = events.send(Event::Disconnected(id)).await;
}

/// Writes replies until the client is gone, or takes nothing for too long.
async fn write(
    mut writer: impl AsyncWrite + Unpin,
    mut outgoing: mpsc::Receiver<Reply>,
    overrun: Arc<Notify>,
    wait: Duration,
) {
    while let Some(reply) = outgoing.recv().await {
        for part in reply.bytes.chunks(WRITE_BYTES) {
            match tokio::time::timeout(wait, writer.write_all(part)).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) => return,
                Err(_) => return overrun.notify_one(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use seats::Seats;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpListener;

    use super::*;
    use crate::guests::Guests;

    /// A client that has asked for something, and the way back to it.
    async fn connected() -> (TcpStream, Outbox, mpsc::Receiver<Event>) {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let address = listener.local_addr().unwrap();
        let (events, mut told) = mpsc::channel(8);
        let tenant = "alice".parse().unwrap();
        let entrance =
            Entrance::new(listener, Guests::default(), tenant, Seats::new(CONNECTIONS_MAX));
        tokio::spawn(serve(entrance, events));
        let client = TcpStream::connect(address).await.unwrap();
        let Some(Event::Connected(_, whereabouts, outbox)) = told.recv().await else {
            panic!("nobody connected");
        };
        assert!(whereabouts.is_here());
        (client, outbox, told)
    }

    #[tokio::test]
    async fn a_client_that_reads_nothing_is_disconnected_before_its_replies_fill_the_memory() {
        let (mut client, outbox, mut told) = connected().await;
        let answer = Ok(Payload::Value(vec![0; 1024 * 1024]));
        let mut sent = 0;
        while told.is_empty() {
            sent += 1;
            assert!(sent < 1_000, "a gigabyte waits");
            outbox.answer(&Ticket::for_test(ConnectionId(1), sent), &answer);
            tokio::task::yield_now().await;
        }
        assert!(matches!(told.recv().await, Some(Event::Disconnected(_))));
        let mut rest = Vec::new();
        let _ = client.read_to_end(&mut rest).await;
        assert!(rest.len() < 1_000 * 1024 * 1024);
    }

    #[tokio::test]
    async fn a_client_that_takes_none_of_a_reply_is_waited_for_so_long() {
        let (near, _far) = tokio::io::duplex(1_024);
        let (replies, outgoing) = mpsc::channel(1);
        let outbox = Outbox { replies, share: Backlog::default().share(), overrun: Arc::default() };
        let overrun = Arc::clone(&outbox.overrun);
        outbox.send(vec![0; 4_096]);
        write(near, outgoing, Arc::clone(&overrun), Duration::from_millis(20)).await;
        overrun.notified().await;
    }

    #[tokio::test]
    async fn who_never_calls_keeps_nobody_out_and_who_did_is_kept() {
        let call = rmp_serde::to_vec(&(0, 7, "version", ((false,),))).unwrap();
        let (mut first, _, mut told) = connected().await;
        let address = first.peer_addr().unwrap();
        first.write_all(&call).await.unwrap();
        let Some(Event::Called(..)) = told.recv().await else { panic!("no call") };
        let ids = tokio::spawn(async move {
            let mut called = Vec::new();
            while called.len() < 2 {
                if let Some(Event::Called(ticket, _)) = told.recv().await {
                    called.push(ticket.client);
                }
            }
            called
        });
        let mut silent = Vec::new();
        for _ in 0..CONNECTIONS_MAX + 40 {
            let mut stream = TcpStream::connect(address).await.unwrap();
            // Half a call is none.
            stream.write_all(&call[..5]).await.unwrap();
            silent.push(stream);
        }
        let mut last = TcpStream::connect(address).await.unwrap();
        last.write_all(&call).await.unwrap();
        first.write_all(&call).await.unwrap();
        let called = tokio::time::timeout(Duration::from_secs(20), ids).await;
        assert!(called.expect("nobody is served").unwrap().contains(&ConnectionId(1)));
        let mut end = Vec::new();
        // What it sent was not read, or was: its end looks different.
        let _ = silent[0].read_to_end(&mut end).await;
    }

    #[tokio::test]
    async fn a_call_is_told_and_its_answer_comes_back() {
        let (mut client, outbox, mut told) = connected().await;
        let call = rmp_serde::to_vec(&(0, 7, "version", ((false,),))).unwrap();
        client.write_all(&call).await.unwrap();
        let Some(Event::Called(ticket, request)) = told.recv().await else { panic!("no call") };
        assert_eq!((request.method.as_str(), ticket.id), ("version", 7));
        outbox.answer(&ticket, &Payload::value("0.9.16"));
        let mut version = [0; 18];
        client.read_exact(&mut version).await.unwrap();
        assert_eq!(version[..11], [0x94, 1, 0xce, 0, 0, 0, 7, 0xc0, 0x91, 0x92, 0x01]);
        assert_eq!(version[11..], *b"\xa60.9.16");
    }
}
