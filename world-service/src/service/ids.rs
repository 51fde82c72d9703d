//! World ids, and how many worlds there may be.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use schemas::{Error, ErrorCode, WorldId};

/// Ids of one process, from its random epoch and a count, so that an id of an earlier process names
/// no world of this one.
pub struct Ids {
    host: u32,
    count: AtomicU64,
}

impl Ids {
    /// Ids of the process with this epoch.
    pub fn new(epoch: u64) -> Self {
        let host = (epoch % (1 << WorldId::HOST_BITS)) as u32;
        Self { host, count: AtomicU64::new(0) }
    }

    /// The number of the process in its ids.
    pub fn host(&self) -> u32 {
        self.host
    }

    /// An id that this process has not given yet.
    pub fn next(&self) -> WorldId {
        WorldId::of_host(self.host, self.count.fetch_add(1, Ordering::Relaxed) + 1)
    }

    /// The shard that owns a world; consecutive ids take turns.
    pub fn shard_of(id: WorldId, shard_count: usize) -> usize {
        (id.get() % shard_count as u64) as usize
    }
}

/// How many worlds there may be at once.
#[derive(Clone)]
pub struct Seats {
    tally: Arc<Tally>,
    max: usize,
}

/// The right of one world to exist; given back when dropped.
pub struct Seat(Arc<Tally>);

#[derive(Default)]
struct Tally {
    taken: AtomicUsize,
    begun: AtomicU64,
    quarantined: AtomicU64,
}

impl Seats {
    /// None taken.
    pub fn new(max: usize) -> Self {
        Self { tally: Arc::default(), max }
    }

    /// Worlds there are or are about to be.
    pub fn taken(&self) -> usize {
        self.tally.taken.load(Ordering::Relaxed)
    }

    /// Worlds at once.
    pub fn max(&self) -> usize {
        self.max
    }

    /// Worlds that ever were.
    pub fn begun(&self) -> u64 {
        self.tally.begun.load(Ordering::Relaxed)
    }

    /// Worlds that were ever put aside.
    pub fn quarantined(&self) -> u64 {
        self.tally.quarantined.load(Ordering::Relaxed)
    }

    /// All or none of `count` seats.
    ///
    /// # Errors
    /// [`ErrorCode::Capacity`].
    pub fn take(&self, count: usize) -> Result<Vec<Seat>, Error> {
        let fits = |taken: usize| taken.checked_add(count).filter(|sum| *sum <= self.max);
        let taken = self.tally.taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits);
        match taken {
            Ok(_) => Ok((0..count).map(|_| Seat(Arc::clone(&self.tally))).collect()),
            Err(taken) => Err(Error::new(ErrorCode::Capacity, "no room for more worlds")
                .wanted(format_args!("at most {} worlds", self.max))
                .found(format_args!("{taken} and {count} more"))),
        }
    }
}

impl Seat {
    /// Its world has begun.
    pub(super) fn note_begin(&self) {
        self.0.begun.fetch_add(1, Ordering::Relaxed);
    }

    /// Its world was put aside.
    pub(super) fn note_quarantine(&self) {
        self.0.quarantined.fetch_add(1, Ordering::Relaxed);
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.taken.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_two_processes_differ_and_stay_exact_in_json() {
        let (first, second) = (Ids::new(u64::MAX), Ids::new(6));
        assert_ne!(first.next(), second.next());
        assert!(first.next().get() < 1 << 53);
    }

    #[test]
    fn seats_are_taken_whole_or_not_and_given_back() {
        let seats = Seats::new(3);
        let two = seats.take(2).unwrap();
        assert_eq!((seats.taken(), seats.begun()), (2, 0));
        two[0].note_begin();
        assert_eq!(seats.take(2).err().unwrap().code, ErrorCode::Capacity);
        drop(two);
        assert_eq!((seats.taken(), seats.begun(), seats.quarantined()), (0, 1, 0));
        assert_eq!(seats.take(3).unwrap().len(), 3);
        assert_eq!(seats.take(usize::MAX).err().unwrap().code, ErrorCode::Capacity);
    }
}
