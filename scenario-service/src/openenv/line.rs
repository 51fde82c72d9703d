//! The socket of one client, which is not read further when much is unfinished elsewhere, and ends
//! when the client takes nothing.

use std::io;
use std::pin::Pin;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use seats::Seat;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore};
use tokio::time::Sleep;

use crate::limits::LARGE_BYTES;

/// What a client has sent that is not dealt with yet, and its seat.
#[derive(Debug)]
pub(super) struct Meter {
    /// Of the connection.
    pub(super) seat: Seat,
    unfinished_bytes: AtomicUsize,
    /// For a large message or body.
    place: Mutex<Option<OwnedSemaphorePermit>>,
}

impl Meter {
    fn new(seat: Seat) -> Self {
        Self { seat, unfinished_bytes: AtomicUsize::new(0), place: Mutex::new(None) }
    }

    /// What has come is dealt with, and takes up no memory any more.
    pub(super) fn finish(&self) {
        self.unfinished_bytes.store(0, Ordering::Relaxed);
        *self.place() = None;
    }

    /// So much of what has come was no part of a message.
    pub(super) fn discount(&self, bytes: usize) {
        let less = |unfinished: usize| Some(unfinished.saturating_sub(bytes));
        // Never refused.
        let _ = self.unfinished_bytes.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
    }

    fn count(&self, bytes: usize) {
        self.unfinished_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    fn is_large(&self) -> bool {
        self.unfinished_bytes.load(Ordering::Relaxed) > LARGE_BYTES
    }

    fn place(&self) -> MutexGuard<'_, Option<OwnedSemaphorePermit>> {
        // Nothing panics while it holds the lock.
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How long a client may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waits {
    /// For the rest of a large message, once it has a place.
    pub(super) large: Duration,
    /// To take a byte of what it is sent.
    pub(super) write: Duration,
}

/// The socket.
pub(super) struct Line {
    socket: TcpStream,
    /// Shared with whoever deals with what comes.
    pub(super) meter: Arc<Meter>,
    waits: Waits,
    /// Places for large messages of all clients.
    places: Arc<Semaphore>,
    waiting: Option<PlaceComes>,
    /// When the large message that has a place must be there.
    late: Option<Pin<Box<Sleep>>>,
    /// When the client must have taken something; `None`: it does.
    stalled: Option<Pin<Box<Sleep>>>,
}

type PlaceComes = Pin<Box<dyn Future<Output = Result<OwnedSemaphorePermit, AcquireError>> + Send>>;

impl Line {
    pub(super) fn new(socket: TcpStream, seat: Seat, places: Arc<Semaphore>, waits: Waits) -> Self {
        let meter = Arc::new(Meter::new(seat));
        Self { socket, meter, waits, places, waiting: None, late: None, stalled: None }
    }

    /// Ready when a large message may come on.
    fn poll_place(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        if self.meter.place().is_none() {
            let waiting = self
                .waiting
                .get_or_insert_with(|| Box::pin(Arc::clone(&self.places).acquire_owned()));
            let place = ready!(waiting.as_mut().poll(cx)).map_err(io::Error::other)?;
            self.waiting = None;
            *self.meter.place() = Some(place);
            self.late = Some(Box::pin(tokio::time::sleep(self.waits.large)));
        }
        match self.late.as_mut().map(|late| late.as_mut().poll(cx)) {
            Some(Poll::Ready(())) => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            _ => Poll::Ready(Ok(())),
        }
    }

    /// The outcome of an attempt to write; an error once the client has taken nothing for too long.
    fn judge<T>(
        &mut self,
        cx: &mut Context<'_>,
        written: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if written.is_ready() {
            self.stalled = None;
            return written;
        }
        let wait = self.waits.write;
        let stalled = self.stalled.get_or_insert_with(|| Box::pin(tokio::time::sleep(wait)));
        ready!(stalled.as_mut().poll(cx));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for Line {
    fn poll_read(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let line = self.get_mut();
        if line.meter.is_large() {
            ready!(line.poll_place(cx))?;
        }
        let before = buffer.filled().len();
        ready!(Pin::new(&mut line.socket).poll_read(cx, buffer))?;
        line.meter.count(buffer.filled().len() - before);
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for Line {
    fn poll_write(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let line = self.get_mut();
        let written = Pin::new(&mut line.socket).poll_write(cx, bytes);
        line.judge(cx, written)
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        parts: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let line = self.get_mut();
        let written = Pin::new(&mut line.socket).poll_write_vectored(cx, parts);
        line.judge(cx, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.socket.is_write_vectored()
    }

    fn poll_flush(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().socket).poll_flush(cx)
    }

    fn poll_shutdown(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().socket).poll_shutdown(cx)
    }
}
