//! Connections of one port: how many there are at once, and who gives way when all seats are taken.
//!
//! Whoever only connects costs a handle and a seat and can do so without number. A newcomer who
//! finds no seat therefore gets that of a connection that is silent: of the address that has most
//! of them, the one that has been silent longest. Where nobody is silent it waits. Connections that
//! rest may be fewer than the seats: beyond that one of them is asked to go though seats are free.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rustix::net::sockopt;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use tokio::time::Instant;

/// Before the next connection where the system had no room for one.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// Who has just connected may be this far away, and is not silent before.
const GRACE: Duration = Duration::from_millis(250);
/// A peer that says nothing for so long is asked whether it is still there,
const KEEPALIVE_IDLE: Duration = Duration::from_secs(60);
/// so often, at this interval.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(10);
const KEEPALIVE_COUNT: u32 = 3;

/// The seats of one port.
#[derive(Clone, Debug)]
pub struct Seats {
    room: Arc<Room>,
}

#[derive(Debug)]
struct Room {
    count: usize,
    /// How many may rest.
    resting_max: usize,
    /// [`GRACE`], or what a test has instead.
    grace: Duration,
    taken: Mutex<Taken>,
    freed: Notify,
}

#[derive(Debug, Default)]
struct Taken {
    by: BTreeMap<u64, Sitter>,
    next: u64,
}

#[derive(Debug)]
struct Sitter {
    from: IpAddr,
    /// `None`: it is being served, or was asked to give way.
    silent_since: Option<Instant>,
    /// Whether it was served before it became silent.
    rests: bool,
    asked: Reason,
    wanted: Arc<Notify>,
}

/// Why a connection is asked to end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reason {
    /// Somebody else waits for a seat, or the system has no room for a connection.
    #[default]
    Newcomer,
    /// More rest than may; nobody waits for this seat.
    TooManyRest,
}

/// Taken by one connection for as long as this lives. The connection is silent at first.
#[derive(Debug)]
pub struct Seat {
    room: Arc<Room>,
    number: u64,
    wanted: Arc<Notify>,
}

impl Seats {
    /// So many, all free.
    pub fn new(count: usize) -> Self {
        Self::with_resting(count, count)
    }

    /// So many, all free, of whose connections so many may rest.
    pub fn with_resting(count: usize, resting_max: usize) -> Self {
        Self::with_grace(count, resting_max, GRACE)
    }

    fn with_grace(count: usize, resting_max: usize, grace: Duration) -> Self {
        let (taken, freed) = (Mutex::default(), Notify::new());
        Self { room: Arc::new(Room { count, resting_max, grace, taken, freed }) }
    }

