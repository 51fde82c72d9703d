//! Brake pressure and the torque at each wheel.

use super::spec::is_front;
use super::{VehicleSpec, WheelInput};

/// Share of full pressure that builds up per second: 0.16 s from none to full.
const BUILD_UP_PER_SEC: f32 = 6.25;
/// Share of full pressure that is released per second.
const RELEASE_PER_SEC: f32 = 12.0;

/// What brakes one wheel.
#[derive(Clone, Copy, Debug)]
pub(super) struct WheelBrake {
    /// Highest torque against the rotation.
    pub torque_nm: f32,
    /// Whether the wheel is kept from locking.
    pub anti_lock: bool,
}

/// Pressure after `dt_secs` towards what the pedal asks.
pub(super) fn pressure(present: f32, pedal: f32, dt_secs: f32) -> f32 {
    present + (pedal - present).clamp(-RELEASE_PER_SEC * dt_secs, BUILD_UP_PER_SEC * dt_secs)
}

/// The brake of one wheel; the hand brake acts on the rear and may lock it.
pub(super) fn wheel(
    spec: &VehicleSpec,
    wheel: usize,
    pressure: f32,
    hand_brake: bool,
) -> WheelBrake {
    let front = is_front(wheel);
    let share = if front { spec.brake_front_share } else { 1.0 - spec.brake_front_share };
    let pedal_nm = spec.brake_nm * pressure * share / 2.0;
    if hand_brake && !front {
        WheelBrake { torque_nm: pedal_nm + spec.hand_brake_nm, anti_lock: false }
    } else {
        WheelBrake { torque_nm: pedal_nm, anti_lock: true }
    }
}

/// Spin of a wheel in the air after one substep.
pub(super) fn free_spin(spin_radps: f32, drive_nm: f32, brake_nm: f32, input: &WheelInput) -> f32 {
    let gain = input.dt_secs / input.inertia_kgm2;
    // A wheel in the air would otherwise race to absurd speed within one jump.
    let driven = (spin_radps + drive_nm * gain).clamp(-300.0, 300.0);
    driven - driven.signum() * (brake_nm * gain).min(driven.abs())
}
