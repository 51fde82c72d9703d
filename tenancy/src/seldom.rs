//! What may be said again and again, and is not to fill a log.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Between two times.
const EVERY: Duration = Duration::from_secs(1);

/// Lets each of several things be said once a second.
#[derive(Debug)]
pub struct Seldom<K> {
    told: Mutex<BTreeMap<K, Instant>>,
}

impl<K> Default for Seldom<K> {
    fn default() -> Self {
        Self { told: Mutex::default() }
    }
}

impl<K: Ord> Seldom<K> {
    /// Whether one of them may be said now; then not again for a second.
    pub fn may_tell(&self, what: K, now: Instant) -> bool {
        // Nothing panics while it holds the lock.
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.retain(|_, told| now.saturating_duration_since(*told) < EVERY);
        if told.contains_key(&what) {
            return false;
        }
        told.insert(what, now);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_said_once_a_second() {
        let (seldom, now) = (Seldom::default(), Instant::now());
        let said = [0, 1, 999, 1_000, 1_500, 2_000]
            .map(|millis| seldom.may_tell((), now + Duration::from_millis(millis)));
        assert_eq!(said, [true, false, false, true, false, true]);
    }

    #[test]
    fn each_is_said_whatever_was_said_of_others() {
        let (seldom, now) = (Seldom::default(), Instant::now());
        let said = ["cameras", "actors", "cameras", "actors"].map(|it| seldom.may_tell(it, now));
        assert_eq!(said, [true, true, false, false]);
        assert!(seldom.may_tell("actors", now + EVERY));
        assert_eq!(seldom.told.lock().unwrap().len(), 1, "what is over is forgotten");
    }
}
