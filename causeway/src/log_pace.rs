//! How many lines one place of the program may log: strangers decide how often some are said.
//!
//! What is only said on demand (`debug`, `trace`) is left alone, and so are records of the crate
//! `log`, which have no places of their own.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tracing::callsite::Identifier;
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::{Context, Filter};

/// Lines of one place at once, after it was silent for long enough.
const AT_ONCE: f64 = 100.0;
/// Lines of one place a second, for as long as it likes.
const PER_SECOND: f64 = 10.0;

/// Counts what each place of the program says, and how much of it is left out.
#[derive(Debug)]
pub(crate) struct LogPace<K = Identifier> {
    places: Mutex<HashMap<K, Place>>,
}

#[derive(Debug)]
struct Place {
    lines_left: f64,
    since: Instant,
    left_out: u64,
}

impl<K> Default for LogPace<K> {
    fn default() -> Self {
        Self { places: Mutex::default() }
    }
}

impl<K: Eq + Hash> LogPace<K> {
    /// Whether a place may say another line; one that may not is counted.
    fn admit(&self, place: K, now: Instant) -> bool {
        let mut places = self.lock();
        let place =
            places.entry(place).or_insert(Place { lines_left: AT_ONCE, since: now, left_out: 0 });
        let silent_secs = now.saturating_duration_since(place.since).as_secs_f64();
        place.lines_left = (place.lines_left + silent_secs * PER_SECOND).min(AT_ONCE);
        place.since = now;
        if place.lines_left < 1.0 {
            place.left_out += 1;
            return false;
        }
        place.lines_left -= 1.0;
        true
    }

    /// How many lines of a place were left out since this was asked.
    pub(crate) fn take_left_out(&self, place: &K) -> u64 {
        self.lock().get_mut(place).map_or(0, |place| std::mem::take(&mut place.left_out))
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<K, Place>> {
        // Nothing panics while it holds the lock.
        self.places.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: Subscriber> Filter<S> for &'static LogPace {
    fn enabled(&self, _: &Metadata<'_>, _: &Context<'_, S>) -> bool {
        true
    }

    fn callsite_enabled(&self, _: &'static Metadata<'static>) -> Interest {
        Interest::always()
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::TRACE)
    }

    fn event_enabled(&self, event: &Event<'_>, _: &Context<'_, S>) -> bool {
        let said = event.metadata();
        let is_paced = *said.level() <= Level::INFO && said.target() != "log";
        !is_paced || self.admit(said.callsite(), Instant::now())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// Of so many lines each of some seconds, how many are said.
    fn said(pace: &LogPace<&str>, place: &'static str, begun: Instant, counts: &[u32]) -> Vec<u32> {
        let times = (0..).map(|secs| begun + Duration::from_secs(secs));
        let lines = counts.iter().zip(times);
        let said = lines.map(|(count, now)| (0..*count).filter(|_| pace.admit(place, now)).count());
        said.map(|count| count as u32).collect()
    }

    #[test]
    fn a_place_that_says_little_is_heard_and_one_that_says_much_is_bounded() {
        let (pace, begun) = (LogPace::default(), Instant::now());
        assert_eq!(said(&pace, "loud", begun, &[1_000, 1_000, 5, 1_000]), [100, 10, 5, 15]);
        assert_eq!(said(&pace, "quiet", begun, &[10; 4]), [10; 4]);
    }

    #[test]
    fn what_is_left_out_is_told_once() {
        let pace = LogPace::default();
        said(&pace, "loud", Instant::now(), &[140]);
        assert_eq!((pace.take_left_out(&"loud"), pace.take_left_out(&"loud")), (40, 0));
        assert_eq!(pace.take_left_out(&"another"), 0);
    }
}
