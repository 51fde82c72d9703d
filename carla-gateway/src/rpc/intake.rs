//! What comes in: requests cut out of the bytes of one connection, within the room that all
//! connections of an endpoint share.

use std::sync::Arc;
use std::time::Duration;

use seats::Seat;
use tokio::io::{AsyncRead, AsyncReadExt};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::time::Instant;

use super::framing::Framer;
use super::message::{ConnectionId, Request};
use super::server::{Event, Outbox};

/// Bytes read at once.
const READ_BYTES: usize = 64 * 1024;
/// Bytes of requests that wait for their turn.
const WAITING_BYTES_MAX: usize = 256 * 1024 * 1024;
/// Bytes of a request that needs one of the places for large ones.
const LARGE_BYTES: usize = 1024 * 1024;
/// Large requests that may be on their way at once.
const LARGE_MAX: usize = 4;
/// How long one of them may take.
const LARGE_WAIT: Duration = Duration::from_secs(60);

/// Room for the requests of one endpoint. Who finds none is read more slowly.
#[derive(Clone, Debug)]
pub(super) struct Room {
    waiting: Arc<Semaphore>,
    large: Arc<Semaphore>,
    large_wait: Duration,
}

impl Room {
    /// All of it.
    pub(super) fn new() -> Self {
        Self {
            waiting: Arc::new(Semaphore::new(WAITING_BYTES_MAX)),
            large: Arc::new(Semaphore::new(LARGE_MAX)),
            large_wait: LARGE_WAIT,
        }
    }

    async fn of(&self, bytes: usize) -> Option<OwnedSemaphorePermit> {
        let bytes = u32::try_from(bytes.min(WAITING_BYTES_MAX)).ok()?;
        Arc::clone(&self.waiting).acquire_many_owned(bytes).await.ok()
    }
}

/// A place for a large request, and until when it may be kept.
struct Place {
    _held: OwnedSemaphorePermit,
    until: Instant,
}

/// Reads until the client closes, or sends what cannot be understood: then says what.
pub(super) async fn read(
    mut reader: impl AsyncRead + Unpin,
    (id, seat): (ConnectionId, &Seat),
    outbox: &Outbox,
    room: &Room,
    events: &mpsc::Sender<Event>,
) -> Option<String> {
    let mut framer = Framer::default();
    let mut buffer = vec![0; READ_BYTES];
    let mut place: Option<Place> = None;
    loop {
        let reading = reader.read(&mut buffer);
        let read = match &place {
            None => reading.await,
            Some(place) => match tokio::time::timeout_at(place.until, reading).await {
                Ok(read) => read,
                Err(_) => return Some("a large request that does not come".to_owned()),
            },
        };
        let count = match read {
            Ok(0) | Err(_) => return None,
            Ok(count) => count,
        };
        framer.push(buffer.get(..count)?);
        loop {
            match framer.next() {
                Ok(None) => break,
                Err(malformed) => return Some(malformed.to_string()),
                Ok(Some(bytes)) => {
                    place = None;
                    let Some(mut request) = Request::parse(&bytes) else {
                        return Some("an object that is no request".to_owned());
                    };
                    seat.begin();
                    request.take_room(room.of(bytes.len()).await?);
                    if request.asynchronous {
                        outbox.acknowledge(request.id);
                    }
                    events.send(Event::Called(request.ticket(id), request)).await.ok()?;
                }
            }
        }
        if framer.len() > LARGE_BYTES && place.is_none() {
            let held = Arc::clone(&room.large).acquire_owned().await.ok()?;
            place = Some(Place { _held: held, until: Instant::now() + room.large_wait });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use seats::Seats;
    use tokio::io::AsyncWriteExt;

    use super::*;

    /// `[0, 1, "x", [[false], text of so many bytes]]`.
    fn request(bytes: usize) -> Vec<u8> {
        let mut request = vec![0x94, 0, 1, 0xa1, b'x', 0x92, 0x91, 0xc2, 0xc6];
        request.extend_from_slice(&(bytes as u32).to_be_bytes());
        request.resize(request.len() + bytes, 7);
        request
    }

    /// Lets everybody else do what they can.
    async fn idle() {
        for _ in 0..1_000 {
            tokio::task::yield_now().await;
        }
    }

    /// Reads from a client, with this room; gives the way to it and what it tells.
    fn client(room: &Room) -> (tokio::io::DuplexStream, mpsc::Receiver<Event>) {
        let (near, far) = tokio::io::duplex(READ_BYTES);
        let (events, told) = mpsc::channel(8);
        let room = room.clone();
        tokio::spawn(async move {
            let outbox = Outbox::for_test();
            let seat = Seats::new(1).take(Ipv4Addr::LOCALHOST.into()).await;
            read(far, (ConnectionId(1), &seat), &outbox, &room, &events).await
        });
        (near, told)
    }

    #[tokio::test]
    async fn as_many_large_requests_come_at_once_as_there_are_places() {
        let room = Room::new();
        let large = request(3 * LARGE_BYTES);
        let (begun, rest) = large.split_at(2 * LARGE_BYTES);
        let mut clients: Vec<_> = (0..LARGE_MAX).map(|_| client(&room)).collect();
        for (client, _) in &mut clients {
            client.write_all(begun).await.unwrap();
        }
        let (mut late, mut told) = client(&room);
        let sending = tokio::spawn({
            let large = large.clone();
            async move { late.write_all(&large).await.map(|()| late) }
        });
        idle().await;
        assert!(!sending.is_finished(), "more came than there are places for");
        let (first, first_told) = &mut clients[0];
        first.write_all(rest).await.unwrap();
        assert!(matches!(first_told.recv().await, Some(Event::Called(..))));
        assert!(matches!(told.recv().await, Some(Event::Called(..))));
        sending.await.unwrap().unwrap();
    }

    #[tokio::test]
    async fn a_large_request_that_does_not_come_is_waited_for_so_long() {
        let room = Room { large_wait: Duration::from_millis(20), ..Room::new() };
        let (mut client, mut told) = client(&room);
        client.write_all(&request(3 * LARGE_BYTES)[..2 * LARGE_BYTES]).await.unwrap();
        assert!(told.recv().await.is_none());
        assert_eq!(room.large.available_permits(), LARGE_MAX);
    }

    #[tokio::test]
    async fn requests_wait_outside_when_those_that_wait_inside_take_up_all_room() {
        let room = Room::new();
        let (mut client, mut told) = client(&room);
        let all = room.of(WAITING_BYTES_MAX).await.unwrap();
        client.write_all(&request(100)).await.unwrap();
        idle().await;
        assert!(told.is_empty());
        drop(all);
        assert!(matches!(told.recv().await, Some(Event::Called(..))));
    }
}
