//! Reads of the settings that wait: the one call that a connection answers by itself can be held
//! back, and with it the thread of the client that made it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::message::Request;

/// Reads that may wait; one more is answered.
const READS_MAX: usize = 64;

/// Where reads of one connection pass, or wait.
#[derive(Debug, Default)]
pub(crate) struct Gate(Mutex<State>);

#[derive(Debug, Default)]
enum State {
    #[default]
    Open,
    Shut(Vec<Request>),
    /// The next that comes opens it.
    Unlocked(Vec<Request>),
}

impl Gate {
    /// Reads wait from now on.
    pub(crate) fn shut(&self) {
        let mut state = self.lock();
        if matches!(*state, State::Open) {
            *state = State::Shut(Vec::new());
        }
    }

    /// The next read passes, and with it all that wait.
    pub(crate) fn unlock(&self) {
        let mut state = self.lock();
        if let State::Shut(waiting) = &mut *state {
            *state = State::Unlocked(std::mem::take(waiting));
        }
    }

    /// All reads pass; those that waited are to be answered.
    pub(crate) fn open(&self) -> Vec<Request> {
        match std::mem::take(&mut *self.lock()) {
            State::Open => Vec::new(),
            State::Shut(waiting) | State::Unlocked(waiting) => waiting,
        }
    }

    /// A read comes: gives those that are to be answered now.
    pub(crate) fn pass(&self, read: Request) -> Vec<Request> {
        let mut state = self.lock();
        match &mut *state {
            State::Shut(waiting) if waiting.len() < READS_MAX => {
                waiting.push(read);
                Vec::new()
            }
            State::Open | State::Shut(_) => vec![read],
            State::Unlocked(waiting) => {
                let mut passing = std::mem::take(waiting);
                // First who opened it: the others may need what it does next.
                passing.insert(0, read);
                *state = State::Open;
                passing
            }
        }
    }

    /// Whether somebody waits.
    pub(crate) fn is_waited_at(&self) -> bool {
        match &*self.lock() {
            State::Open => false,
            State::Shut(waiting) | State::Unlocked(waiting) => !waiting.is_empty(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(id: u8) -> Request {
        let call = rmp_serde::to_vec(&(0, id, "get_episode_settings", ((false,),))).unwrap();
        Request::parse(&call).unwrap()
    }

    fn ids(reads: Vec<Request>) -> Vec<u32> {
        reads.into_iter().map(|read| read.id).collect()
    }

    #[test]
    fn reads_wait_at_a_shut_gate_until_one_comes_after_it_is_unlocked() {
        let gate = Gate::default();
        assert_eq!(ids(gate.pass(read(1))), [1]);
        gate.unlock();
        assert_eq!(ids(gate.pass(read(2))), [2]);
        gate.shut();
        assert!(!gate.is_waited_at());
        assert!(gate.pass(read(3)).is_empty() && gate.pass(read(4)).is_empty());
        gate.unlock();
        assert!(gate.is_waited_at());
        assert_eq!(ids(gate.pass(read(5))), [5, 3, 4]);
        assert_eq!(ids(gate.pass(read(6))), [6]);
    }

    #[test]
    fn who_waits_is_let_through_when_it_opens() {
        let gate = Gate::default();
        gate.shut();
        assert!(gate.pass(read(1)).is_empty());
        assert_eq!(ids(gate.open()), [1]);
        assert!(!gate.is_waited_at());
    }

    #[test]
    fn no_more_wait_than_there_is_room_for() {
        let gate = Gate::default();
        gate.shut();
        for _ in 0..READS_MAX {
            assert!(gate.pass(read(1)).is_empty());
        }
        assert_eq!(ids(gate.pass(read(2))), [2]);
    }
}
