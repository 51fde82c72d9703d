//! Who listens to what. Slow listeners lose messages in asynchronous mode and hold the simulation
//! up in synchronous mode, as in CARLA; the memory they take is bounded either way.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::{mpsc, watch};
use tokio::time::Instant;

/// Messages that may wait for one listener.
const MESSAGES_MAX: usize = 8;
/// How long the simulation waits for a listener that takes nothing; then it is disconnected.
const LISTENER_WAIT: Duration = Duration::from_secs(30);
/// Losses between two lines in the log.
const LOSSES_PER_WARNING: u64 = 1_000;

/// One message, shared by all listeners.
pub(crate) type Message = Arc<Vec<u8>>;

/// All streams of an endpoint and their listeners.
pub(crate) struct Hub {
    streams: Mutex<Streams>,
    changes: watch::Sender<u64>,
}

#[derive(Default)]
struct Streams {
    open: BTreeMap<u32, Stream>,
    /// Listeners of streams that ended, who still have messages to read.
    leaving: BTreeSet<u64>,
    next_listener: u64,
    losses: u64,
}

#[derive(Default)]
struct Stream {
    listeners: BTreeMap<u64, mpsc::Sender<Message>>,
    /// How many ever came.
    comings: u64,
    /// Sent at once to who comes later; only where that makes sense.
    last: Option<Message>,
    keeps_last: bool,
}

/// A place in a stream.
pub(crate) struct Listener {
    pub(crate) id: u64,
    pub(crate) messages: mpsc::Receiver<Message>,
}

impl Hub {
    /// No streams.
    pub(crate) fn new() -> Self {
        Self { streams: Mutex::default(), changes: watch::Sender::new(0) }
    }

    /// Opens a stream; with `keeps_last`, who comes later gets the last message at once.
    pub(crate) fn open(&self, stream: u32, keeps_last: bool) {
        let opened = Stream { keeps_last, ..Stream::default() };
        self.lock().open.entry(stream).or_insert(opened);
    }

    /// Ends a stream; its listeners are disconnected when they have read what was sent.
    pub(crate) fn close(&self, stream: u32) {
        let mut streams = self.lock();
        let listeners = streams.open.remove(&stream).map(|stream| stream.listeners);
        streams.leaving.extend(listeners.into_iter().flatten().map(|(id, _)| id));
    }

    /// Waits until the listeners of all streams that ended have read everything and left.
    pub(crate) async fn wait_for_leaving(&self, until: Instant) {
        let mut changes = self.changes.subscribe();
        while !self.lock().leaving.is_empty() {
            if tokio::time::timeout_at(until, changes.changed()).await.is_err() {
                return;
            }
        }
    }

    /// How many listen.
    pub(crate) fn listener_count(&self, stream: u32) -> usize {
        self.lock().open.get(&stream).map_or(0, |stream| stream.listeners.len())
    }

    /// How many ever listened.
    pub(crate) fn comings(&self, stream: u32) -> u64 {
        self.lock().open.get(&stream).map_or(0, |stream| stream.comings)
    }

    /// Takes a place; `None` for a stream that does not exist.
    pub(crate) fn listen(&self, stream: u32) -> Option<Listener> {
        let mut streams = self.lock();
        let id = streams.next_listener;
        streams.next_listener += 1;
        let stream = streams.open.get_mut(&stream)?;
        let (sender, messages) = mpsc::channel(MESSAGES_MAX);
        if let Some(last) = &stream.last {
            // There is room: nothing was sent before.
            let _ = sender.try_send(Arc::clone(last));
        }
        stream.listeners.insert(id, sender);
        stream.comings += 1;
        drop(streams);
        self.changes.send_modify(|version| *version += 1);
        Some(Listener { id, messages })
    }

    /// Gives a place up, and tells how many are left.
    pub(crate) fn leave(&self, stream: u32, listener: u64) -> usize {
        let mut streams = self.lock();
        if streams.leaving.remove(&listener) {
            self.changes.send_modify(|version| *version += 1);
        }
        let Some(stream) = streams.open.get_mut(&stream) else { return 0 };
        stream.listeners.remove(&listener);
        stream.listeners.len()
    }

    /// Waits until so many have come, or a moment of patience has passed.
    pub(crate) async fn wait_for(&self, stream: u32, comings: u64, until: Instant) {
        let mut changes = self.changes.subscribe();
        while self.comings(stream) < comings {
            if tokio::time::timeout_at(until, changes.changed()).await.is_err() {
                return;
            }
        }
    }

