//! The shortcut: questions between two processes of one machine, past the bus.
//!
//! On the bus an answer of 0.9 MB goes through whoever routes, in parts of 48 KiB, each of which
//! wakes somebody, and a small one through threads of the transport on both sides. Who serves a
//! shortcut listens on a Unix socket beside the bus; its name, which no file system knows, is told
//! on the bus. Where it leads nowhere, as on another machine, the asker stays with the bus.
//!
//! A connection begins with a byte of welcome and carries one question at a time. A message, the
//! question or the answer, is a byte that says whether it is a refusal, its length and its bytes.

mod serving;

use std::ffi::OsStr;
use std::io::{self, IoSlice, IoSliceMut};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::SocketAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use bytes::BufMut;
use rustix::process::geteuid;
use schemas::{Error, ErrorCode, keys, limits};
use tokio::net::UnixStream;

use crate::Bus;
use crate::query::{ask, refusal_of, timed_out};

pub(crate) use serving::{Listening, Responder};

/// Says that there is room.
const WELCOME: u8 = 1;
/// Connections that an asker keeps open between two questions.
const IDLE_MAX: usize = 4;
/// How long the service may take to say where its shortcut is, and that there is room.
const NAME_DEADLINE: Duration = Duration::from_millis(500);
/// How often it is asked.
const NAME_ATTEMPTS: u32 = 6;
/// Between two looks at whether somebody still listens.
const CLOSING_PAUSE: Duration = Duration::from_millis(50);
/// Between two attempts to connect where too many wait already.
const DIAL_PAUSE: Duration = Duration::from_millis(5);
/// Bytes before those of a message: whether it is a refusal, and how many follow.
const HEAD_BYTES: usize = 5;
/// Room for what comes together with a head: nearly every message whole.
const FIRST_BYTES: usize = 8 * 1024;

/// A way to one service past the bus.
#[derive(Debug)]
pub(crate) struct Shortcut {
    /// What the service serves on the bus.
    key: String,
    address: SocketAddr,
    idle: Mutex<Vec<UnixStream>>,
}

/// A service did not say in time where its shortcut is, or that there is room.
struct TooSlow;

/// A connection for one question.
pub(crate) struct ShortcutConnection<'a> {
    shortcut: &'a Shortcut,
    stream: UnixStream,
}

impl Bus {
    /// The shortcut to what a service serves under `key`; `None` when it has none that leads there.
    pub(crate) async fn shortcut(&self, key: &str) -> Option<Shortcut> {
        // A service that is busy, e.g. with its start, answers late.
        for _ in 0..NAME_ATTEMPTS {
            match self.try_shortcut(key).await {
                Ok(shortcut) => return shortcut,
                Err(TooSlow) => tracing::debug!(key, "asked again where a shortcut is"),
            }
        }
        tracing::warn!(key, "no answer where a shortcut is: it is asked on the bus alone");
        None
    }

    async fn try_shortcut(&self, key: &str) -> Result<Option<Shortcut>, TooSlow> {
        let (name_key, bytes_max) = (keys::shortcut_to(key), limits::REQUEST_BYTES_MAX);
        let asked = ask(&self.session, &name_key, Vec::new(), bytes_max, NAME_DEADLINE).await;
        let name = match asked {
            Ok(name) => name,
            Err(error) if error.code == ErrorCode::TimedOut => return Err(TooSlow),
            Err(_) => return Ok(None),
        };
        let Ok(address) = SocketAddr::from_abstract_name(name) else { return Ok(None) };
        let shortcut = Shortcut { key: key.to_owned(), address, idle: Mutex::default() };
        // Not kept: a connection is at its best in the threads that first use it.
        match shortcut.connect().await {
            Ok(_) => Ok(Some(shortcut)),
            Err(error) if error.kind() == io::ErrorKind::TimedOut => Err(TooSlow),
            Err(_) => Ok(None),
        }
    }
}

