//! Reads of the settings that wait, and with them the threads of the client that made them.

use crate::rpc::Ticket;

/// Reads that may wait; one more is answered.
const READS_MAX: usize = 64;

/// Where reads of one client pass, or wait.
#[derive(Debug, Default)]
pub(super) enum Gate {
    #[default]
    Open,
    Shut(Vec<Ticket>),
    /// The next that comes opens it.
    Unlocked(Vec<Ticket>),
}

impl Gate {
    /// Reads wait from now on.
    pub(super) fn shut(&mut self) {
        if matches!(self, Self::Open) {
            *self = Self::Shut(Vec::new());
        }
    }

    /// The next read passes, and with it all that wait.
    pub(super) fn unlock(&mut self) {
        if let Self::Shut(waiting) = self {
            *self = Self::Unlocked(std::mem::take(waiting));
        }
    }

    /// All reads pass; those that waited are to be answered.
    pub(super) fn open(&mut self) -> Vec<Ticket> {
        match std::mem::take(self) {
            Self::Open => Vec::new(),
            Self::Shut(waiting) | Self::Unlocked(waiting) => waiting,
        }
    }

    /// A read comes: gives those that are to be answered now.
    pub(super) fn pass(&mut self, read: Ticket) -> Vec<Ticket> {
        match self {
            Self::Shut(waiting) if waiting.len() < READS_MAX => {
                waiting.push(read);
                Vec::new()
            }
            Self::Open | Self::Shut(_) => vec![read],
            Self::Unlocked(waiting) => {
                let mut passing = std::mem::take(waiting);
                // First who opened it: the others may need what it does next.
                passing.insert(0, read);
                *self = Self::Open;
                passing
            }
        }
    }

    /// How many wait.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Open => 0,
            Self::Shut(waiting) | Self::Unlocked(waiting) => waiting.len(),
        }
    }

    /// Whether somebody waits.
    pub(super) fn is_waited_at(&self) -> bool {
        match self {
            Self::Open => false,
            Self::Shut(waiting) | Self::Unlocked(waiting) => !waiting.is_empty(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rpc::ConnectionId;

    fn read(id: u32) -> Ticket {
        Ticket::for_test(ConnectionId(1), id)
    }

    fn ids(reads: Vec<Ticket>) -> Vec<u32> {
        reads.into_iter().map(|read| read.id).collect()
    }

    #[test]
    fn reads_wait_at_a_shut_gate_until_one_comes_after_it_is_unlocked() {
        let mut gate = Gate::default();
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
        let mut gate = Gate::default();
        gate.shut();
        assert!(gate.pass(read(1)).is_empty());
        assert_eq!(ids(gate.open()), [1]);
        assert!(!gate.is_waited_at());
    }

    #[test]
    fn no_more_wait_than_there_is_room_for() {
        let mut gate = Gate::default();
        gate.shut();
        for _ in 0..READS_MAX {
            assert!(gate.pass(read(1)).is_empty());
        }
        assert_eq!(ids(gate.pass(read(2))), [2]);
    }
}
