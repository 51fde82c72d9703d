//! What is published leaves the thread that has it to say at once, and never waits there.
//!
//! The transport drops what a receiver has no room for, but takes up to some tens of milliseconds
//! before it gives a large message up. A thread of its own takes that time; meanwhile the newest
//! publications wait in a queue and the oldest go.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, Once, PoisonError};

use zenoh::Wait;
use zenoh::qos::CongestionControl;

/// Publications that wait, and bytes of them; the newest may always wait.
const WAITING_MAX: usize = 256;
const WAITING_BYTES_MAX: usize = 64 * 1024 * 1024;

/// Sends what one process publishes, until it is dropped.
pub(crate) struct Publishing {
    session: zenoh::Session,
    queue: Arc<Queue>,
    /// The thread begins with the first publication.
    begun: Once,
}

#[derive(Default)]
struct Queue {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Default)]
struct Waiting {
    publications: VecDeque<Publication>,
    bytes: usize,
    dropped: u64,
    is_over: bool,
}

struct Publication {
    key: String,
    payload: Vec<u8>,
}

impl Publishing {
    /// Of a session; nothing runs yet.
    pub(crate) fn of(session: zenoh::Session) -> Self {
        Self { session, queue: Arc::default(), begun: Once::new() }
    }

    /// By which it publishes.
    pub(crate) fn session(&self) -> &zenoh::Session {
        &self.session
    }

    /// How many publications were given up before they were sent.
    pub(crate) fn dropped(&self) -> impl Fn() -> u64 + Send + Sync + use<> {
        let queue = Arc::clone(&self.queue);
        move || queue.lock().dropped
    }

    /// Has something published. Never waits.
    pub(crate) fn push(&self, key: String, payload: Vec<u8>) {
        self.queue.push(Publication { key, payload });
        self.begun.call_once(|| {
            let (session, queue) = (self.session.clone(), Arc::clone(&self.queue));
            let thread = std::thread::Builder::new().name("publishing".to_owned());
            if let Err(cause) = thread.spawn(move || queue.send_all(&session)) {
                tracing::error!(%cause, "nothing is published: no thread");
            }
        });
    }
}

impl Drop for Publishing {
    fn drop(&mut self) {
        self.queue.lock().is_over = true;
        self.queue.changed.notify_one();
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        // Nothing panics while it holds the lock.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(&self, publication: Publication) {
        self.lock().push(publication);
        self.changed.notify_one();
    }

    fn send_all(&self, session: &zenoh::Session) {
        while let Some(Publication { key, payload }) = self.next() {
            let put = session.put(&key, payload).congestion_control(CongestionControl::Drop);
            if let Err(cause) = put.wait() {
                tracing::debug!(key, %cause, "nothing was published");
            }
        }
    }

    /// The oldest that waits; `None` when nobody publishes any more.
    fn next(&self) -> Option<Publication> {
        let waits = |waiting: &mut Waiting| waiting.publications.is_empty() && !waiting.is_over;
        let waiting = self.changed.wait_while(self.lock(), waits);
        waiting.unwrap_or_else(PoisonError::into_inner).pop()
    }
}

impl Waiting {
    fn push(&mut self, publication: Publication) {
        self.bytes += publication.payload.len();
        self.publications.push_back(publication);
        let is_too_much = |waiting: &Self| {
            waiting.publications.len() > WAITING_MAX || waiting.bytes > WAITING_BYTES_MAX
        };
        while self.publications.len() > 1 && is_too_much(self) {
            self.pop();
            self.dropped += 1;
            if self.dropped.is_power_of_two() {
                tracing::warn!(dropped = self.dropped, "publications go faster than they are sent");
            }
        }
    }

    fn pop(&mut self) -> Option<Publication> {
        let publication = self.publications.pop_front()?;
        self.bytes -= publication.payload.len();
        Some(publication)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn publication(key: usize, bytes: usize) -> Publication {
        Publication { key: key.to_string(), payload: vec![0; bytes] }
    }

    #[test]
    fn what_waits_is_bounded_in_number_and_the_newest_are_kept() {
        let mut waiting = Waiting::default();
        (0..WAITING_MAX + 9).for_each(|key| waiting.push(publication(key, 1)));
        assert_eq!((waiting.publications.len(), waiting.dropped), (WAITING_MAX, 9));
        assert_eq!((waiting.bytes, waiting.pop().unwrap().key), (WAITING_MAX, "9".to_owned()));
    }

    #[test]
    fn what_waits_is_bounded_in_bytes_and_one_may_always_wait() {
        let mut waiting = Waiting::default();
        (0..3).for_each(|key| waiting.push(publication(key, WAITING_BYTES_MAX / 2)));
        assert_eq!((waiting.publications.len(), waiting.bytes), (2, WAITING_BYTES_MAX));
        waiting.push(publication(3, WAITING_BYTES_MAX + 1));
        assert_eq!((waiting.publications.len(), waiting.pop().unwrap().key), (1, "3".to_owned()));
        assert_eq!(waiting.bytes, 0);
    }
}