impl Shortcut {
    /// Connects for a question.
    ///
    /// # Errors
    /// What the system says when the service is gone or has no room; it has not heard the question
    /// then.
    pub(crate) async fn connect(&self) -> io::Result<ShortcutConnection<'_>> {
        self.connect_within(NAME_DEADLINE).await
    }

    /// The same, of a service that may take so long to say that there is room.
    ///
    /// # Errors
    /// As for [`connect`](Self::connect).
    pub(crate) async fn connect_within(
        &self,
        patience: Duration,
    ) -> io::Result<ShortcutConnection<'_>> {
        let idle = self.lock().pop();
        let stream = match idle {
            Some(stream) => stream,
            None => self.open(patience).await?,
        };
        Ok(ShortcutConnection { shortcut: self, stream })
    }

    /// Returns once nobody listens at the other end: the process has ended, or serves no longer.
    ///
    /// One that stands still is not gone: its system accepts, and closes when it ends.
    pub(crate) async fn until_closed(&self) {
        loop {
            match self.dial().await {
                // A welcome, and then nothing; or the end at once where there is no room.
                Ok(stream) => {
                    if read_exactly(&stream, Vec::new(), 2).await.is_ok() {
                        tracing::warn!(key = self.key, "a shortcut says what it was not asked");
                    }
                }
                // So many wait to be accepted that no more may: somebody listens.
                Err(full) if full.kind() == io::ErrorKind::WouldBlock => {}
                Err(_) => return,
            }
            tokio::time::sleep(CLOSING_PAUSE).await;
        }
    }

    async fn open(&self, patience: Duration) -> io::Result<UnixStream> {
        let welcomed = async {
            let stream = loop {
                match self.dial().await {
                    Err(full) if full.kind() == io::ErrorKind::WouldBlock => {
                        tokio::time::sleep(DIAL_PAUSE).await;
                    }
                    dialled => break dialled?,
                }
            };
            if !is_of_our_user(&stream) {
                return Err(io::ErrorKind::PermissionDenied.into());
            }
            read_exactly(&stream, Vec::new(), 1).await?;
            Ok(stream)
        };
        tokio::time::timeout(patience, welcomed).await?
    }

    /// Connects without waiting for room: where too many wait to be accepted the error is
    /// [`io::ErrorKind::WouldBlock`].
    async fn dial(&self) -> io::Result<UnixStream> {
        let name = self.address.as_abstract_name().unwrap_or_default();
        UnixStream::connect(OsStr::from_bytes(&[b"\0", name].concat())).await
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<UnixStream>> {
        // Nothing panics while it holds the lock.
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ShortcutConnection<'_> {
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

/// Whether the process at the other end runs as we do: a name that is told on the bus may be
/// anybody's, and everybody of the machine can connect to ours.
fn is_of_our_user(stream: &UnixStream) -> bool {
    match stream.peer_cred() {
        Ok(peer) if peer.uid() == geteuid().as_raw() => true,
        Ok(peer) => {
            tracing::warn!(uid = peer.uid(), "a shortcut to or from another user is refused");
            false
        }
        Err(_) => false,
    }
}

async fn exchange(stream: &UnixStream, question: &[u8]) -> io::Result<(bool, Vec<u8>)> {
    write(stream, &head_of(false, question)?, question).await?;
    let mut arriving = Arriving::default();
    loop {
        stream.readable().await?;
        match stream.try_read_vectored(&mut arriving.room()) {
            Ok(count) if arriving.is_open(count)? => break,
            Ok(_) => {}
            Err(empty) if empty.kind() == io::ErrorKind::WouldBlock => {}
            Err(cause) => return Err(cause),
        }
    }
    let (is_refusal, bytes, length) = arriving.opened(limits::MAP_BYTES_MAX)?;
    Ok((is_refusal, read_exactly(stream, bytes, length).await?))
}

async fn write(stream: &UnixStream, head: &[u8], bytes: &[u8]) -> io::Result<()> {
    let mut written = 0;
    while written < head.len() + bytes.len() {
        stream.writable().await?;
        match stream.try_write_vectored(&rest_of(head, bytes, written)) {
            Ok(count) => written += count,
            Err(full) if full.kind() == io::ErrorKind::WouldBlock => {}
            Err(cause) => return Err(cause),
        }
    }
    Ok(())
}

/// Reads on until there are so many bytes.
async fn read_exactly(
    stream: &UnixStream,
    mut bytes: Vec<u8>,
    length: usize,
) -> io::Result<Vec<u8>> {
    bytes.reserve_exact(length - bytes.len());
    while bytes.len() < length {
        stream.readable().await?;
        let missing = length - bytes.len();
        match stream.try_read_buf(&mut (&mut bytes).limit(missing)) {
            Ok(0) => return Err(too_short()),
            Ok(_) => {}
            Err(empty) if empty.kind() == io::ErrorKind::WouldBlock => {}
            Err(cause) => return Err(cause),
        }
    }
    Ok(bytes)
}

/// A message whose head has not come yet.
struct Arriving {
    head: [u8; HEAD_BYTES],
    bytes: Vec<u8>,
    count: usize,
}

impl Default for Arriving {
    fn default() -> Self {
        Self { head: [0; HEAD_BYTES], bytes: vec![0; FIRST_BYTES], count: 0 }
    }
}

impl Arriving {
    /// Where to read to.
    fn room(&mut self) -> [IoSliceMut<'_>; 2] {
        let head = self.head.get_mut(self.count..).unwrap_or_default();
        [IoSliceMut::new(head), IoSliceMut::new(&mut self.bytes)]
    }

    /// Whether the head is complete after so many bytes more.
    fn is_open(&mut self, count: usize) -> io::Result<bool> {
        self.count += count;
        if count == 0 { Err(too_short()) } else { Ok(self.count >= HEAD_BYTES) }
    }

    /// Whether it is a refusal, what has come of its bytes, and how many it has.
    fn opened(mut self, bytes_max: usize) -> io::Result<(bool, Vec<u8>, usize)> {
        let [is_refusal, length @ ..] = self.head;
        let length = u32::from_le_bytes(length) as usize;
        self.bytes.truncate(self.count - HEAD_BYTES);
        if length > bytes_max {
            Err(io::Error::other(format!("{length} bytes, of at most {bytes_max}")))
        } else if self.bytes.len() > length {
            Err(io::Error::other("more than one message"))
        } else {
            Ok((is_refusal != 0, self.bytes, length))
        }
    }
}

fn head_of(is_refusal: bool, bytes: &[u8]) -> io::Result<[u8; HEAD_BYTES]> {
    let [a, b, c, d] = u32::try_from(bytes.len()).map_err(io::Error::other)?.to_le_bytes();
    Ok([u8::from(is_refusal), a, b, c, d])
}

/// What follows the first `written` bytes of a head and its bytes.
fn rest_of<'a>(head: &'a [u8], bytes: &'a [u8], written: usize) -> [IoSlice<'a>; 2] {
    let head_left = head.get(written..).unwrap_or_default();
    let bytes_left = bytes.get(written.saturating_sub(head.len())..).unwrap_or_default();
    [IoSlice::new(head_left), IoSlice::new(bytes_left)]
}

fn too_short() -> io::Error {
    io::ErrorKind::UnexpectedEof.into()
}

#[cfg(test)]
mod tests;
