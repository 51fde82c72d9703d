//! From a target speed to throttle and brake.

use serde::{Deserialize, Serialize};

/// Throttle for a metre per second squared, about, and what the full brake stands for.
pub(crate) const THROTTLE_PER_MPS2: f32 = 0.12;
pub(crate) const BRAKE_MPS2: f32 = 9.0;
/// Braking from which a light that turned is run rather than obeyed.
const LIGHT_MPS2: f32 = 5.0;
/// Throttle per metre per second of speed error.
const PROPORTIONAL: f32 = 0.25;
/// Throttle per metre of accumulated error.
const INTEGRAL: f32 = 0.08;
/// Bound of the integral part: what holds a fast car against drag on a climb.
const INTEGRAL_MAX: f32 = 0.6;
/// Brake per unit of negative effort; braking is several times stronger than the throttle.
const BRAKE_SHARE: f32 = 0.5;
/// Effort between which neither pedal is touched, so that they do not alternate.
const BRAKE_FROM: f32 = -0.1;
/// Target and speed below which the vehicle is held with the brake.
const STANDSTILL_MPS: f32 = 0.1;
const HOLD_BRAKE: f32 = 0.4;

/// Whether who is so fast stops for a yellow light that is so far ahead of its front.
pub(crate) fn stops_for_yellow(speed_mps: f32, gap_m: f32) -> bool {
    gap_m > 0.0 && speed_mps * speed_mps / (2.0 * gap_m.max(0.1)) < LIGHT_MPS2
}

/// A proportional and integral controller with a bounded memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SpeedControl {
    target_mps: f32,
    integral: f32,
}

impl SpeedControl {
    pub(crate) fn new(target_mps: f32) -> Self {
        Self { target_mps, integral: 0.0 }
    }

    /// To this target with the memory of another controller of the same vehicle.
    pub(crate) fn after(self, before: &Self) -> Self {
        Self { integral: before.integral, ..self }
    }

    /// Throttle and brake, each 0 to 1, at most one of them above 0.
    pub(crate) fn pedals(&mut self, speed_mps: f32, limit_mps: f32, dt_secs: f32) -> (f32, f32) {
        let target_mps = self.target_mps.min(limit_mps);
        if target_mps < STANDSTILL_MPS && speed_mps.abs() < STANDSTILL_MPS {
            self.integral = 0.0;
            return (0.0, HOLD_BRAKE);
        }
        let error_mps = target_mps - speed_mps;
        let effort = PROPORTIONAL * error_mps + self.integral;
        // While a pedal is at its end the memory must not grow (anti-windup).
        if effort.abs() < 1.0 {
            let integral = self.integral + INTEGRAL * error_mps * dt_secs;
            self.integral = integral.clamp(-INTEGRAL_MAX, INTEGRAL_MAX);
        }
        if effort >= 0.0 {
            (effort.min(1.0), 0.0)
        } else if effort > BRAKE_FROM {
            (0.0, 0.0)
        } else {
            (0.0, ((BRAKE_FROM - effort) * BRAKE_SHARE).min(1.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_car_gets_throttle_and_a_fast_one_brake() {
        let mut control = SpeedControl::new(10.0);
        let (throttle, brake) = control.pedals(5.0, f32::INFINITY, 0.05);
        assert!(throttle > 0.5 && brake == 0.0);
        let (throttle, brake) = control.pedals(15.0, f32::INFINITY, 0.05);
        assert!(throttle == 0.0 && brake > 0.3);
    }

    #[test]
    fn a_limit_counts_when_it_is_below_the_target() {
        let (throttle, brake) = SpeedControl::new(10.0).pedals(10.0, 4.0, 0.05);
        assert!(throttle == 0.0 && brake > 0.3);
    }

    #[test]
    fn a_car_that_shall_stand_is_held() {
        assert_eq!(SpeedControl::new(0.0).pedals(0.01, 9.0, 0.05), (0.0, HOLD_BRAKE));
    }
}
