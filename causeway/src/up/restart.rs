//! When a service that died is started again, and when it is given up. Pure: the caller measures.

use std::time::Duration;

use crate::failure::USAGE;

/// Pause before the first restart.
const PAUSE_MIN: Duration = Duration::from_millis(100);
/// Longest pause; each one is twice the last.
const PAUSE_MAX: Duration = Duration::from_secs(5);
/// A service that ran this long has recovered: the next pause is the shortest again.
const RECOVERED_AFTER: Duration = Duration::from_secs(30);
/// A service that ends sooner than this has not started.
const STARTED_AFTER: Duration = Duration::from_secs(2);
/// Starts in a row that may fail.
const FAILED_STARTS_MAX: u32 = 5;

/// The memory of one service's deaths.
#[derive(Debug)]
pub(crate) struct RestartPolicy {
    pause: Duration,
    failed_starts: u32,
}

/// What to do about a death.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Start it again after the pause.
    RestartAfter(Duration),
    /// It says itself that it cannot work as configured.
    Misconfigured,
    /// It failed to start too often in a row.
    CannotStart,
}

impl RestartPolicy {
    /// No deaths so far.
    pub(crate) fn new() -> Self {
        Self { pause: PAUSE_MIN, failed_starts: 0 }
    }

    /// Judges one death: how long the process ran, and its exit code if it had one.
    pub(crate) fn after_death(&mut self, ran_for: Duration, code: Option<i32>) -> Verdict {
        if code == Some(i32::from(USAGE)) {
            return Verdict::Misconfigured;
        }
        if ran_for >= STARTED_AFTER {
            self.failed_starts = 0;
        } else {
            self.failed_starts += 1;
        }
        if self.failed_starts >= FAILED_STARTS_MAX {
            return Verdict::CannotStart;
        }
        if ran_for >= RECOVERED_AFTER {
            self.pause = PAUSE_MIN;
        }
        let pause = self.pause;
        self.pause = (pause * 2).min(PAUSE_MAX);
        Verdict::RestartAfter(pause)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KILLED: Option<i32> = None;

    fn pause_after(policy: &mut RestartPolicy, ran_secs: u64) -> Duration {
        match policy.after_death(Duration::from_secs(ran_secs), KILLED) {
            Verdict::RestartAfter(pause) => pause,
            verdict => panic!("{verdict:?}"),
        }
    }

    #[test]
    fn pauses_double_up_to_five_seconds() {
        let mut policy = RestartPolicy::new();
        let millis: Vec<u128> = (0..8).map(|_| pause_after(&mut policy, 10).as_millis()).collect();
        assert_eq!(millis, [100, 200, 400, 800, 1_600, 3_200, 5_000, 5_000]);
    }

    #[test]
    fn half_a_minute_of_health_forgives() {
        let mut policy = RestartPolicy::new();
        pause_after(&mut policy, 10);
        pause_after(&mut policy, 10);
        assert_eq!(pause_after(&mut policy, 30), PAUSE_MIN);
    }

    #[test]
    fn the_fifth_failed_start_in_a_row_is_the_last() {
        let mut policy = RestartPolicy::new();
        for _ in 0..4 {
            pause_after(&mut policy, 0);
        }
        assert_eq!(policy.after_death(Duration::ZERO, Some(1)), Verdict::CannotStart);
    }

    #[test]
    fn a_service_that_had_started_is_never_given_up() {
        let mut policy = RestartPolicy::new();
        for _ in 0..100 {
            pause_after(&mut policy, 0);
            pause_after(&mut policy, 2);
        }
    }

    #[test]
    fn a_service_that_refuses_its_settings_is_not_tried_again() {
        let mut policy = RestartPolicy::new();
        assert_eq!(policy.after_death(Duration::ZERO, Some(2)), Verdict::Misconfigured);
    }
}
