//! Brake pressure and the torque at each wheel.

use super::WheelInput;
use super::fit::WheelFit;
use super::tyre::ANTI_LOCK_MPS;

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

/// Whether a wheel that stands is held until there is throttle, as hill-hold does and as programs
/// expect of CARLA's cars. A push faster than a wheel may lock lets it roll.
pub(super) fn holds(throttle: f32, spin_radps: f32, forward_mps: f32) -> bool {
    throttle <= 0.0 && spin_radps == 0.0 && forward_mps.abs() < ANTI_LOCK_MPS
}

/// The brake of one wheel; the hand brake may lock it.
pub(super) fn wheel(wheel: &WheelFit, pressure: f32, hand_brake: bool) -> WheelBrake {
    let pedal_nm = wheel.physics.brake_nm_max * pressure;
    if hand_brake && wheel.physics.hand_brake_nm_max > 0.0 {
        WheelBrake { torque_nm: pedal_nm + wheel.physics.hand_brake_nm_max, anti_lock: false }
    } else {
        WheelBrake { torque_nm: pedal_nm, anti_lock: true }
    }
}

/// Spin of a wheel in the air after one substep.
pub(super) fn free_spin(spin_radps: f32, brake_nm: f32, input: &WheelInput) -> f32 {
    let gain = input.dt_secs / input.inertia_kgm2;
    // A wheel in the air would otherwise race to absurd speed within one jump.
    let driven = (spin_radps + input.drive_nm * gain).clamp(-300.0, 300.0);
    let resisted_nm = brake_nm + input.wheel.physics.damping_rate * driven.abs();
    driven - driven.signum() * (resisted_nm * gain).min(driven.abs())
}
