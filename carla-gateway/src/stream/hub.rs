//! Who listens to what. Slow listeners lose messages in asynchronous mode and hold the simulation
//! up in synchronous mode, as in CARLA; the memory they take is bounded either way.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, watch};
use tokio::time::Instant;

use super::StreamId;
use crate::dialect::ClientVersion;
use crate::figures::StreamFigures;

/// Messages that may wait for one listener.
const MESSAGES_MAX: usize = 8;
/// Bytes that may wait for all listeners.
const WAITING_BYTES_MAX: usize = 1024 * 1024 * 1024;
/// How long the simulation waits for a listener that takes nothing; then it is disconnected.
const LISTENER_WAIT: Duration = Duration::from_secs(30);
/// Losses between two lines in the log.
const LOSSES_PER_WARNING: u64 = 1_000;

/// One message, shared by all listeners.
type Message = Arc<Vec<u8>>;

/// A message that waits for one listener, and takes up room until it was read.
pub(crate) struct Letter {
    pub(crate) message: Message,
    _room: OwnedSemaphorePermit,
}

/// All streams of an endpoint and their listeners.
pub(crate) struct Hub {
    streams: Mutex<Streams>,
    changes: watch::Sender<u64>,
    /// In bytes.
    room: Arc<Semaphore>,
    figures: StreamFigures,
    version: ClientVersion,
}

#[derive(Default)]
struct Streams {
    open: BTreeMap<StreamId, Stream>,
    /// Listeners of streams that ended, who keep their connections.
    resting: BTreeSet<u64>,
    /// Those of them who are to read the rest and leave.
    leaving: BTreeSet<u64>,
    /// Streams that have lost their last listener since somebody asked.
    deserted: BTreeSet<StreamId>,
    next_listener: u64,
    losses: u64,
}

#[derive(Default)]
struct Stream {
    listeners: BTreeMap<u64, mpsc::Sender<Letter>>,
    /// How many ever came.
    comings: u64,
    /// Sent at once to who comes later; only where that makes sense.
    last: Option<Message>,
    keeps_last: bool,
}

/// A place in a stream.
pub(crate) struct Listener {
    pub(crate) id: u64,
    pub(crate) letters: mpsc::Receiver<Letter>,
}

impl Hub {
    /// No streams, and nobody asks what they send.
    #[cfg(test)]
    pub(crate) fn new() -> Self {
        Self::counting(StreamFigures::default())
    }

    /// No streams.
    pub(crate) fn counting(figures: StreamFigures) -> Self {
        Self {
            streams: Mutex::default(),
            changes: watch::Sender::new(0),
            room: Arc::new(Semaphore::new(WAITING_BYTES_MAX)),
            figures,
            version: ClientVersion::default(),
        }
    }

    /// For clients of a version.
    pub(crate) fn serving(self, version: ClientVersion) -> Self {
        Self { version, ..self }
    }

    /// Opens a stream; with `keeps_last`, who comes later gets the last message at once.
    pub(crate) fn open(&self, stream: StreamId, keeps_last: bool) {
        let opened = Stream { keeps_last, ..Stream::default() };
        self.lock().open.entry(stream).or_insert(opened);
    }

    /// Whether somebody may listen to a stream.
    pub(crate) fn is_open(&self, stream: StreamId) -> bool {
        self.lock().open.contains_key(&stream)
    }

    /// Ends a stream. Its listeners keep their connections: a client whose connection ends comes
    /// back at once, again and again.
    pub(crate) fn close(&self, stream: StreamId) {
        let mut streams = self.lock();
        let ended = streams.open.remove(&stream);
        streams.deserted.remove(&stream);
        // A client that has listened twice has lost sight of the earlier connection, and ends with
        // an error when it would come back for that one.
        let newest = ended.and_then(|stream| stream.listeners.into_keys().next_back());
        streams.resting.extend(newest);
    }

    /// Whether the listener of a stream that ended is to read the rest and leave.
    pub(crate) fn is_leaving(&self, listener: u64) -> bool {
        self.lock().leaving.contains(&listener)
    }

    /// Something has changed: somebody has come, has left or is to leave.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// Waits until the listeners of all streams that ended have read everything and left.
    pub(crate) async fn wait_for_leaving(&self, until: Instant) {
        self.ask_to_leave();
        let mut changes = self.changes.subscribe();
        while !self.lock().leaving.is_empty() {
            if tokio::time::timeout_at(until, changes.changed()).await.is_err() {
                return;
            }
        }
    }

