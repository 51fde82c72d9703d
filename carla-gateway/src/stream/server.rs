//! Connections to streams: a client names a stream and then only receives.

use std::sync::Arc;
use std::time::Duration;

use bytes::Buf;
use seats::{Reason, Seat, Seats};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::StreamId;
use super::hub::{Hub, Listener};
use crate::guests::Entrance;

/// Listeners of one endpoint at once.
const LISTENERS_MAX: usize = 2_048;
/// Those of them that may rest on streams that are over, so that they never fill the seats.
const RESTING_MAX: usize = LISTENERS_MAX / 4;
/// How long a client may take to say which stream it wants.
const NAME_WAIT: Duration = Duration::from_secs(5);

/// How long a client may take none of a message.
const MESSAGE_WAIT: Duration = Duration::from_secs(30);
/// How long a client may take to read the rest of a stream that ended.
const REST_WAIT: Duration = Duration::from_secs(2);
/// Before the connection of a stream that is over gives way to another one.
const COMING_BACK: Duration = Duration::from_millis(100);
/// Before one of too many such connections ends: nobody waits for its seat, and its client may come
/// back for ever. CARLA's client waits as long before it tries a server again that is not there.
const TOO_MANY_COMING_BACK: Duration = Duration::from_secs(1);

/// Those of the listeners of one endpoint.
pub(crate) fn seats() -> Seats {
    Seats::with_resting(LISTENERS_MAX, RESTING_MAX)
}

/// Accepts listeners for ever.
pub(crate) async fn serve(entrance: Entrance, hub: Arc<Hub>) {
    loop {
        let (socket, seat) = entrance.accept().await;
        let hub = Arc::clone(&hub);
        tokio::spawn(async move { attend(socket, &seat, &hub).await });
    }
}

/// Delivers a stream once it is named. Who names none, or one that is over, gives way to who comes
/// when seats are rare.
async fn attend(mut socket: TcpStream, seat: &Seat, hub: &Hub) {
    let mut name = [0; 4];
    let named = tokio::select! {
        named = tokio::time::timeout(NAME_WAIT, socket.read_exact(&mut name)) => named,
        _ = seat.wanted() => return,
    };
    let Ok(Ok(_)) = named else { return };
    seat.begin();
    let stream = StreamId(u32::from_le_bytes(name));
    let Some(listener) = hub.listen(stream) else {
        tracing::debug!(stream = stream.0, "a client wants a stream that does not exist");
        return rest(&mut socket, seat, std::future::pending()).await;
    };
    let id = listener.id;
    // Who is sent away from a stream that goes on is to come back.
    if deliver(&mut socket, listener, MESSAGE_WAIT).await && !hub.is_open(stream) {
        rest(&mut socket, seat, asked_to_leave(hub, id)).await;
        if hub.is_leaving(id) && socket.shutdown().await.is_ok() {
            // The client closes its side when it has dealt with everything before the end.
            let _ = tokio::time::timeout(REST_WAIT, socket.read(&mut [0; 16])).await;
        }
    }
    hub.leave(stream, id);
}

/// Keeps a connection on which nothing more comes, until the client goes, somebody else needs the
/// seat, or something else ends it.
async fn rest(socket: &mut TcpStream, seat: &Seat, ended: impl Future<Output = ()>) {
    seat.rest();
    let mut nothing = [0; 16];
    tokio::select! {
        // Clients say nothing more: whatever this gives, they are gone.
        _ = socket.read(&mut nothing) => {}
        // Who is sent away comes back at once.
        reason = seat.wanted() => tokio::time::sleep(match reason {
            Reason::Newcomer => COMING_BACK,
            Reason::TooManyRest => TOO_MANY_COMING_BACK,
        }).await,
        () = ended => {}
    }
}

/// Returns when a listener is to read the rest and leave.
async fn asked_to_leave(hub: &Hub, listener: u64) {
    let mut changes = hub.changes();
    while !hub.is_leaving(listener) {
        if changes.changed().await.is_err() {
            return;
        }
    }
}

