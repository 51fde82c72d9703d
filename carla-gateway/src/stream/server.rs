//! Connections to streams: a client names a stream and then only receives.

use std::sync::Arc;
use std::time::Duration;

use bytes::Buf;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};

use super::hub::{Hub, Listener};
use crate::endpoint::Event;

/// Listeners of one endpoint at once.
const LISTENERS_MAX: usize = 2_048;
/// How long a client may take to say which stream it wants.
const NAME_WAIT: Duration = Duration::from_secs(5);

/// How long a client may take to read the rest of a stream that ended.
const REST_WAIT: Duration = Duration::from_secs(2);

/// Accepts listeners for ever.
pub(crate) async fn serve(listener: TcpListener, hub: Arc<Hub>, events: mpsc::Sender<Event>) {
    let seats = Arc::new(Semaphore::new(LISTENERS_MAX));
    loop {
        let Ok(seat) = Arc::clone(&seats).acquire_owned().await else { return };
        let Ok((socket, _)) = listener.accept().await else {
            tokio::task::yield_now().await;
            continue;
        };
        let (hub, events) = (Arc::clone(&hub), events.clone());
        tokio::spawn(async move {
            attend(socket, &hub, &events).await;
            drop(seat);
        });
    }
}

async fn attend(mut socket: TcpStream, hub: &Hub, events: &mpsc::Sender<Event>) {
    if let Err(error) = socket.set_nodelay(true) {
        tracing::debug!(%error, "a stream stays with Nagle's algorithm");
    }
    let mut name = [0; 4];
    let named = tokio::time::timeout(NAME_WAIT, socket.read_exact(&mut name)).await;
    let Ok(Ok(_)) = named else { return };
    let stream = u32::from_le_bytes(name);
    let Some(listener) = hub.listen(stream) else {
        tracing::debug!(stream, "a client wants a stream that does not exist");
        return;
    };
    let id = listener.id;
    deliver(socket, listener).await;
    if hub.leave(stream, id) == 0 {
        // An endpoint that has ended needs no telling.
        let _ = events.send(Event::Deserted(stream)).await;
    }
}

/// Sends messages until the stream ends or the client goes.
async fn deliver(socket: TcpStream, mut listener: Listener) {
    let (mut reader, mut writer) = socket.into_split();
    let mut nothing = [0; 16];
    loop {
        let message = tokio::select! {
            message = listener.messages.recv() => message,
            // Clients say nothing more: whatever this gives, they are gone.
            _ = reader.read(&mut nothing) => return,
        };
        let Some(message) = message else { break };
        let length = (message.len() as u32).to_le_bytes();
        let mut framed = Buf::chain(&length[..], &message[..]);
        if writer.write_all_buf(&mut framed).await.is_err() {
            return;
        }
    }
    // The client closes its side when it has dealt with everything before the end.
    if writer.shutdown().await.is_ok() {
        let _ = tokio::time::timeout(REST_WAIT, reader.read(&mut nothing)).await;
    }
}
