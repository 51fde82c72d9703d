//! When a sensor measures.

use serde::{Deserialize, Serialize};

/// Sums of time steps are off by less than this, and no step is as short.
const TOLERANCE_SECS: f64 = 1.0e-6;

/// One measurement in every `period_secs` of simulated time: what one is late by, as ticks fall
/// where they do, the next one comes earlier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pace {
    /// CARLA's `sensor_tick`; 0 is every tick.
    period_secs: f64,
    /// When the last measurement was due.
    last_secs: Option<f64>,
}

impl Pace {
    pub(super) fn new(period_secs: f64) -> Self {
        Self { period_secs, last_secs: None }
    }

    /// Whether it differs from `fresh` by its last measurement only.
    pub(super) fn is_used(&self, fresh: &Self) -> bool {
        self.period_secs == fresh.period_secs
    }

    /// Whether to measure at this time; if so it counts as done.
    pub(super) fn take(&mut self, now_secs: f64) -> bool {
        let due_secs = self.last_secs.map_or(now_secs, |last_secs| last_secs + self.period_secs);
        let late_secs = now_secs - due_secs;
        let due = late_secs >= -TOLERANCE_SECS;
        if due {
            // Who missed a whole period begins anew.
            let is_late = late_secs > TOLERANCE_SECS && late_secs < self.period_secs;
            self.last_secs = Some(if is_late { due_secs } else { now_secs });
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due_ticks(period_secs: f64, dt_secs: f64) -> Vec<u32> {
        let mut pace = Pace::new(period_secs);
        (1..=1_000).filter(|&tick| pace.take(f64::from(tick) * dt_secs)).collect()
    }

    #[test]
    fn measurements_are_exactly_as_many_ticks_apart_as_the_period_needs() {
        for (period_secs, dt_secs, apart) in
            [(0.0, 0.05, 1), (0.05, 0.05, 1), (0.1, 0.05, 2), (0.3, 0.1, 3), (0.03, 0.05, 1)]
        {
            let ticks = due_ticks(period_secs, dt_secs);
            let expected: Vec<u32> = (1..=1_000).step_by(apart).collect();
            assert_eq!(ticks, expected, "every {period_secs} s at {dt_secs} s");
        }
    }

    #[test]
    fn periods_that_are_no_number_of_ticks_come_as_often_as_they_say() {
        assert_eq!(due_ticks(0.12, 0.05)[..7], [1, 4, 6, 9, 11, 13, 16]);
        for (period_secs, dt_secs) in [(0.12, 0.05), (0.04, 1.0 / 60.0), (0.05, 1.0 / 30.0)] {
            let ticks = due_ticks(period_secs, dt_secs);
            let expected = (999.0 * dt_secs / period_secs) as usize + 1;
            assert!(ticks.len().abs_diff(expected) <= 1, "{} of {expected}", ticks.len());
            let apart = ticks.windows(2).map(|pair| f64::from(pair[1] - pair[0]) * dt_secs);
            let off_secs = apart.map(|secs| (secs - period_secs).abs()).fold(0.0, f64::max);
            assert!(off_secs < dt_secs, "{off_secs} s off {period_secs} s");
        }
    }

    #[test]
    fn a_step_that_is_a_little_short_shifts_nothing() {
        let ticks = due_ticks(0.1, f64::from(0.02_f32));
        let expected: Vec<u32> = (1..=1_000).step_by(5).collect();
        assert_eq!(ticks, expected);
    }

    #[test]
    fn nothing_is_made_up_for_after_a_pause() {
        let mut pace = Pace::new(0.1);
        assert!(pace.take(0.05));
        assert!(pace.take(5.02));
        assert!(!pace.take(5.07));
        assert!(pace.take(5.12));
    }
}
