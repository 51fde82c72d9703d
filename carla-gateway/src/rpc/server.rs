//! Connections: one task that reads and one that writes each.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Notify, Semaphore, mpsc, watch};

use super::framing::Framer;
use super::gate::Gate;
use super::message::{Answer, Payload, Request, encode_reply};
use crate::calls;
use crate::dialect::EpisodeSettings;
use crate::endpoint::{Event, Whereabouts};

/// Connections of one endpoint at once.
const CONNECTIONS_MAX: usize = 256;
/// Replies that may wait for a client that does not read.
const REPLIES_MAX: usize = 4_096;
/// Bytes of such replies.
const REPLY_BYTES_MAX: usize = 256 * 1024 * 1024;
/// Bytes read at once.
const READ_BYTES: usize = 64 * 1024;

/// One connection in the life of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ConnectionId(pub(crate) u64);

/// Where replies to one client go. Never waits.
#[derive(Clone, Debug)]
pub(crate) struct Outbox {
    replies: mpsc::Sender<Vec<u8>>,
    waiting_bytes: Arc<AtomicUsize>,
    overrun: Arc<Notify>,
}

/// Who called.
#[derive(Clone, Debug)]
pub(crate) struct Connection {
    /// Which connection.
    pub(crate) id: ConnectionId,
    /// The way back.
    pub(crate) outbox: Outbox,
    /// Where its reads of the settings pass, or wait.
    pub(crate) gate: Arc<Gate>,
}

impl Outbox {
    /// Answers a request. A client that does not read what it asked for is disconnected.
    pub(crate) fn answer(&self, request: &Request, answer: &Answer) {
        if request.asynchronous {
            return;
        }
        self.send(encode_reply(request.id, answer, request.method != "apply_batch"));
    }

    fn acknowledge(&self, id: u32) {
        self.send(encode_reply(id, &Ok(Payload::Void), true));
    }

    fn send(&self, reply: Vec<u8>) {
        let bytes = reply.len();
        let waiting = self.waiting_bytes.fetch_add(bytes, Ordering::Relaxed);
        if waiting + bytes > REPLY_BYTES_MAX || self.replies.try_send(reply).is_err() {
            self.overrun.notify_one();
        }
    }
}

/// The way from a connection to its endpoint.
#[derive(Clone)]
pub(crate) struct Desk {
    /// Calls, in the order of arrival.
    pub(crate) events: mpsc::Sender<Event>,
    /// What can be told without the endpoint.
    pub(crate) settings: watch::Receiver<EpisodeSettings>,
}

/// Accepts clients for ever and hands their calls to the endpoint in the order of arrival.
pub(crate) async fn serve(listener: TcpListener, desk: Desk) {
    let seats = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    let ids = AtomicU64::new(1);
    loop {
        let Ok(seat) = Arc::clone(&seats).acquire_owned().await else { return };
        let (socket, address) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                tracing::warn!(%error, "a client could not connect");
                tokio::task::yield_now().await;
                continue;
            }
        };
        let id = ConnectionId(ids.fetch_add(1, Ordering::Relaxed));
        tracing::debug!(%address, connection = id.0, "a CARLA client connects");
        let desk = desk.clone();
        tokio::spawn(async move {
            converse(socket, id, desk).await;
            drop(seat);
        });
    }
}

async fn converse(socket: TcpStream, id: ConnectionId, desk: Desk) {
    let (Ok(here), Ok(there)) = (socket.local_addr(), socket.peer_addr()) else { return };
    let whereabouts = Whereabouts { address: there.ip(), is_here: here.ip() == there.ip() };
    if let Err(error) = socket.set_nodelay(true) {
        tracing::debug!(%error, "a connection stays with Nagle's algorithm");
    }
    let (reader, writer) = socket.into_split();
    let (replies, outgoing) = mpsc::channel(REPLIES_MAX);
    let outbox = Outbox {
        replies,
        waiting_bytes: Arc::new(AtomicUsize::new(0)),
        overrun: Arc::new(Notify::new()),
    };
    let writing = tokio::spawn(write(writer, outgoing, Arc::clone(&outbox.waiting_bytes)));
    if desk.events.send(Event::Connected(id, whereabouts)).await.is_ok() {
        let overrun = Arc::clone(&outbox.overrun);
        let connection = Connection { id, outbox, gate: Arc::default() };
        tokio::select! {
            reason = read(reader, &connection, &desk) => {
                if let Some(reason) = reason {
                    tracing::warn!(connection = id.0, reason, "a client is disconnected");
                }
            }
            () = overrun.notified() => {
                tracing::warn!(connection = id.0, "a client that does not read is disconnected");
            }
        }
    }
    writing.abort();
    // An endpoint that has ended needs no telling.
    let _ = desk.events.send(Event::Disconnected(id)).await;
}

