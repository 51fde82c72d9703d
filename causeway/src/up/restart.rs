//! When a service that died is started again. Pure: the caller measures.

use std::time::Duration;

use crate::failure::USAGE;

/// Pause before a restart of a service that has worked.
const PAUSE_MIN: Duration = Duration::from_millis(100);
/// Longest pause; of deaths in a row each one is twice the last.
const PAUSE_MAX: Duration = Duration::from_secs(5);
/// A service that ended sooner than this has not worked.
const WORKED_AFTER: Duration = Duration::from_secs(2);

/// The memory of one service's deaths.
#[derive(Debug)]
pub(crate) struct RestartPolicy {
    has_worked: bool,
    quick_deaths: u32,
}

/// What to do about a death.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Start it again.
    Restart {
        /// After this time.
        pause: Duration,
        /// How often in a row it has ended before it worked, this time included.
        quick_deaths: u32,
    },
    /// It says itself that it cannot work as configured.
    Misconfigured,
}

impl RestartPolicy {
    /// No deaths so far.
    pub(crate) fn new() -> Self {
        Self { has_worked: false, quick_deaths: 0 }
    }

    /// Judges one death: how long the process ran, and its exit code if it had one.
    pub(crate) fn after_death(&mut self, ran_for: Duration, code: Option<i32>) -> Verdict {
        if ran_for >= WORKED_AFTER {
            self.has_worked = true;
            self.quick_deaths = 0;
        } else if code == Some(i32::from(USAGE)) && !self.has_worked {
            return Verdict::Misconfigured;
        } else {
            self.quick_deaths = self.quick_deaths.saturating_add(1);
        }
        Verdict::Restart { pause: self.pause(), quick_deaths: self.quick_deaths }
    }

    fn pause(&self) -> Duration {
        let doublings = self.quick_deaths.saturating_sub(1).min(u32::BITS - 1);
        PAUSE_MIN.saturating_mul(1 << doublings).min(PAUSE_MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KILLED: Option<i32> = None;

    fn pause_millis(policy: &mut RestartPolicy, ran_secs: u64) -> u128 {
        match policy.after_death(Duration::from_secs(ran_secs), KILLED) {
            Verdict::Restart { pause, .. } => pause.as_millis(),
            Verdict::Misconfigured => panic!("a killed process has said nothing"),
        }
    }

    #[test]
    fn deaths_in_a_row_are_answered_for_ever_with_pauses_that_double_up_to_five_seconds() {
        let mut policy = RestartPolicy::new();
        let pauses: Vec<u128> = (0..8).map(|_| pause_millis(&mut policy, 0)).collect();
        assert_eq!(pauses, [100, 200, 400, 800, 1_600, 3_200, 5_000, 5_000]);
        for _ in 0..10_000 {
            assert_eq!(pause_millis(&mut policy, 0), 5_000);
        }
    }

    #[test]
    fn a_service_that_has_worked_comes_back_at_once() {
        let mut policy = RestartPolicy::new();
        for _ in 0..10 {
            pause_millis(&mut policy, 0);
        }
        assert_eq!(pause_millis(&mut policy, 2), 100);
        assert_eq!(pause_millis(&mut policy, 0), 100);
        assert_eq!(pause_millis(&mut policy, 0), 200);
    }

    #[test]
    fn only_a_service_that_never_worked_is_taken_at_its_word_that_it_cannot() {
        let mut policy = RestartPolicy::new();
        assert_eq!(policy.after_death(Duration::ZERO, Some(2)), Verdict::Misconfigured);
        pause_millis(&mut policy, 2);
        let later = policy.after_death(Duration::ZERO, Some(2));
        assert!(matches!(later, Verdict::Restart { quick_deaths: 1, .. }), "{later:?}");
    }
}
