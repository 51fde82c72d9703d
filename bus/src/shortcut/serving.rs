//! The serving side of a shortcut: every connection has a thread of its own, which may do what is
//! asked itself; somebody who waits for work need not be woken then.

use std::io::{self, Read, Write};
use std::net::Shutdown;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener as StdListener, UnixStream};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use rustix::net::{SendAncillaryBuffer, SendFlags, sendmsg};
use schemas::limits;
use tokio::net::UnixListener;
use tokio::task::AbortHandle;

use super::{Arriving, WELCOME, head_of, is_of_our_user, rest_of, too_short};
use crate::{Bus, BusError, Incoming};

/// Connections that a service accepts; who comes beyond that is told at once, and asks on the bus.
pub(super) const CONNECTIONS_MAX: usize = 256;
/// Answers of one connection that are written on as their asker reads: one that is just done, and
/// the next. Who asks on without reading is cut off.
const UNSENT_MAX: usize = 2;
/// Before the next connection is accepted where the system had no room for one.
const ACCEPT_PAUSE: Duration = Duration::from_secs(1);

/// Shortcuts this process has served.
static SERVED: AtomicU64 = AtomicU64::new(0);

/// Takes connections until it is dropped, and answers no more then.
pub(crate) struct Listening {
    task: AbortHandle,
    connections: Arc<Connections>,
}

impl Drop for Listening {
    fn drop(&mut self) {
        self.task.abort();
        self.connections.close();
    }
}

impl Bus {
    /// Listens for those who come by a shortcut; gives its name.
    pub(crate) fn listen_for_shortcuts(
        &self,
        key: &str,
        handler: impl Fn(Incoming) + Send + Sync + 'static,
    ) -> Result<(String, Listening), BusError> {
        // No other session has this number, on this machine or another.
        let number = SERVED.fetch_add(1, Ordering::Relaxed);
        let name = format!("causeway-{}-{number}", self.session.zid());
        let listener =
            listen(&name).map_err(|cause| BusError::Shortcut { key: key.to_owned(), cause })?;
        let connections = Arc::new(Connections::default());
        let handler: Arc<Handler> = Arc::new(handler);
        let task =
            tokio::spawn(accept_all(listener, Arc::clone(&connections), key.to_owned(), handler));
        Ok((name, Listening { task: task.abort_handle(), connections }))
    }
}

type Handler = dyn Fn(Incoming) + Send + Sync;

fn listen(name: &str) -> io::Result<UnixListener> {
    let listener = StdListener::bind_addr(&SocketAddr::from_abstract_name(name)?)?;
    listener.set_nonblocking(true)?;
    UnixListener::from_std(listener)
}

/// Takes connections for ever.
async fn accept_all(
    listener: UnixListener,
    connections: Arc<Connections>,
    key: String,
    handler: Arc<Handler>,
) {
    loop {
        let accepted = match listener.accept().await {
            Ok((stream, _)) if is_of_our_user(&stream) => stream.into_std(),
            Ok(_) => continue,
            Err(cause) => Err(cause),
        };
        let begun = accepted.and_then(|stream| serve(stream, &connections, &key, &handler));
        if let Err(cause) = begun {
            tracing::warn!(key, %cause, "a shortcut cannot be opened");
            tokio::time::sleep(ACCEPT_PAUSE).await;
        }
    }
}

/// Gives a connection its thread, if there is room for it.
fn serve(
    stream: UnixStream,
    connections: &Connections,
    key: &str,
    handler: &Arc<Handler>,
) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    let Some(connection) = connections.admit(stream) else { return Ok(()) };
    let (key, handler) = (key.to_owned(), Arc::clone(handler));
    let serving = move || {
        let _closing = CloseOnDrop(&connection);
        if let Err(cause) = connection.serve(&key, &*handler) {
            tracing::trace!(key, %cause, "an asker has left the shortcut");
        }
    };
    std::thread::Builder::new().name("shortcut".to_owned()).spawn(serving).map(drop)
}

/// The connections there are.
#[derive(Default)]
struct Connections(Mutex<Open>);

#[derive(Default)]
struct Open {
    connections: Vec<Weak<Connection>>,
    is_over: bool,
}

impl Connections {
    /// `None` when there is no room for another.
    fn admit(&self, stream: UnixStream) -> Option<Arc<Connection>> {
        let mut open = self.lock();
        open.connections.retain(|connection| connection.strong_count() > 0);
        if open.is_over || open.connections.len() >= CONNECTIONS_MAX {
            return None;
        }
        let connection = Arc::new(Connection {
            stream,
            is_asked: AtomicBool::default(),
            is_left: AtomicBool::default(),
            unsent: AtomicUsize::default(),
        });
        open.connections.push(Arc::downgrade(&connection));
        Some(connection)
    }

