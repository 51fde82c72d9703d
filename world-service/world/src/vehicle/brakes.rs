//! Brake pressure and the torque at each wheel.

use super::WheelInput;
use super::fit::{Fit, WheelFit};
use super::stability::Share;
use super::suspension::Footings;
use super::tyre::{self, ANTI_LOCK_MPS};

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
    /// Force along the ground that anti-lock keeps to; endless for all that the road bears.
    pub low_n: f32,
    /// How much less than the road bears it keeps to.
    pub less_n: f32,
}

impl WheelBrake {
    /// Adds what stability control wants.
    pub(super) fn take(&mut self, wheel: &WheelFit, share: &Share) {
        if share.more_n > 0.0 {
            let more_nm = share.more_n * wheel.physics.radius_m;
            self.torque_nm =
                (self.torque_nm + more_nm).min(wheel.physics.brake_nm_max.max(self.torque_nm));
        }
        self.less_n = share.less_n;
    }
}

/// What the rear wheel with less grip bears: anti-lock brakes both wheels of a rear axle alike, so
/// that a road with two sides turns the vehicle less (select low).
pub(super) fn low_n(fit: &Fit, footings: &Footings, index: usize, grip: f32) -> f32 {
    let Some(wheel) = fit.wheels.get(index).filter(|wheel| !wheel.is_front) else {
        return f32::INFINITY;
    };
    let Some(partner) = wheel.partner else { return f32::INFINITY };
    let bears_n = |index: usize| {
        let (wheel, footing) = (fit.wheels.get(index)?, footings.get(index)?.as_ref()?);
        let friction = wheel.physics.tyre_friction * footing.surface.friction * grip;
        Some(tyre::friction_of(footing.load_n, wheel.load_n, friction))
    };
    bears_n(index).unwrap_or(0.0).min(bears_n(partner).unwrap_or(0.0))
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
pub(super) fn wheel(
    wheel: &WheelFit,
    (pressure, hand_brake): (f32, bool),
    anti_lock: bool,
) -> WheelBrake {
    let pulled = hand_brake && wheel.physics.hand_brake_nm_max > 0.0;
    let hand_nm = if pulled { wheel.physics.hand_brake_nm_max } else { 0.0 };
    WheelBrake {
        torque_nm: wheel.physics.brake_nm_max * pressure + hand_nm,
        anti_lock: anti_lock && !pulled,
        low_n: f32::INFINITY,
        less_n: 0.0,
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