    /// The next connection, which sends without delay and is found out when its peer is gone
    /// without a word. Where the system has no room for one, somebody silent gives way, and the
    /// next is tried after a pause. May be dropped without losing a connection.
    pub async fn accept(&self, listener: &TcpListener) -> (TcpStream, SocketAddr) {
        let mut is_told = false;
        loop {
            match listener.accept().await {
                Ok((stream, peer)) => {
                    if let Err(cause) = prepare(&stream) {
                        tracing::debug!(%peer, %cause, "a connection stays as the system makes it");
                    }
                    return (stream, peer);
                }
                Err(cause) => {
                    if !is_told {
                        tracing::warn!(%cause, "somebody could not connect");
                        is_told = true;
                    }
                    self.room.ask_one_to_go(Instant::now());
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    }

    /// A seat for who has connected from an address, as soon as there is one.
    pub async fn take(&self, from: IpAddr) -> Seat {
        loop {
            let freed = self.room.freed.notified();
            let now = Instant::now();
            if let Some(seat) = self.try_take(from, now) {
                return seat;
            }
            if !self.room.ask_one_to_go(now) {
                // Whether anybody is silent by then.
                let _ = tokio::time::timeout(self.room.grace, freed).await;
                continue;
            }
            freed.await;
        }
    }

    /// How many are taken.
    pub fn taken(&self) -> usize {
        self.room.lock().by.len()
    }

    fn try_take(&self, from: IpAddr, now: Instant) -> Option<Seat> {
        let mut taken = self.room.lock();
        if taken.by.len() >= self.room.count {
            return None;
        }
        let (number, wanted) = (taken.next, Arc::new(Notify::new()));
        taken.next += 1;
        let (asked, silent_since) = (Reason::default(), Some(now));
        let sitter = Sitter { from, silent_since, rests: false, asked, wanted: wanted.clone() };
        taken.by.insert(number, sitter);
        drop(taken);
        Some(Seat { room: Arc::clone(&self.room), number, wanted })
    }
}

impl Room {
    fn lock(&self) -> MutexGuard<'_, Taken> {
        // Nothing panics while it holds the lock.
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes a connection that is silent, so that it ends; gives whether there is one.
    fn ask_one_to_go(&self, now: Instant) -> bool {
        let is_long = |since: Instant| since + self.grace <= now;
        self.lock().ask_one(Reason::Newcomer, |sitter| sitter.silent_since.is_some_and(is_long))
    }
}

impl Taken {
    /// Wakes one of those: of the address with most silent connections, the one that has been
    /// silent longest. Gives whether there is one.
    fn ask_one(&mut self, reason: Reason, of: impl Fn(&Sitter) -> bool) -> bool {
        let mut silent_of: BTreeMap<IpAddr, usize> = BTreeMap::new();
        for sitter in self.by.values().filter(|sitter| sitter.silent_since.is_some()) {
            *silent_of.entry(sitter.from).or_default() += 1;
        }
        let order = |sitter: &&mut Sitter| {
            let count = silent_of.get(&sitter.from).copied().unwrap_or_default();
            (std::cmp::Reverse(count), sitter.silent_since)
        };
        let Some(sitter) = self.by.values_mut().filter(|sitter| of(sitter)).min_by_key(order)
        else {
            return false;
        };
        sitter.silent_since = None;
        sitter.asked = reason;
        sitter.wanted.notify_one();
        true
    }
}

impl Seat {
    /// The client has said what it wants: the seat is its own until it is silent again.
    pub fn begin(&self) {
        self.set_silent_since(None);
    }

    /// Nothing is left to do for the client: from now on it is silent. Where more rest than may,
    /// one of the address with most of them, which has rested longest, is asked to go.
    pub fn rest(&self) {
        self.set_silent_since(Some(Instant::now()));
        let is_resting = |sitter: &Sitter| sitter.rests && sitter.silent_since.is_some();
        let mut taken = self.room.lock();
        if taken.by.values().filter(|sitter| is_resting(sitter)).count() > self.room.resting_max {
            taken.ask_one(Reason::TooManyRest, is_resting);
        }
    }

    /// Returns when the connection is to end, and says why.
    pub async fn wanted(&self) -> Reason {
        self.wanted.notified().await;
        self.room.lock().by.get(&self.number).map(|sitter| sitter.asked).unwrap_or_default()
    }

    fn set_silent_since(&self, silent_since: Option<Instant>) {
        if let Some(sitter) = self.room.lock().by.get_mut(&self.number) {
            sitter.silent_since = silent_since;
            sitter.rests = silent_since.is_some();
        }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.room.lock().by.remove(&self.number);
        self.room.freed.notify_one();
    }
}

fn prepare(stream: &TcpStream) -> io::Result<()> {
    // Small answers must not wait for the acknowledgement of earlier ones.
    stream.set_nodelay(true)?;
    sockopt::set_tcp_keepidle(stream, KEEPALIVE_IDLE)?;
    sockopt::set_tcp_keepintvl(stream, KEEPALIVE_INTERVAL)?;
    sockopt::set_tcp_keepcnt(stream, KEEPALIVE_COUNT)?;
    sockopt::set_socket_keepalive(stream, true)?;
    Ok(())
}

#[cfg(test)]
mod tests;
