//! Connections to streams: a client names a stream and then only receives.

use std::sync::Arc;
use std::time::Duration;

use bytes::Buf;
use seats::Seat;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::StreamId;
use super::hub::{Hub, Listener};
use crate::guests::Entrance;

/// Listeners of one endpoint at once.
pub(crate) const LISTENERS_MAX: usize = 2_048;
/// How long a client may take to say which stream it wants.
const NAME_WAIT: Duration = Duration::from_secs(5);

/// How long a client may take none of a message.
const MESSAGE_WAIT: Duration = Duration::from_secs(30);
/// How long a client may take to read the rest of a stream that ended.
const REST_WAIT: Duration = Duration::from_secs(2);

/// Accepts listeners for ever.
pub(crate) async fn serve(entrance: Entrance, hub: Arc<Hub>) {
    loop {
        let (socket, seat) = entrance.accept().await;
        let hub = Arc::clone(&hub);
        tokio::spawn(async move { attend(socket, &seat, &hub).await });
    }
}

/// Delivers a stream once it is named. Who names none gives way to who comes when seats are rare.
async fn attend(mut socket: TcpStream, seat: &Seat, hub: &Hub) {
    let mut name = [0; 4];
    let named = tokio::select! {
        named = tokio::time::timeout(NAME_WAIT, socket.read_exact(&mut name)) => named,
        () = seat.wanted() => return,
    };
    let Ok(Ok(_)) = named else { return };
    seat.begin();
    let stream = StreamId(u32::from_le_bytes(name));
    let Some(listener) = hub.listen(stream) else {
        tracing::debug!(stream = stream.0, "a client wants a stream that does not exist");
        return;
    };
    let id = listener.id;
    deliver(socket, listener, MESSAGE_WAIT).await;
    hub.leave(stream, id);
}

/// Sends messages until the stream ends or the client goes.
async fn deliver(socket: TcpStream, mut listener: Listener, message_wait: Duration) {
    let (mut reader, mut writer) = socket.into_split();
    let mut nothing = [0; 16];
    loop {
        let letter = tokio::select! {
            letter = listener.letters.recv() => letter,
            // Clients say nothing more: whatever this gives, they are gone.
            _ = reader.read(&mut nothing) => return,
        };
        let Some(letter) = letter else { break };
        let length = (letter.message.len() as u32).to_le_bytes();
        let mut framed = Buf::chain(&length[..], &letter.message[..]);
        while framed.has_remaining() {
            match tokio::time::timeout(message_wait, writer.write_buf(&mut framed)).await {
                Ok(Ok(_)) => {}
                Ok(Err(_)) => return,
                Err(_) => {
                    return tracing::warn!("a listener that takes nothing is disconnected");
                }
            }
        }
    }
    // The client closes its side when it has dealt with everything before the end.
    if writer.shutdown().await.is_ok() {
        let _ = tokio::time::timeout(REST_WAIT, reader.read(&mut nothing)).await;
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
        let (socket, _) = listening.accept().await.unwrap();
        let hub = Hub::new();
        hub.open(StreamId(7), false);
        let listener = hub.listen(StreamId(7)).unwrap();
        for _ in 0..4 {
            // More than the system keeps for a socket.
            hub.publish(StreamId(7), vec![0; 16 * 1024 * 1024], false).await;
        }
        deliver(socket, listener, Duration::from_millis(20)).await;
    }
}
