//! Whether a loop turns.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A loop that has been at one turn for so long is stuck. The slowest turns that are right, a
/// picture of the largest size in software or a tick of the largest world on a busy machine, take
/// some seconds.
pub const STUCK_AFTER: Duration = Duration::from_secs(15);

/// Between two beats of a loop that has nothing else to do.
const BEAT_EVERY: Duration = Duration::from_secs(1);

/// Whether a loop turns: since when it has been at its present turn, if it does not wait for work.
#[derive(Debug)]
pub struct Pulse {
    name: String,
    epoch: Instant,
    /// Milliseconds after the epoch, and one; 0: it waits for work.
    busy_since: AtomicU64,
}

/// One turn of a loop; it is over when this value is dropped.
#[must_use = "dropping it says that the turn is over"]
#[derive(Debug)]
pub struct Busy<'a>(&'a Pulse);

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.busy_since.store(0, Ordering::Relaxed);
    }
}

impl Pulse {
    /// Of a loop that waits for work.
    pub(crate) fn new(name: &str, epoch: Instant) -> Self {
        Self { name: name.to_owned(), epoch, busy_since: AtomicU64::new(0) }
    }

    /// Begins a turn.
    ///
    /// **Cost:** two relaxed stores a turn.
    pub fn begin(&self, now: Instant) -> Busy<'_> {
        self.beat(now);
        Busy(self)
    }

    /// For a loop that never waits for longer than [`STUCK_AFTER`]: it has turned.
    pub fn beat(&self, now: Instant) {
        let millis = now.saturating_duration_since(self.epoch).as_millis() as u64;
        self.busy_since.store(millis + 1, Ordering::Relaxed);
    }

    /// Beats for ever: whoever runs this runs other tasks too, unless it is stuck.
    pub async fn beat_for_ever(self: std::sync::Arc<Self>) {
        loop {
            self.beat(Instant::now());
            tokio::time::sleep(BEAT_EVERY).await;
        }
    }

    /// Why the loop counts as stuck, if it does.
    pub(crate) fn why_stuck(&self, now: Instant) -> Option<String> {
        let since = self.busy_since.load(Ordering::Relaxed).checked_sub(1)?;
        let begun = self.epoch + Duration::from_millis(since);
        let taken = now.saturating_duration_since(begun);
        let secs = taken.as_secs();
        (taken > STUCK_AFTER).then(|| format!("{}: no turn for {secs} s", self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_that_waits_is_never_stuck_and_one_at_work_for_too_long_is() {
        let epoch = Instant::now();
        let pulse = Pulse::new("shard-0", epoch);
        let late = epoch + 2 * STUCK_AFTER;
        assert_eq!(pulse.why_stuck(late), None);
        let turn = pulse.begin(epoch + Duration::from_secs(1));
        assert_eq!(pulse.why_stuck(epoch + STUCK_AFTER), None);
        assert_eq!(pulse.why_stuck(late).unwrap(), "shard-0: no turn for 29 s");
        drop(turn);
        assert_eq!(pulse.why_stuck(late), None);
        pulse.beat(late);
        assert_eq!(pulse.why_stuck(late + STUCK_AFTER), None);
        assert!(pulse.why_stuck(late + STUCK_AFTER + Duration::from_millis(2)).is_some());
    }
}