/// Sends messages until no more come, which gives true, or the client goes.
async fn deliver(socket: &mut TcpStream, mut listener: Listener, message_wait: Duration) -> bool {
    let (mut reader, mut writer) = socket.split();
    let mut nothing = [0; 16];
    loop {
        let letter = tokio::select! {
            letter = listener.letters.recv() => letter,
            // Clients say nothing more: whatever this gives, they are gone.
            _ = reader.read(&mut nothing) => return false,
        };
        let Some(letter) = letter else { return true };
        let length = (letter.message.len() as u32).to_le_bytes();
        let mut framed = Buf::chain(&length[..], &letter.message[..]);
        while framed.has_remaining() {
            match tokio::time::timeout(message_wait, writer.write_buf(&mut framed)).await {
                Ok(Ok(_)) => {}
                Ok(Err(_)) => return false,
                Err(_) => {
                    tracing::warn!("a listener that takes nothing is disconnected");
                    return false;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use tokio::net::TcpListener;

    use super::*;

    #[tokio::test]
    async fn a_listener_that_takes_nothing_is_disconnected_in_any_mode() {
        let listening = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let _asleep = TcpStream::connect(listening.local_addr().unwrap()).await.unwrap();
        let (mut socket, _) = listening.accept().await.unwrap();
        let hub = Hub::new();
        hub.open(StreamId(7), false);
        let listener = hub.listen(StreamId(7)).unwrap();
        for _ in 0..4 {
            // More than the system keeps for a socket.
            hub.publish(StreamId(7), vec![0; 16 * 1024 * 1024], false).await;
        }
        assert!(!deliver(&mut socket, listener, Duration::from_millis(20)).await);
    }

    /// A connection that has named a stream, in a seat of its own.
    async fn connection(hub: &Arc<Hub>, stream: u32) -> TcpStream {
        connection_in(&Seats::new(1), hub, stream).await
    }

    /// A connection that has named a stream, and is attended to.
    async fn connection_in(seats: &Seats, hub: &Arc<Hub>, stream: u32) -> TcpStream {
        let listening = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let mut client = TcpStream::connect(listening.local_addr().unwrap()).await.unwrap();
        let (socket, peer) = listening.accept().await.unwrap();
        let (hub, seat) = (Arc::clone(hub), seats.take(peer.ip()).await);
        tokio::spawn(async move { attend(socket, &seat, &hub).await });
        client.write_all(&stream.to_le_bytes()).await.unwrap();
        client
    }

    /// Whether a client finds its connection ended within a moment.
    async fn is_ended(client: &mut TcpStream) -> bool {
        let read =
            tokio::time::timeout(Duration::from_millis(100), client.read(&mut [0; 16])).await;
        read.is_ok()
    }

    /// Reads until the connection ends, for ten seconds at most; whether it has.
    async fn ends(client: &mut TcpStream) -> bool {
        tokio::time::timeout(Duration::from_secs(10), client.read(&mut [0; 16])).await.is_ok()
    }

    #[tokio::test]
    async fn of_too_many_connections_to_streams_that_are_over_the_oldest_ends() {
        let (hub, seats) = (Arc::new(Hub::new()), Seats::with_resting(8, 2));
        hub.open(StreamId(7), false);
        let mut listening = connection_in(&seats, &hub, 7).await;
        let mut oldest = connection_in(&seats, &hub, 8).await;
        let mut younger = Vec::new();
        for _ in 0..2 {
            assert!(!is_ended(&mut oldest).await, "two may rest");
            younger.push(connection_in(&seats, &hub, 8).await);
        }
        assert!(ends(&mut oldest).await);
        assert!(!is_ended(&mut listening).await);
        assert!(!is_ended(&mut younger[0]).await && !is_ended(&mut younger[1]).await);
    }

    #[tokio::test]
    async fn streams_that_are_over_take_a_quarter_of_the_seats_at_most() {
        let (seats, mut resting) = (seats(), Vec::new());
        for _ in 0..=LISTENERS_MAX / 4 {
            let seat = seats.take(Ipv4Addr::LOCALHOST.into()).await;
            seat.begin();
            seat.rest();
            resting.push(seat);
        }
        assert_eq!(resting[0].wanted().await, Reason::TooManyRest);
    }

    #[tokio::test]
    async fn who_rests_gives_its_seat_to_a_newcomer() {
        let (hub, seats) = (Arc::new(Hub::new()), Seats::new(1));
        hub.open(StreamId(7), false);
        let mut resting = connection_in(&seats, &hub, 8).await;
        let late = tokio::time::Instant::now() + Duration::from_secs(10);
        let newcomer = connection_in(&seats, &hub, 7);
        let newcomer = tokio::time::timeout_at(late, newcomer).await.unwrap();
        assert!(ends(&mut resting).await);
        hub.wait_for(StreamId(7), 1, late).await;
        assert_eq!(hub.listener_count(StreamId(7)), 1);
        drop(newcomer);
    }

    #[tokio::test]
    async fn who_is_sent_away_from_a_stream_that_goes_on_is_disconnected() {
        let hub = Arc::new(Hub::new());
        hub.open(StreamId(7), false);
        let late = tokio::time::Instant::now() + Duration::from_secs(5);
        let mut client = connection(&hub, 7).await;
        hub.wait_for(StreamId(7), 1, late).await;
        assert!(!is_ended(&mut client).await);
        hub.leave(StreamId(7), 0);
        assert!(is_ended(&mut client).await);
    }

    #[tokio::test]
    async fn who_listens_to_what_is_over_keeps_the_connection_until_a_load() {
        let hub = Arc::new(Hub::new());
        hub.open(StreamId(7), false);
        let late = tokio::time::Instant::now() + Duration::from_secs(5);
        let mut earlier = connection(&hub, 7).await;
        hub.wait_for(StreamId(7), 1, late).await;
        let mut newest = connection(&hub, 7).await;
        hub.wait_for(StreamId(7), 2, late).await;
        hub.close(StreamId(7));
        let mut nowhere = connection(&hub, 8).await;
        for client in [&mut earlier, &mut newest, &mut nowhere] {
            assert!(!is_ended(client).await);
        }
        let loading = tokio::spawn({
            let hub = Arc::clone(&hub);
            async move { hub.wait_for_leaving(late).await }
        });
        assert!(is_ended(&mut newest).await && !is_ended(&mut earlier).await);
        drop(newest);
        loading.await.unwrap();
        assert!(tokio::time::Instant::now() < late, "nobody was noticed to leave");
    }
}
