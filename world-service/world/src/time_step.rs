//! How long a tick is and how it is cut.

use schemas::{Error, ErrorCode, limits};
use serde::{Deserialize, Serialize};

use crate::check;

/// Tyres and springs are stable up to this step, so a client's coarser wish is cut further.
const STABLE_SECS: f64 = 0.01;

/// The length of a tick and CARLA's limits of its physics steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TimeStep {
    pub dt_secs: f64,
    /// Longest physics step.
    pub substep_secs_max: f64,
    /// Most physics steps in one tick.
    pub substeps_max: u32,
}

impl TimeStep {
    /// With CARLA's default substeps.
    ///
    /// # Errors
    /// `InvalidArgument` for a length outside of the limits.
    pub(crate) fn new(dt_secs: f64) -> Result<Self, Error> {
        Self { dt_secs, substep_secs_max: 0.01, substeps_max: 10 }.checked()
    }

    /// # Errors
    /// `InvalidArgument` for a length or count outside of the limits.
    pub(crate) fn checked(self) -> Result<Self, Error> {
        check::dt(self.dt_secs)?;
        let steps = 1..=limits::SUBSTEPS_MAX;
        if !steps.contains(&self.substeps_max) {
            return Err(Error::new(ErrorCode::InvalidArgument, "the substeps are out of range")
                .wanted(format!("1 to {}", limits::SUBSTEPS_MAX))
                .found(self.substeps_max));
        }
        let lengths = limits::DT_SECS_MIN / f64::from(limits::SUBSTEPS_MAX)..=1.0;
        if !lengths.contains(&self.substep_secs_max) {
            return Err(Error::new(ErrorCode::InvalidArgument, "the substep is out of range")
                .wanted(format!("{} to {} s", lengths.start(), lengths.end()))
                .found(format!("{} s", self.substep_secs_max)));
        }
        Ok(self)
    }

    /// How many substeps make a tick of `dt_secs`, and their length.
    ///
    /// - **Source:** CARLA's rule, the fewest steps within the longest length but no more than the
    ///   limit; then no fewer than are stable.
    pub(crate) fn substeps(&self, dt_secs: f64) -> (u32, f32) {
        // The small term keeps 0.05 s at five substeps although 0.05 / 0.01 rounds to just above 5.
        let fewest = |longest_secs: f64| (dt_secs / longest_secs - 1.0e-6).ceil().max(1.0);
        let wished = fewest(self.substep_secs_max).min(f64::from(self.substeps_max));
        let count = wished.max(fewest(STABLE_SECS));
        (count as u32, (dt_secs / count) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(dt_secs: f64, substep_secs_max: f64, substeps_max: u32) -> u32 {
        TimeStep { dt_secs, substep_secs_max, substeps_max }.substeps(dt_secs).0
    }

    #[test]
    fn a_tick_is_cut_into_the_fewest_steps_that_are_short_enough() {
        assert_eq!(cut(0.05, 0.01, 10), 5);
        assert_eq!(cut(0.05, 0.004, 16), 13);
        assert_eq!(cut(0.001, 0.01, 10), 1);
        assert_eq!(cut(0.05, 0.001, 10), 10, "no more than the limit");
    }

    #[test]
    fn steps_too_coarse_to_be_stable_are_cut_further() {
        assert_eq!(cut(0.1, 0.05, 1), 10);
        assert_eq!(cut(0.033, 0.033, 16), 4);
    }

    #[test]
    fn limits_outside_of_their_domain_are_refused() {
        let step = TimeStep::new(0.05).unwrap();
        for wrong in [
            TimeStep { substeps_max: 0, ..step },
            TimeStep { substeps_max: 101, ..step },
            TimeStep { substep_secs_max: 0.0, ..step },
            TimeStep { substep_secs_max: f64::NAN, ..step },
            TimeStep { dt_secs: 0.2, ..step },
        ] {
            assert!(wrong.checked().is_err(), "{wrong:?}");
        }
    }
}
