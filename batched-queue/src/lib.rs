//! A bounded queue to a thread of its own, which takes what has gathered every 20 ms.
//!
//! Waking a thread for every piece would cost whoever gives it more than the work itself.
//! [`spawn`] starts the thread; nobody ever waits for it.

use std::io;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

/// How long pieces are gathered.
const GATHERING: Duration = Duration::from_millis(20);

/// Gives pieces to a thread and never waits for it. Dropped, it says that no more are to come.
#[derive(Debug)]
pub struct Giver<T> {
    pieces: SyncSender<T>,
    /// Dropped after the queue's end.
    _last_call: LastCall,
}

#[derive(Debug)]
struct LastCall(Thread);

impl Drop for LastCall {
    fn drop(&mut self) {
        self.0.unpark();
    }
}

impl<T> Giver<T> {
    /// Gives a piece.
    ///
    /// # Errors
    /// The piece, when too many wait or the thread has ended.
    pub fn give(&self, piece: T) -> Result<(), TrySendError<T>> {
        self.pieces.try_send(piece)
    }
}

/// What a thread was given.
#[derive(Debug)]
pub struct Taker<T>(Receiver<T>);

impl<T> Taker<T> {
    /// What has been given a moment from now, in order; perhaps nothing. `None` at the end.
    pub fn gather(&self) -> Option<impl Iterator<Item = T> + '_> {
        thread::park_timeout(GATHERING);
        let first = match self.0.try_recv() {
            Ok(first) => Some(first),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => return None,
        };
        Some(first.into_iter().chain(self.0.try_iter()))
    }
}

/// Starts a thread for which at most so many pieces may wait.
///
/// # Errors
/// The system refuses threads.
pub fn spawn<T: Send + 'static>(
    name: &str,
    waiting_max: usize,
    work: impl FnOnce(Taker<T>) + Send + 'static,
) -> io::Result<(Giver<T>, JoinHandle<()>)> {
    let (pieces, given) = sync_channel(waiting_max);
    let thread = thread::Builder::new().name(name.to_owned());
    let thread = thread.spawn(move || work(Taker(given)))?;
    let last_call = LastCall(thread.thread().clone());
    Ok((Giver { pieces, _last_call: last_call }, thread))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn everything_is_taken_in_order_up_to_the_last() {
        let (told, heard) = channel();
        let (giver, thread) = spawn("test", 1_000, move |taker: Taker<u32>| {
            while let Some(pieces) = taker.gather() {
                told.send(pieces.collect::<Vec<_>>()).unwrap();
            }
        })
        .unwrap();
        (0..500).for_each(|piece| giver.give(piece).unwrap());
        drop(giver);
        thread.join().unwrap();
        assert_eq!(heard.iter().flatten().collect::<Vec<_>>(), (0..500).collect::<Vec<_>>());
    }

    #[test]
    fn who_gives_too_much_or_too_late_is_told() {
        let (end, ending) = channel::<()>();
        let (giver, thread) = spawn("test", 2, move |taker: Taker<u32>| {
            ending.recv().unwrap_err();
            drop(taker);
        })
        .unwrap();
        (0..2).for_each(|piece| giver.give(piece).unwrap());
        assert!(matches!(giver.give(2), Err(TrySendError::Full(2))));
        drop(end);
        thread.join().unwrap();
        assert!(matches!(giver.give(3), Err(TrySendError::Disconnected(3))));
    }
}
