//! A journal that a thread of its own writes.

use std::io::{self, ErrorKind, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::TrySendError;
use std::thread::JoinHandle;

use batched_queue::{Giver, Taker};
use monitoring::Counter;

use super::entry::{Entry, Head, Scribe};
use super::writer::Writer;

/// Entries that may wait for the disk: a tenth of a second of fast worlds, minutes of others.
const ENTRIES_WAITING_MAX: usize = 4_096;
/// Memory that they may take.
const BYTES_WAITING_MAX: usize = 128 * 1024 * 1024;

/// What waits for the thread of a journal; dropped, the journal ends.
pub struct Queue {
    entries: Giver<Message>,
    waiting_bytes: Arc<AtomicUsize>,
    /// Of all entries so far, before they are packed.
    bytes: Counter,
}

enum Message {
    Entry(Entry),
    End(Box<dyn FnOnce() + Send>),
}

impl Queue {
    /// Begins a journal of at most `bytes_max` bytes, with its thread, whose log calls it `name`.
    ///
    /// # Errors
    /// The system refuses threads.
    pub fn begin(
        out: impl Write + Send + 'static,
        bytes_max: u64,
        head: Head,
        name: String,
        bytes: Counter,
    ) -> io::Result<(Self, JoinHandle<()>)> {
        let waiting_bytes = Arc::new(AtomicUsize::new(0));
        let taken = Arc::clone(&waiting_bytes);
        let work = move |waiting| match write_all(out, bytes_max, &head, &waiting, &taken) {
            Ok(()) => tracing::info!(name, "a journal is written"),
            Err(error) => tracing::error!(name, %error, "a journal ends before its world"),
        };
        let (entries, thread) = batched_queue::spawn("journal", ENTRIES_WAITING_MAX, work)?;
        Ok((Self { entries, waiting_bytes, bytes }, thread))
    }
}

impl Scribe for Queue {
    fn put(&mut self, entry: Entry) -> io::Result<()> {
        let bytes = entry.bytes();
        let too_slow = || io::Error::new(ErrorKind::TimedOut, "the disk is too slow for it");
        if self.waiting_bytes.fetch_add(bytes, Ordering::Relaxed) + bytes > BYTES_WAITING_MAX {
            return Err(too_slow());
        }
        self.bytes.inc_by(bytes as u64);
        self.entries.give(Message::Entry(entry)).map_err(|error| match error {
            TrySendError::Full(_) => too_slow(),
            // Its thread has said why.
            TrySendError::Disconnected(_) => io::Error::other("it cannot be written any more"),
        })
    }

    fn end(self: Box<Self>, then: Box<dyn FnOnce() + Send>) {
        if let Err(
            TrySendError::Full(Message::End(then)) | TrySendError::Disconnected(Message::End(then)),
        ) = self.entries.give(Message::End(then))
        {
            // Nobody is told any more when all is written, or it never will be.
            then();
        }
    }
}

fn write_all(
    out: impl Write,
    bytes_max: u64,
    head: &Head,
    waiting: &Taker<Message>,
    waiting_bytes: &AtomicUsize,
) -> io::Result<()> {
    let mut writer = Writer::begin(out, bytes_max, head)?;
    let mut told = None;
    'messages: while let Some(messages) = waiting.gather() {
        for message in messages {
            match message {
                Message::Entry(entry) => {
                    writer.write(&entry)?;
                    waiting_bytes.fetch_sub(entry.bytes(), Ordering::Relaxed);
                }
                Message::End(then) => {
                    told = Some(then);
                    break 'messages;
                }
            }
        }
    }
    let finished = writer.finish().map(drop);
    if let Some(then) = told {
        then();
    }
    finished
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_queue_that_is_full_refuses_at_once() {
        // A thread that takes nothing until the end.
        let (end, ending) = std::sync::mpsc::channel::<()>();
        let queue = |waiting_max, ending: std::sync::mpsc::Receiver<()>| {
            let work = move |_waiting: Taker<Message>| ending.recv().unwrap_or_default();
            let (entries, _) = batched_queue::spawn("journal", waiting_max, work).unwrap();
            let (waiting_bytes, bytes) = Default::default();
            Queue { entries, waiting_bytes, bytes }
        };
        let mut full = queue(1, ending);
        full.put(Entry::Commands(vec![0; 8])).unwrap();
        assert_eq!(full.put(Entry::Commands(Vec::new())).unwrap_err().kind(), ErrorKind::TimedOut);
        let (_end, ending) = std::sync::mpsc::channel();
        let huge = Entry::Commands(vec![0; BYTES_WAITING_MAX + 1]);
        let refused = queue(2, ending).put(huge).unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::TimedOut);
        drop(end);
    }
}
