//! When a sensor measures.

use serde::{Deserialize, Serialize};

/// Sums of time steps are off by less than this, and no step is as short.
const TOLERANCE_SECS: f64 = 1.0e-6;

/// At least `period_secs` of simulated time from one measurement to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pace {
    /// CARLA's `sensor_tick`; 0 is every tick.
    period_secs: f64,
    /// Of the last measurement.
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
        let due = self
            .last_secs
            .is_none_or(|last_secs| now_secs - last_secs >= self.period_secs - TOLERANCE_SECS);
        if due {
            self.last_secs = Some(now_secs);
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
            [(0.0, 0.05, 1), (0.05, 0.05, 1), (0.1, 0.05, 2), (0.12, 0.05, 3), (0.3, 0.1, 3)]
        {
            let ticks = due_ticks(period_secs, dt_secs);
            let expected: Vec<u32> = (1..=1_000).step_by(apart).collect();
            assert_eq!(ticks, expected, "every {period_secs} s at {dt_secs} s");
        }
    }
}
