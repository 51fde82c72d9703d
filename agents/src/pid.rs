//! The controller of CARLA's local planner: speed to pedals.
//!
//! **Source:** gains, limits and the memory of ten samples are those of CARLA's `LocalPlanner`.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::speed::{BRAKE_MPS2, THROTTLE_PER_MPS2};

/// Samples that the integral part remembers.
const MEMORY: usize = 10;
const THROTTLE_MAX: f32 = 0.75;
const BRAKE_MAX: f32 = 0.3;

/// A controller with a short memory.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Pid {
    errors: VecDeque<f32>,
}

impl Pid {
    fn run(&mut self, [p, i, d]: [f32; 3], error: f32, dt_secs: f32) -> f32 {
        let before = self.errors.back().copied();
        if self.errors.len() == MEMORY {
            self.errors.pop_front();
        }
        self.errors.push_back(error);
        let slope = before.map_or(0.0, |before| (error - before) / dt_secs);
        let sum: f32 = self.errors.iter().sum::<f32>() * dt_secs;
        (p * error + i * sum + d * slope).clamp(-1.0, 1.0)
    }
}

/// Speed control.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Longitudinal(Pid);

impl Longitudinal {
    pub(crate) fn is_finite(&self) -> bool {
        self.0.errors.iter().all(|error| error.is_finite())
    }

    /// Throttle and brake for an error in metres per second, on a hill that takes so much of the
    /// acceleration.
    ///
    /// CARLA's know of no hills: theirs stand on steep ones.
    pub(crate) fn pedals(&mut self, error_mps: f32, hill_mps2: f32, dt_secs: f32) -> (f32, f32) {
        // The gains are for kilometres per hour.
        let effort = self.0.run([1.5, 0.05, 0.2], error_mps * 3.6, dt_secs);
        if effort >= 0.0 {
            let climbing = hill_mps2.max(0.0) * THROTTLE_PER_MPS2;
            ((effort.min(THROTTLE_MAX) + climbing).min(1.0), 0.0)
        } else {
            let falling = (-hill_mps2).max(0.0) / BRAKE_MPS2;
            (0.0, ((-effort).min(BRAKE_MAX) + falling).min(1.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_car_gets_at_most_three_quarters_of_throttle_and_a_fast_one_little_brake() {
        let mut control = Longitudinal::default();
        assert_eq!(control.pedals(5.0, 0.0, 0.05), (THROTTLE_MAX, 0.0));
        assert_eq!(control.pedals(-5.0, 0.0, 0.05), (0.0, BRAKE_MAX));
    }

    #[test]
    fn a_climb_gets_throttle_for_gravity_and_a_way_down_brake() {
        let pedals =
            |error_mps, hill_mps2| Longitudinal::default().pedals(error_mps, hill_mps2, 0.05);
        assert_eq!(pedals(5.0, 1.0), (THROTTLE_MAX + THROTTLE_PER_MPS2, 0.0));
        assert_eq!(pedals(5.0, 5.0), (1.0, 0.0));
        assert_eq!(pedals(5.0, -3.0), (THROTTLE_MAX, 0.0));
        assert_eq!(pedals(-5.0, 3.0), (0.0, BRAKE_MAX));
        assert_eq!(pedals(-5.0, -3.0), (0.0, BRAKE_MAX + 3.0 / BRAKE_MPS2));
    }
}
