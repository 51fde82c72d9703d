//! Driving.

use schemas::limits::SPEED_MPS_MAX;
use schemas::{AckermannGains, VehicleControl as Ours};
use serde::{Deserialize, Serialize};

/// `[throttle, steer, brake, hand_brake, reverse, manual_gear_shift, gear]`; steer positive right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct VehicleControl {
    pub(crate) throttle: f32,
    pub(crate) steer: f32,
    pub(crate) brake: f32,
    pub(crate) hand_brake: bool,
    pub(crate) reverse: bool,
    pub(crate) manual_gear_shift: bool,
    pub(crate) gear: i32,
}

impl VehicleControl {
    /// In our signs; CARLA clamps what is out of range, and so do we.
    pub(crate) fn ours(self) -> Ours {
        Ours {
            throttle: within(self.throttle, 0.0, 1.0),
            steer: -within(self.steer, -1.0, 1.0),
            brake: within(self.brake, 0.0, 1.0),
            hand_brake: self.hand_brake,
            reverse: self.reverse,
            manual_gear: self.manual_gear_shift,
            gear: self.gear.clamp(-1, 127) as i8,
        }
    }
}

/// The nearest number in a range; 0 for what is none.
fn within(number: f32, min: f32, max: f32) -> f32 {
    if number.is_nan() { 0.0 } else { number.clamp(min, max) }
}

/// Beyond the lock of every vehicle, in radians.
const STEER_RAD_MAX: f32 = 1.5;
/// Beyond what any vehicle can do, in radians per second, m/s² and m/s³.
const STEER_RADPS_MAX: f32 = 100.0;
const ACCELERATION_MPS2_MAX: f32 = 1_000.0;
const JERK_MPS3_MAX: f32 = 1_000.0;

/// `[steer, steer_speed, speed, acceleration, jerk]`, radians and SI; steer positive right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct AckermannControl {
    pub(crate) steer: f32,
    pub(crate) steer_speed: f32,
    pub(crate) speed: f32,
    pub(crate) acceleration: f32,
    pub(crate) jerk: f32,
}

impl AckermannControl {
    /// In our signs. What is out of reach is as far as vehicles get, as in CARLA.
    pub(crate) fn ours(self) -> schemas::AckermannControl {
        schemas::AckermannControl {
            steer_rad: (-self.steer).clamp(-STEER_RAD_MAX, STEER_RAD_MAX),
            steer_radps: self.steer_speed.clamp(-STEER_RADPS_MAX, STEER_RADPS_MAX),
            speed_mps: self.speed.clamp(-SPEED_MPS_MAX, SPEED_MPS_MAX),
            acceleration_mps2: self
                .acceleration
                .clamp(-ACCELERATION_MPS2_MAX, ACCELERATION_MPS2_MAX),
            jerk_mps3: self.jerk.clamp(-JERK_MPS3_MAX, JERK_MPS3_MAX),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AckermannSettings {
    speed_kp: f32,
    speed_ki: f32,
    speed_kd: f32,
    accel_kp: f32,
    accel_ki: f32,
    accel_kd: f32,
}

impl AckermannSettings {
    pub(crate) fn of(gains: &AckermannGains) -> Self {
        Self {
            speed_kp: gains.speed_kp,
            speed_ki: gains.speed_ki,
            speed_kd: gains.speed_kd,
            accel_kp: gains.acceleration_kp,
            accel_ki: gains.acceleration_ki,
            accel_kd: gains.acceleration_kd,
        }
    }

    pub(crate) fn ours(self) -> AckermannGains {
        AckermannGains {
            speed_kp: self.speed_kp,
            speed_ki: self.speed_ki,
            speed_kd: self.speed_kd,
            acceleration_kp: self.accel_kp,
            acceleration_ki: self.accel_ki,
            acceleration_kd: self.accel_kd,
        }
    }
}

/// An object with one field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LightFlags {
    pub(crate) flags: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_is_read_from_the_measured_bytes() {
        let bytes =
            b"\x97\xca\x3f\x00\x00\x00\xca\xbe\x80\x00\x00\xca\x00\x00\x00\x00\xc2\xc2\xc2\xff";
        let control: VehicleControl = rmp_serde::from_slice(bytes).unwrap();
        assert_eq!((control.throttle, control.steer, control.gear), (0.5, -0.25, -1));
        assert_eq!(control.ours().steer, 0.25);
        let wild = VehicleControl { throttle: 7.0, brake: f32::NAN, ..Default::default() }.ours();
        assert_eq!((wild.throttle, wild.brake), (1.0, 0.0));
    }
}