    /// Ends all, and admits no more.
    fn close(&self) {
        let mut open = self.lock();
        open.is_over = true;
        open.connections.iter().filter_map(Weak::upgrade).for_each(|connection| connection.close());
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Open> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A connection of an asker.
struct Connection {
    stream: UnixStream,
    /// Whether a question waits for its answer; a second one would break the order.
    is_asked: AtomicBool,
    /// Whether the asker has gone, or was cut off.
    is_left: AtomicBool,
    /// Answers that wait to be read.
    unsent: AtomicUsize,
}

/// Closes the connection also while somebody is about to answer, and after a panic.
struct CloseOnDrop<'a>(&'a Connection);

impl Drop for CloseOnDrop<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl Connection {
    /// Has one question after the other answered.
    fn serve(self: &Arc<Self>, key: &str, handler: &Handler) -> io::Result<()> {
        (&self.stream).write_all(&[WELCOME])?;
        loop {
            let question = self.read_question()?;
            if self.is_asked.swap(true, Ordering::AcqRel) {
                return Err(io::Error::other("a question before the answer to the last one"));
            }
            handler(Incoming::by_shortcut(key.to_owned(), question, Responder(Arc::clone(self))));
        }
    }

    fn read_question(&self) -> io::Result<Vec<u8>> {
        let mut arriving = Arriving::default();
        loop {
            let count = (&self.stream).read_vectored(&mut arriving.room())?;
            if arriving.is_open(count)? {
                break;
            }
        }
        let (_, mut question, length) = arriving.opened(limits::REPLY_BYTES_MAX)?;
        let missing = length - question.len();
        question.reserve_exact(missing);
        (&self.stream).take(missing as u64).read_to_end(&mut question)?;
        if question.len() == length { Ok(question) } else { Err(too_short()) }
    }

    /// How much of an answer there was room for.
    fn try_write(&self, head: &[u8], bytes: &[u8]) -> io::Result<usize> {
        let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
        let parts = rest_of(head, bytes, 0);
        match sendmsg(&self.stream, &parts, &mut SendAncillaryBuffer::default(), flags) {
            Err(rustix::io::Errno::AGAIN) => Ok(0),
            written => Ok(written?),
        }
    }

    fn close(&self) {
        self.is_left.store(true, Ordering::Release);
        if let Err(cause) = self.stream.shutdown(Shutdown::Both) {
            tracing::trace!(%cause, "the asker had left the shortcut");
        }
    }
}

/// Where the answer to a question goes.
pub(crate) struct Responder(Arc<Connection>);

impl Responder {
    /// Whether the asker has gone.
    pub(crate) fn is_left(&self) -> bool {
        self.0.is_left.load(Ordering::Acquire)
    }

    /// Whoever answers writes to the socket himself, as far as there is room, and never waits.
    pub(crate) fn answer(self, is_refusal: bool, bytes: Vec<u8>) {
        let Self(connection) = self;
        // Before the asker can ask again.
        connection.is_asked.store(false, Ordering::Release);
        let head = head_of(is_refusal, &bytes);
        let sent = head.and_then(|head| Ok((head, connection.try_write(&head, &bytes)?)));
        let sent = sent.and_then(|(head, written)| match written {
            all if all == head.len() + bytes.len() => Ok(()),
            written => finish(&connection, head.to_vec(), bytes, written),
        });
        // Whoever reads questions there hears of it by himself.
        if let Err(cause) = sent {
            tracing::trace!(%cause, "the asker has left the shortcut");
            connection.close();
        }
    }
}

/// Writes the rest of a large answer as the asker reads it.
fn finish(
    connection: &Arc<Connection>,
    head: Vec<u8>,
    bytes: Vec<u8>,
    written: usize,
) -> io::Result<()> {
    if connection.unsent.fetch_add(1, Ordering::AcqRel) >= UNSENT_MAX {
        return Err(io::Error::other("questions of an asker that does not read"));
    }
    let connection = Arc::clone(connection);
    let finishing = move || {
        let rest = rest_of(&head, &bytes, written);
        let sent = rest.iter().try_for_each(|part| (&connection.stream).write_all(part));
        if let Err(cause) = sent {
            tracing::trace!(%cause, "the asker has left the shortcut");
        }
        connection.unsent.fetch_sub(1, Ordering::AcqRel);
    };
    std::thread::Builder::new().name("answer".to_owned()).spawn(finishing).map(drop)
}
