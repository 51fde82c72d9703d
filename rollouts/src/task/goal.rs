//! What counts as having arrived.

use schemas::Error;
use serde::Deserialize;

use super::within;

/// A goal counts as reached from here; CoRL 2017's benchmark.
const WITHIN_M: f32 = 2.0;

/// How an agent has to be at its goal.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GoalRule {
    /// The box centre is nearer than this.
    #[serde(default = "usual_m")]
    pub within_m: f32,
    /// It is no faster, forwards or backwards.
    pub speed_mps_max: Option<f32>,
    /// It is turned no more from the direction in which the way ends, to either side.
    pub turned_degrees_max: Option<f32>,
}

impl Default for GoalRule {
    fn default() -> Self {
        Self { within_m: usual_m(), speed_mps_max: None, turned_degrees_max: None }
    }
}

fn usual_m() -> f32 {
    WITHIN_M
}

impl GoalRule {
    pub(super) fn check(&self) -> Result<(), Error> {
        within("goal.within_m", self.within_m, 0.1, 50.0)?;
        within("goal.speed_mps_max", self.speed_mps_max.unwrap_or(1.0), 0.01, 60.0)?;
        within("goal.turned_degrees_max", self.turned_degrees_max.unwrap_or(1.0), 0.1, 180.0)
    }

    /// Whether an agent has arrived.
    ///
    /// - **Domain:** distance from the goal, speed, and cosine of the turn from the way's end.
    pub(crate) fn holds(&self, away_m: f32, speed_mps: f32, turned_cos: f32) -> bool {
        let turned = |most: f32| turned_cos >= nalgebra::ComplexField::cos(most.to_radians());
        away_m < self.within_m
            && self.speed_mps_max.is_none_or(|most| speed_mps.abs() <= most)
            && self.turned_degrees_max.is_none_or(turned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_too_fast_or_turned_has_not_arrived() {
        let usual = GoalRule::default();
        assert!(usual.holds(1.9, 20.0, -1.0) && !usual.holds(2.0, 0.0, 1.0));
        let strict = GoalRule { speed_mps_max: Some(0.3), turned_degrees_max: Some(10.0), ..usual };
        assert!(strict.holds(1.0, -0.2, 0.99));
        assert!(!strict.holds(1.0, -0.4, 0.99) && !strict.holds(1.0, 0.2, 0.98));
    }
}
