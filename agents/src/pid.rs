//! The controllers of CARLA's local planner: speed to pedals, direction of a point to the wheel.
//!
//! **Source:** gains, limits and the memory of ten samples are those of CARLA's `LocalPlanner`.

use std::collections::VecDeque;

use nalgebra::RealField;
use schemas::Vec3;
use serde::{Deserialize, Serialize};

/// Samples that the integral part remembers.
const MEMORY: usize = 10;
const THROTTLE_MAX: f32 = 0.75;
const BRAKE_MAX: f32 = 0.3;
const STEER_MAX: f32 = 0.8;
/// Fastest change of the wheel, per second.
const STEER_PER_SEC: f32 = 2.0;

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

    /// Throttle and brake for an error in metres per second.
    pub(crate) fn pedals(&mut self, error_mps: f32, dt_secs: f32) -> (f32, f32) {
        // The gains are for kilometres per hour.
        let effort = self.0.run([1.5, 0.05, 0.2], error_mps * 3.6, dt_secs);
        if effort >= 0.0 {
            (effort.min(THROTTLE_MAX), 0.0)
        } else {
            (0.0, (-effort).min(BRAKE_MAX))
        }
    }
}

/// Steering.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Lateral {
    pid: Pid,
    steer: f32,
}

impl Lateral {
    pub(crate) fn is_finite(&self) -> bool {
        self.steer.is_finite() && self.pid.errors.iter().all(|error| error.is_finite())
    }

    /// Steer, positive left, towards a point seen from a vehicle that looks along `forward`.
    pub(crate) fn steer(&mut self, forward: &Vec3, to_point: &Vec3, dt_secs: f32) -> f32 {
        let cross = forward.x * to_point.y - forward.y * to_point.x;
        let dot = forward.x * to_point.x + forward.y * to_point.y;
        let error_rad = RealField::atan2(cross, dot);
        let wanted = self.pid.run([1.95, 0.05, 0.2], error_rad, dt_secs);
        let step = STEER_PER_SEC * dt_secs;
        self.steer = wanted.max(self.steer - step).min(self.steer + step);
        self.steer = self.steer.clamp(-STEER_MAX, STEER_MAX);
        self.steer
    }

    /// The last steer.
    pub(crate) fn held(&self) -> f32 {
        self.steer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_car_gets_at_most_three_quarters_of_throttle_and_a_fast_one_little_brake() {
        let mut control = Longitudinal::default();
        assert_eq!(control.pedals(5.0, 0.05), (THROTTLE_MAX, 0.0));
        assert_eq!(control.pedals(-5.0, 0.05), (0.0, BRAKE_MAX));
    }

    #[test]
    fn the_wheel_turns_to_the_side_of_the_point_and_not_at_once() {
        let mut control = Lateral::default();
        let left = control.steer(&Vec3::x(), &Vec3::new(5.0, 5.0, 0.0), 0.05);
        assert!((left - 0.1).abs() < 1.0e-6, "{left}");
        for _ in 0..50 {
            control.steer(&Vec3::x(), &Vec3::new(5.0, -5.0, 0.0), 0.05);
        }
        assert_eq!(control.held(), -STEER_MAX);
    }
}
