//! The shortcut: questions between two processes of one machine, past the bus.
//!
//! On the bus an answer of 0.9 MB goes through whoever routes, in parts of 48 KiB, each of which
//! wakes somebody, and a small one through threads of the transport on both sides. Who serves a
//! shortcut listens on a Unix socket beside the bus; its name, which no file system knows, is told
//! on the bus. Where it leads nowhere, as on another machine, the asker stays with the bus.
//!
//! A connection begins with a byte of welcome and carries one question at a time: its length and
//! its bytes, then whether the answer is a refusal, its length and its bytes.

use std::io::{self, IoSlice};
use std::net::Shutdown;
use std::os::fd::AsFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener as StdListener, UnixStream as StdStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use schemas::{Error, keys, limits};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::{Semaphore, mpsc};
use tokio::task::{AbortHandle, JoinSet};

use crate::query::{ask, refusal_of, timed_out};
use crate::{Bus, BusError, Incoming};

/// Connections that a service accepts; who comes beyond that is told at once, and asks on the bus.
const CONNECTIONS_MAX: usize = 256;
/// Says that there is room.
const WELCOME: u8 = 1;
/// Connections that an asker keeps open between two questions.
const IDLE_MAX: usize = 4;
/// How long the service may take to say where its shortcut is, and that there is room.
const NAME_DEADLINE: Duration = Duration::from_millis(500);

/// Shortcuts this process has served.
static SERVED: AtomicU64 = AtomicU64::new(0);

/// A way to one service past the bus.
#[derive(Debug)]
pub(crate) struct Shortcut {
    /// What the service serves on the bus.
    key: String,
    address: SocketAddr,
    idle: Mutex<Vec<UnixStream>>,
}

/// A connection for one question.
pub(crate) struct Passage<'a> {
    shortcut: &'a Shortcut,
    stream: UnixStream,
}

/// Takes connections until it is dropped, and answers no more then.
pub(crate) struct Taking(AbortHandle);

impl Drop for Taking {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl Bus {
    /// The shortcut to what a service serves under `key`; `None` when it has none that leads there.
    pub(crate) async fn shortcut(&self, key: &str) -> Option<Shortcut> {
        let (name_key, bytes_max) = (keys::shortcut_to(key), limits::REQUEST_BYTES_MAX);
        let name =
            ask(&self.session, &name_key, Vec::new(), bytes_max, NAME_DEADLINE).await.ok()?;
        let address = SocketAddr::from_abstract_name(name).ok()?;
        let shortcut = Shortcut { key: key.to_owned(), address, idle: Mutex::default() };
        // Not kept: a connection is at its best in the threads that first use it.
        shortcut.enter().await.ok()?;
        Some(shortcut)
    }

    /// Listens for those who come by a shortcut; gives its name.
    pub(crate) fn take_shortcuts(
        &self,
        key: &str,
        handler: impl Fn(Incoming) + Send + Sync + 'static,
    ) -> Result<(String, Taking), BusError> {
        // No other session has this number, on this machine or another.
        let number = SERVED.fetch_add(1, Ordering::Relaxed);
        let name = format!("causeway-{}-{number}", self.session.zid());
        let listener =
            listen(&name).map_err(|cause| BusError::Shortcut { key: key.to_owned(), cause })?;
        let task = tokio::spawn(take(listener, key.to_owned(), Arc::new(handler)));
        Ok((name, Taking(task.abort_handle())))
    }
}

fn listen(name: &str) -> io::Result<UnixListener> {
    let listener = StdListener::bind_addr(&SocketAddr::from_abstract_name(name)?)?;
    listener.set_nonblocking(true)?;
    UnixListener::from_std(listener)
}

impl Shortcut {
    /// Opens the way for a question.
    ///
    /// # Errors
    /// What the system says when the service is gone or has no room; it has not heard the question
    /// then.
    pub(crate) async fn enter(&self) -> io::Result<Passage<'_>> {
        let idle = self.lock().pop();
        let stream = match idle {
            Some(stream) => stream,
            None => self.connect().await?,
        };
        Ok(Passage { shortcut: self, stream })
    }