    fn ask_to_leave(&self) {
        let mut streams = self.lock();
        let resting = std::mem::take(&mut streams.resting);
        streams.leaving.extend(resting);
        drop(streams);
        self.changes.send_modify(|version| *version += 1);
    }

    /// How many listen.
    pub(crate) fn listener_count(&self, stream: StreamId) -> usize {
        self.lock().open.get(&stream).map_or(0, |stream| stream.listeners.len())
    }

    /// How many ever listened.
    pub(crate) fn comings(&self, stream: StreamId) -> u64 {
        self.lock().open.get(&stream).map_or(0, |stream| stream.comings)
    }

    /// Takes a place; `None` for a stream that does not exist.
    pub(crate) fn listen(&self, stream: StreamId) -> Option<Listener> {
        let mut streams = self.lock();
        let id = streams.next_listener;
        streams.next_listener += 1;
        let stream = streams.open.get_mut(&stream)?;
        let (sender, letters) = mpsc::channel(MESSAGES_MAX);
        if let Some(letter) = stream.last.as_ref().and_then(|last| self.letter(last)) {
            // Nothing was sent to it before.
            let _ = sender.try_send(letter);
        }
        stream.listeners.insert(id, sender);
        stream.comings += 1;
        drop(streams);
        self.changes.send_modify(|version| *version += 1);
        Some(Listener { id, letters })
    }

    /// Gives a place up.
    pub(crate) fn leave(&self, stream: StreamId, listener: u64) {
        let mut streams = self.lock();
        streams.resting.remove(&listener);
        if streams.leaving.remove(&listener) {
            self.changes.send_modify(|version| *version += 1);
        }
        let Some(place) = streams.open.get_mut(&stream) else { return };
        place.listeners.remove(&listener);
        if place.listeners.is_empty() {
            streams.deserted.insert(stream);
        }
    }

    /// Streams that have lost their last listener since the last time.
    pub(crate) fn take_deserted(&self) -> BTreeSet<StreamId> {
        std::mem::take(&mut self.lock().deserted)
    }

    /// Waits until so many have come, or a moment of patience has passed.
    pub(crate) async fn wait_for(&self, stream: StreamId, comings: u64, until: Instant) {
        let mut changes = self.changes.subscribe();
        while self.comings(stream) < comings {
            if tokio::time::timeout_at(until, changes.changed()).await.is_err() {
                return;
            }
        }
    }

    /// Keeps a message for who comes next, and sends it to nobody.
    pub(crate) fn keep(&self, stream: StreamId, message: Vec<u8>) {
        let Some(message) = self.version.payload(message) else { return };
        if let Some(stream) = self.lock().open.get_mut(&stream) {
            stream.last = Some(Arc::new(message));
        }
    }

    /// Sends the message that is kept for who comes next to those who are here, too.
    pub(crate) async fn publish_last(&self, stream: StreamId) {
        let last = self.lock().open.get(&stream).and_then(|stream| stream.last.clone());
        if let Some(last) = last {
            let behind = self.offer(stream, &last);
            self.note_losses(behind.len() as u64);
        }
    }

    /// Sends to all listeners: at once and with losses, or waiting for each.
    pub(crate) async fn publish(&self, stream: StreamId, message: Vec<u8>, waits: bool) {
        let Some(message) = self.version.payload(message).map(Arc::new) else { return };
        let behind = self.offer(stream, &message);
        if !waits {
            return self.note_losses(behind.len() as u64);
        }
        for (id, listener) in behind {
            let sending = async {
                let bytes = room_of(&message);
                let room = Arc::clone(&self.room).acquire_many_owned(bytes).await.ok()?;
                listener.send(Letter { message: Arc::clone(&message), _room: room }).await.ok()?;
                self.figures.note_sent(1, message.len());
                Some(())
            };
            if tokio::time::timeout(LISTENER_WAIT, sending).await.is_err() {
                tracing::warn!(stream = stream.0, "a listener that takes nothing is disconnected");
                self.leave(stream, id);
            }
        }
    }

    /// Sends to those who have room, and gives the others.
    fn offer(&self, stream: StreamId, message: &Message) -> Vec<(u64, mpsc::Sender<Letter>)> {
        let mut streams = self.lock();
        let Some(stream) = streams.open.get_mut(&stream) else { return Vec::new() };
        if stream.keeps_last {
            stream.last = Some(Arc::clone(message));
        }
        let mut behind = Vec::new();
        for (id, listener) in &stream.listeners {
            let is_behind = self.letter(message).is_none_or(|letter| {
                matches!(listener.try_send(letter), Err(mpsc::error::TrySendError::Full(_)))
            });
            if is_behind {
                behind.push((*id, listener.clone()));
            }
        }
        self.figures.note_sent(stream.listeners.len() - behind.len(), message.len());
        behind
    }