/// Reads until the client closes, or sends what cannot be understood: then says what.
async fn read(mut reader: OwnedReadHalf, connection: &Connection, desk: &Desk) -> Option<String> {
    let mut framer = Framer::default();
    let mut buffer = vec![0; READ_BYTES];
    loop {
        let count = match reader.read(&mut buffer).await {
            Ok(0) | Err(_) => return None,
            Ok(count) => count,
        };
        framer.push(buffer.get(..count)?);
        loop {
            match framer.next() {
                Ok(None) => break,
                Err(malformed) => return Some(malformed.to_string()),
                Ok(Some(bytes)) => {
                    let Some(request) = Request::parse(&bytes) else {
                        return Some("an object that is no request".to_owned());
                    };
                    if request.asynchronous {
                        connection.outbox.acknowledge(request.id);
                    }
                    let answer = calls::at_once(&request, &desk.settings.borrow());
                    let event = if let Some(answer) = answer {
                        tell_at_once(request, &answer, connection);
                        Event::Answered(connection.id)
                    } else {
                        Event::Call(connection.clone(), request)
                    };
                    if desk.events.send(event).await.is_err() {
                        return None;
                    }
                }
            }
        }
    }
}

/// Gives an answer that needs no endpoint; reads of the settings may have to wait.
fn tell_at_once(request: Request, answer: &Answer, connection: &Connection) {
    if request.method == calls::READ_OF_SETTINGS {
        for read in connection.gate.pass(request) {
            connection.outbox.answer(&read, answer);
        }
    } else {
        connection.outbox.answer(&request, answer);
    }
}

async fn write(
    mut writer: OwnedWriteHalf,
    mut outgoing: mpsc::Receiver<Vec<u8>>,
    waiting_bytes: Arc<AtomicUsize>,
) {
    while let Some(reply) = outgoing.recv().await {
        if writer.write_all(&reply).await.is_err() {
            return;
        }
        waiting_bytes.fetch_sub(reply.len(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[tokio::test]
    async fn settings_and_version_are_told_while_the_endpoint_is_busy() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let address = listener.local_addr().unwrap();
        let (events, _nobody_takes_them) = mpsc::channel(8);
        let settings = EpisodeSettings { synchronous_mode: true, ..EpisodeSettings::default() };
        let (_posted, settings) = watch::channel(settings);
        tokio::spawn(serve(listener, Desk { events, settings }));
        let mut client = TcpStream::connect(address).await.unwrap();
        for (id, method) in [(1, "tick_cue"), (2, "version"), (3, "get_episode_settings")] {
            let call = rmp_serde::to_vec(&(0, id, method, ((false,),))).unwrap();
            client.write_all(&call).await.unwrap();
        }
        let mut version = [0; 18];
        client.read_exact(&mut version).await.unwrap();
        assert_eq!(version[..11], [0x94, 1, 0xce, 0, 0, 0, 2, 0xc0, 0x91, 0x92, 0x01]);
        assert_eq!(version[11..], *b"\xa60.9.16");
        let mut settings = [0; 11];
        client.read_exact(&mut settings).await.unwrap();
        // Without an error, with a value in its envelope.
        assert_eq!(settings, [0x94, 1, 0xce, 0, 0, 0, 3, 0xc0, 0x91, 0x92, 0x01]);
    }
}