    async fn connect(&self) -> io::Result<UnixStream> {
        let stream = StdStream::connect_addr(&self.address)?;
        stream.set_nonblocking(true)?;
        let stream = UnixStream::from_std(stream)?;
        tokio::time::timeout(NAME_DEADLINE, read_exactly(&stream, 1)).await??;
        Ok(stream)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<UnixStream>> {
        // Nothing panics while it holds the lock.
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Passage<'_> {
    /// Asks, and waits for the answer or the service's refusal, or the word that it took too long.
    ///
    /// # Errors
    /// What the system says when the service is gone; it may have heard the question.
    pub(crate) async fn ask(
        self,
        question: &[u8],
        deadline: Duration,
    ) -> io::Result<Result<Vec<u8>, Error>> {
        let key = &self.shortcut.key;
        let answer = tokio::time::timeout(deadline, exchange(&self.stream, question)).await;
        let Ok(answer) = answer else { return Ok(Err(timed_out(key, deadline))) };
        let (is_refusal, bytes) = answer?;
        let mut idle = self.shortcut.lock();
        if idle.len() < IDLE_MAX {
            idle.push(self.stream);
        }
        drop(idle);
        Ok(if is_refusal { Err(refusal_of(key, &bytes)) } else { Ok(bytes) })
    }
}

async fn exchange(stream: &UnixStream, question: &[u8]) -> io::Result<(bool, Vec<u8>)> {
    let head = length(question)?.to_le_bytes();
    write_from(stream, &head, question, 0).await?;
    let head = read_exactly(stream, 5).await?;
    let [is_refusal, length @ ..] = head.as_slice() else { return Err(too_short()) };
    Ok((*is_refusal != 0, read_exactly(stream, length_in(length, limits::MAP_BYTES_MAX)?).await?))
}

/// Takes connections for ever; those it has end with it.
async fn take(
    listener: UnixListener,
    key: String,
    handler: Arc<impl Fn(Incoming) + Send + Sync + 'static>,
) {
    let seats = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    let mut connections = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            Some(_) = connections.join_next() => continue,
        };
        let Ok((stream, _)) = accepted else {
            tokio::task::yield_now().await;
            continue;
        };
        let Ok(seat) = Arc::clone(&seats).try_acquire_owned() else { continue };
        let (key, handler) = (key.clone(), Arc::clone(&handler));
        connections.spawn(async move {
            if let Err(cause) = attend(stream, &key, &*handler).await {
                tracing::trace!(key, %cause, "an asker has left the shortcut");
            }
            drop(seat);
        });
    }
}

/// A connection of an asker.
struct Line {
    stream: UnixStream,
    /// Whether a question waits for its answer; a second one would break the order.
    is_asked: AtomicBool,
    rests: mpsc::Sender<Rest>,
}

/// What of an answer did not find room in the socket at once.
struct Rest {
    head: [u8; 5],
    bytes: Vec<u8>,
    written: usize,
}

/// Closes the connection also while somebody is about to answer.
struct Hanging<'a>(&'a UnixStream);

impl Drop for Hanging<'_> {
    fn drop(&mut self) {
        let stream = self.0.as_fd().try_clone_to_owned().map(StdStream::from);
        if let Err(cause) = stream.and_then(|stream| stream.shutdown(Shutdown::Both)) {
            tracing::trace!(%cause, "the asker had left the shortcut");
        }
    }
}

/// Answers one question after the other.
async fn attend(stream: UnixStream, key: &str, handler: impl Fn(Incoming)) -> io::Result<()> {
    write_from(&stream, &[WELCOME], &[], 0).await?;
    let (rests, mut waiting) = mpsc::channel(1);
    let line = Arc::new(Line { stream, is_asked: AtomicBool::new(false), rests });
    let _hanging = Hanging(&line.stream);
    loop {
        let question = tokio::select! {
            // Nothing is lost: whoever still reads an answer asks nothing.
            Some(Rest { head, bytes, written }) = waiting.recv() => {
                write_from(&line.stream, &head, &bytes, written).await?;
                continue;
            }
            question = read_question(&line.stream) => question?,
        };
        if line.is_asked.swap(true, Ordering::AcqRel) {
            return Err(io::Error::other("a question before the answer to the last one"));
        }
        handler(Incoming::by_shortcut(key.to_owned(), question, Desk(Arc::clone(&line))));
    }
}

async fn read_question(stream: &UnixStream) -> io::Result<Vec<u8>> {
    let head = read_exactly(stream, 4).await?;
    read_exactly(stream, length_in(&head, limits::REPLY_BYTES_MAX)?).await
}

/// Where the answer to a question goes.
pub(crate) struct Desk(Arc<Line>);

impl Desk {
    /// Whoever answers writes to the socket himself, as far as there is room: short answers wake
    /// the asker and nobody else.
    pub(crate) fn answer(self, is_refusal: bool, bytes: Vec<u8>) {
        let Self(line) = self;
        // Fits: no answer has more than the limit of a map.
        let [a, b, c, d] = (bytes.len() as u32).to_le_bytes();
        let head = [u8::from(is_refusal), a, b, c, d];
        // Before the asker can ask again.
        line.is_asked.store(false, Ordering::Release);
        match try_write(&line.stream, &head, &bytes, 0) {
            Ok(written) if written < head.len() + bytes.len() => {
                // There is room: one answer at a time. Nobody is there when the service has ended.
                let _ = line.rests.try_send(Rest { head, bytes, written });
            }
            Ok(_) => {}
            // The connection ends by itself then.
            Err(cause) => tracing::trace!(%cause, "the asker has left the shortcut"),
        }
    }
}