    /// A message for one listener, if there is room for it.
    fn letter(&self, message: &Message) -> Option<Letter> {
        let room = Arc::clone(&self.room).try_acquire_many_owned(room_of(message)).ok()?;
        Some(Letter { message: Arc::clone(message), _room: room })
    }

    fn note_losses(&self, count: u64) {
        if count == 0 {
            return;
        }
        self.figures.dropped.inc_by(count);
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

/// What a message takes up; the largest fits.
fn room_of(message: &Message) -> u32 {
    u32::try_from(message.len().min(WAITING_BYTES_MAX)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn all_listeners_together_keep_no_more_waiting_than_there_is_room_for() {
        const MESSAGE_BYTES: usize = 64 * 1024 * 1024;
        let hub = Hub::new();
        let mut listeners = Vec::new();
        for stream in (0..8).map(StreamId) {
            hub.open(stream, false);
            listeners.push(hub.listen(stream).unwrap());
        }
        for _ in 0..MESSAGES_MAX {
            for stream in (0..8).map(StreamId) {
                // Never written to, so that it costs no memory.
                hub.publish(stream, vec![0; MESSAGE_BYTES], false).await;
            }
        }
        let waiting: usize = listeners.iter().map(|listener| listener.letters.len()).sum();
        assert_eq!(waiting * MESSAGE_BYTES, WAITING_BYTES_MAX);
        listeners[0].letters.recv().await.unwrap();
        hub.publish(StreamId(7), vec![0; MESSAGE_BYTES], false).await;
        let waiting: usize = listeners.iter().map(|listener| listener.letters.len()).sum();
        assert_eq!(waiting * MESSAGE_BYTES, WAITING_BYTES_MAX);
    }

    #[tokio::test]
    async fn a_slow_listener_loses_messages_and_keeps_the_order() {
        let hub = Hub::new();
        hub.open(StreamId(7), false);
        let mut listener = hub.listen(StreamId(7)).unwrap();
        for number in 0..20 {
            hub.publish(StreamId(7), vec![number], false).await;
        }
        let mut found = Vec::new();
        while let Ok(message) = listener.letters.try_recv() {
            found.push(message.message[0]);
        }
        assert_eq!(found, (0..MESSAGES_MAX as u8).collect::<Vec<_>>());
    }

    #[tokio::test]
    async fn in_synchronous_mode_nothing_is_lost() {
        let hub = Arc::new(Hub::new());
        hub.open(StreamId(7), false);
        let mut listener = hub.listen(StreamId(7)).unwrap();
        let sender = Arc::clone(&hub);
        let sending = tokio::spawn(async move {
            for number in 0..100 {
                sender.publish(StreamId(7), vec![number], true).await;
            }
        });
        for number in 0..100 {
            assert_eq!(listener.letters.recv().await.unwrap().message[0], number);
        }
        sending.await.unwrap();
    }

    #[tokio::test]
    async fn who_listens_to_a_stream_that_ends_is_waited_for_until_it_has_left() {
        let hub = Arc::new(Hub::new());
        hub.open(StreamId(7), false);
        let (first, second) = (hub.listen(StreamId(7)).unwrap(), hub.listen(StreamId(7)).unwrap());
        hub.leave(StreamId(7), second.id);
        hub.close(StreamId(7));
        let late = Instant::now() + Duration::from_secs(10);
        let waiting = tokio::spawn({
            let hub = Arc::clone(&hub);
            async move { hub.wait_for_leaving(late).await }
        });
        tokio::task::yield_now().await;
        assert!(!waiting.is_finished());
        hub.leave(StreamId(7), first.id);
        waiting.await.unwrap();
        assert!(Instant::now() < late, "nobody was noticed to leave");
    }

    #[tokio::test]
    async fn who_comes_late_gets_the_last_snapshot() {
        let hub = Hub::new();
        hub.open(StreamId(1), true);
        hub.publish(StreamId(1), vec![5], false).await;
        assert_eq!(hub.listen(StreamId(1)).unwrap().letters.recv().await.unwrap().message[0], 5);
        assert!(hub.listen(StreamId(2)).is_none());
    }
}
