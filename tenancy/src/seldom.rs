//! What may be said again and again, and is not to fill a log.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Between two times.
const EVERY: Duration = Duration::from_secs(1);

/// Lets something be said once a second.
#[derive(Debug, Default)]
pub struct Seldom {
    told: Mutex<Option<Instant>>,
}

impl Seldom {
    /// Whether it may be said now; then not again for a second.
    pub fn may_tell(&self, now: Instant) -> bool {
        // Nothing panics while it holds the lock.
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let is_due = told.is_none_or(|told| now.saturating_duration_since(told) >= EVERY);
        if is_due {
            *told = Some(now);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_said_once_a_second() {
        let (seldom, now) = (Seldom::default(), Instant::now());
        let said = [0, 1, 999, 1_000, 1_500, 2_000]
            .map(|millis| seldom.may_tell(now + Duration::from_millis(millis)));
        assert_eq!(said, [true, false, false, true, false, true]);
    }
}
