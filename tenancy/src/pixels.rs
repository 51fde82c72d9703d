//! How many pixels a tenant may have drawn in a second.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What may be drawn at once after a pause, in seconds of the quota.
const BURST_SECS: f64 = 2.0;

/// A bucket that fills with the quota, up to two seconds of it. A picture needs what it has,
/// but at most a full bucket, so that no picture is too large for ever.
#[derive(Default)]
pub struct PixelBudget {
    /// Level in pixels and when it was that; `None`: full. Below 0: so much is booked that is not
    /// there yet.
    level: Mutex<Option<(f64, Instant)>>,
}

impl PixelBudget {
    /// Takes the pixels of a picture from a quota of so many a second.
    ///
    /// # Errors
    /// How long it takes until there are enough; nothing is taken.
    pub fn take(&self, pixels: u64, per_second: u64, now: Instant) -> Result<(), Duration> {
        self.draw(pixels, per_second, now, false)
    }

    /// Takes the pixels of a picture from what there is or will be: how long until they are there.
    /// First come, first served: whoever asks later gets what comes later.
    pub fn book(&self, pixels: u64, per_second: u64, now: Instant) -> Duration {
        self.draw(pixels, per_second, now, true).err().unwrap_or_default()
    }

    /// How long until there are enough, if there are not; only who waits has taken them then.
    fn draw(
        &self,
        pixels: u64,
        per_second: u64,
        now: Instant,
        waits: bool,
    ) -> Result<(), Duration> {
        let rate = per_second.max(1) as f64;
        let full = rate * BURST_SECS;
        // Nothing panics while it holds the lock.
        let mut level = self.level.lock().unwrap_or_else(PoisonError::into_inner);
        let (before, since) = level.unwrap_or((full, now));
        let grown = rate * now.saturating_duration_since(since).as_secs_f64();
        let there = (before + grown).min(full);
        let wanted = (pixels as f64).min(full);
        let is_enough = wanted <= there;
        *level = Some((if is_enough || waits { there - wanted } else { there }, now));
        if is_enough {
            return Ok(());
        }
        Err(Duration::from_secs_f64((wanted - there) / rate))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_seconds_of_the_quota_come_at_once_and_then_one_a_second() {
        let (budget, start) = (PixelBudget::default(), Instant::now());
        let take =
            |pixels, millis| budget.take(pixels, 1_000, start + Duration::from_millis(millis));
        assert_eq!(take(1_500, 0), Ok(()));
        assert_eq!(take(500, 0), Ok(()));
        assert_eq!(take(250, 0), Err(Duration::from_millis(250)));
        assert_eq!(take(250, 250), Ok(()));
        assert_eq!(take(1_001, 1_250), Err(Duration::from_millis(1)));
        assert_eq!(take(1_000, 1_250), Ok(()));
    }

    #[test]
    fn who_waits_for_a_large_picture_gets_it_before_all_who_come_later() {
        let (budget, start) = (PixelBudget::default(), Instant::now());
        let at = |millis| start + Duration::from_millis(millis);
        assert_eq!(budget.book(2_000, 1_000, start), Duration::ZERO);
        assert_eq!(budget.book(1_000, 1_000, start), Duration::from_secs(1));
        assert_eq!(budget.take(100, 1_000, at(500)), Err(Duration::from_millis(600)));
        assert_eq!(budget.book(100, 1_000, at(500)), Duration::from_millis(600));
        assert_eq!(budget.take(100, 1_000, at(1_100)), Err(Duration::from_millis(100)));
        assert_eq!(budget.take(100, 1_000, at(1_200)), Ok(()));
    }

    #[test]
    fn a_picture_larger_than_the_bucket_comes_when_it_is_full() {
        let (budget, start) = (PixelBudget::default(), Instant::now());
        assert_eq!(budget.take(1_000_000, 1_000, start), Ok(()));
        assert_eq!(budget.take(1, 1_000, start), Err(Duration::from_millis(1)));
    }
}