/// Writes what follows the first `written` bytes of two slices.
async fn write_from(
    stream: &UnixStream,
    head: &[u8],
    bytes: &[u8],
    mut written: usize,
) -> io::Result<()> {
    while written < head.len() + bytes.len() {
        stream.writable().await?;
        written += try_write(stream, head, bytes, written)?;
    }
    Ok(())
}

/// How many more bytes there was room for.
fn try_write(stream: &UnixStream, head: &[u8], bytes: &[u8], written: usize) -> io::Result<usize> {
    let head_left = head.get(written..).unwrap_or_default();
    let bytes_left = bytes.get(written.saturating_sub(head.len())..).unwrap_or_default();
    match stream.try_write_vectored(&[IoSlice::new(head_left), IoSlice::new(bytes_left)]) {
        Err(full) if full.kind() == io::ErrorKind::WouldBlock => Ok(0),
        written => written,
    }
}

async fn read_exactly(stream: &UnixStream, length: usize) -> io::Result<Vec<u8>> {
    let mut message = Vec::with_capacity(length);
    while message.len() < length {
        stream.readable().await?;
        let missing = length - message.len();
        let mut room = bytes::BufMut::limit(&mut message, missing);
        match stream.try_read_buf(&mut room) {
            Ok(0) => return Err(too_short()),
            Ok(_) => {}
            Err(empty) if empty.kind() == io::ErrorKind::WouldBlock => {}
            Err(cause) => return Err(cause),
        }
    }
    Ok(message)
}

fn length(message: &[u8]) -> io::Result<u32> {
    u32::try_from(message.len()).map_err(io::Error::other)
}

fn length_in(head: &[u8], bytes_max: usize) -> io::Result<usize> {
    let length = u32::from_le_bytes(head.try_into().map_err(|_| too_short())?) as usize;
    if length <= bytes_max {
        Ok(length)
    } else {
        Err(io::Error::other(format!("{length} bytes, of at most {bytes_max}")))
    }
}

fn too_short() -> io::Error {
    io::ErrorKind::UnexpectedEof.into()
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use schemas::Reply;

    use super::*;
    use crate::{BusConfig, Endpoint};

    #[tokio::test(flavor = "multi_thread")]
    async fn who_finds_no_room_is_told_before_asking() {
        let bus = Bus::open(BusConfig::listening(Endpoint::loopback(0))).await.unwrap();
        let (name, _taking) = bus.take_shortcuts("key", |asked| asked.reply(&Reply::Done)).unwrap();
        let address = SocketAddr::from_abstract_name(name).unwrap();
        let shortcut = Shortcut { key: String::new(), address, idle: Mutex::default() };
        let mut inside = Vec::new();
        for _ in 0..CONNECTIONS_MAX {
            inside.push(shortcut.enter().await.unwrap());
        }
        assert!(shortcut.enter().await.is_err());
        drop(inside.pop());
        let begun = std::time::Instant::now();
        while shortcut.enter().await.is_err() {
            assert!(begun.elapsed() < Duration::from_secs(10), "the seat stays taken");
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn who_promises_too_much_is_cut_off_and_others_are_served() {
        let bus = Bus::open(BusConfig::listening(Endpoint::loopback(0))).await.unwrap();
        let (name, _taking) = bus.take_shortcuts("key", |asked| asked.reply(&Reply::Done)).unwrap();
        let address = SocketAddr::from_abstract_name(name).unwrap();
        let hostile = tokio::task::spawn_blocking({
            let address = address.clone();
            move || {
                let mut stream = StdStream::connect_addr(&address).unwrap();
                stream.read_exact(&mut [0]).unwrap();
                stream.write_all(&u32::MAX.to_le_bytes()).unwrap();
                stream.read(&mut [0; 8]).unwrap()
            }
        });
        assert_eq!(hostile.await.unwrap(), 0, "the connection stays open");
        let shortcut = Shortcut { key: String::new(), address, idle: Mutex::default() };
        let passage = shortcut.enter().await.unwrap();
        let asked = passage.ask(&[1, 2, 3], Duration::from_secs(10)).await;
        assert_eq!(asked.unwrap().unwrap(), schemas::wire::encode_reply(&Reply::Done));
        assert_eq!(shortcut.lock().len(), 1);
    }
}