    /// Keeps a message for who comes next, and sends it to nobody.
    pub(crate) fn keep(&self, stream: u32, message: Vec<u8>) {
        if let Some(stream) = self.lock().open.get_mut(&stream) {
            stream.last = Some(Arc::new(message));
        }
    }

    /// Sends the message that is kept for who comes next to those who are here, too.
    pub(crate) async fn publish_last(&self, stream: u32) {
        let last = self.lock().open.get(&stream).and_then(|stream| stream.last.clone());
        if let Some(last) = last {
            let behind = self.offer(stream, &last);
            self.note_losses(behind.len() as u64);
        }
    }

    /// Sends to all listeners: at once and with losses, or waiting for each.
    pub(crate) async fn publish(&self, stream: u32, message: Vec<u8>, waits: bool) {
        let message = Arc::new(message);
        let behind = self.offer(stream, &message);
        if !waits {
            return self.note_losses(behind.len() as u64);
        }
        for (id, listener) in behind {
            let sending = listener.send(Arc::clone(&message));
            if tokio::time::timeout(LISTENER_WAIT, sending).await.is_err() {
                tracing::warn!(stream, "a listener that takes nothing is disconnected");
                self.leave(stream, id);
            }
        }
    }

    /// Sends to those who have room, and gives the others.
    fn offer(&self, stream: u32, message: &Message) -> Vec<(u64, mpsc::Sender<Message>)> {
        let mut streams = self.lock();
        let Some(stream) = streams.open.get_mut(&stream) else { return Vec::new() };
        if stream.keeps_last {
            stream.last = Some(Arc::clone(message));
        }
        let mut behind = Vec::new();
        for (id, listener) in &stream.listeners {
            if let Err(mpsc::error::TrySendError::Full(_)) = listener.try_send(Arc::clone(message))
            {
                behind.push((*id, listener.clone()));
            }
        }
        behind
    }

    fn note_losses(&self, count: u64) {
        if count == 0 {
            return;
        }
        let mut streams = self.lock();
        let before = streams.losses;
        streams.losses += count;
        let losses = streams.losses;
        drop(streams);
        if before == 0 || before / LOSSES_PER_WARNING != losses / LOSSES_PER_WARNING {
            tracing::warn!(losses, "listeners are too slow; they lose messages");
        }
    }

    fn lock(&self) -> MutexGuard<'_, Streams> {
        // Nothing panics while it holds the lock.
        self.streams.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_slow_listener_loses_messages_and_keeps_the_order() {
        let hub = Hub::new();
        hub.open(7, false);
        let mut listener = hub.listen(7).unwrap();
        for number in 0..20 {
            hub.publish(7, vec![number], false).await;
        }
        let mut found = Vec::new();
        while let Ok(message) = listener.messages.try_recv() {
            found.push(message[0]);
        }
        assert_eq!(found, (0..MESSAGES_MAX as u8).collect::<Vec<_>>());
    }

    #[tokio::test]
    async fn in_synchronous_mode_nothing_is_lost() {
        let hub = Arc::new(Hub::new());
        hub.open(7, false);
        let mut listener = hub.listen(7).unwrap();
        let sender = Arc::clone(&hub);
        let sending = tokio::spawn(async move {
            for number in 0..100 {
                sender.publish(7, vec![number], true).await;
            }
        });
        for number in 0..100 {
            assert_eq!(listener.messages.recv().await.unwrap()[0], number);
        }
        sending.await.unwrap();
    }

    #[tokio::test]
    async fn who_listens_to_a_stream_that_ends_is_waited_for_until_it_has_left() {
        let hub = Arc::new(Hub::new());
        hub.open(7, false);
        let (first, second) = (hub.listen(7).unwrap(), hub.listen(7).unwrap());
        hub.leave(7, second.id);
        hub.close(7);
        let late = Instant::now() + Duration::from_secs(10);
        let waiting = tokio::spawn({
            let hub = Arc::clone(&hub);
            async move { hub.wait_for_leaving(late).await }
        });
        tokio::task::yield_now().await;
        assert!(!waiting.is_finished());
        hub.leave(7, first.id);
        waiting.await.unwrap();
        assert!(Instant::now() < late, "nobody was noticed to leave");
    }

    #[tokio::test]
    async fn who_comes_late_gets_the_last_snapshot() {
        let hub = Hub::new();
        hub.open(1, true);
        hub.publish(1, vec![5], false).await;
        assert_eq!(hub.listen(1).unwrap().messages.recv().await.unwrap()[0], 5);
        assert!(hub.listen(2).is_none());
    }
}
