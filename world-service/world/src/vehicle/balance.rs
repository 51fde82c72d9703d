//! What a rider does for a two-wheeler: leans it into the curve, holds it upright at a stand, and
//! keeps both wheels on the ground.
//!
//! The rider's balance is a torque about the line of contact towards the lean at which gravity and
//! the curve hold each other, so that in a steady curve it is zero. It is an idealisation: a real
//! rider steers the other way first.

use nalgebra::{ComplexField, RealField};
use schemas::Vec3;

use super::fit::{Fit, GRAVITY_MPS2, WheelFit};
use super::suspension::Footings;
use super::{Chassis, Impulse};

/// Torque per radian from the wanted lean over weight times height: gravity alone needs 1.
const RETURN_SHARE: f32 = 2.2;
/// The same per radian per second.
const DAMPING_SECS: f32 = 0.45;
/// Greatest lean that a rider asks for (50°).
const LEAN_RAD_MAX: f32 = 0.87;
/// Lean from which nobody saves it (65°).
const LOST_RAD: f32 = 1.13;
/// Strongest torque over weight times height: a push beyond it throws the vehicle over.
const TORQUE_SHARE_MAX: f32 = 1.5;
/// Share of the load at rest below which a rider, or electronics, hold back drive and brake.
const FRONT_LOAD_SHARE: f32 = 0.15;
const REAR_LOAD_SHARE: f32 = 0.2;

/// How much of drive and front brake keeps both wheels down; all of it on three wheels or more.
#[derive(Clone, Copy, Debug)]
pub(super) struct PitchGuard {
    pub drive_share: f32,
    front_brake_share: f32,
}

impl PitchGuard {
    pub(super) fn brake_share(&self, wheel: &WheelFit) -> f32 {
        if wheel.is_front { self.front_brake_share } else { 1.0 }
    }
}

pub(super) fn pitch_guard(fit: &Fit, footings: &Footings) -> PitchGuard {
    let mut guard = PitchGuard { drive_share: 1.0, front_brake_share: 1.0 };
    if !fit.model.is_two_wheeler() {
        return guard;
    }
    for (wheel, footing) in fit.wheels.iter().zip(footings) {
        let load_share = footing.map_or(0.0, |footing| footing.load_n) / wheel.load_n;
        if wheel.is_front {
            guard.drive_share = (load_share / FRONT_LOAD_SHARE).min(1.0);
        } else {
            guard.front_brake_share = (load_share / REAR_LOAD_SHARE).min(1.0);
        }
    }
    guard
}

/// The rider's balance during one substep; nothing for what stands by itself, lies or flies.
pub(super) fn rider(
    fit: &Fit,
    chassis: &Chassis,
    footings: &Footings,
    road_wheel_rad: f32,
    dt_secs: f32,
) -> Impulse {
    if !fit.model.is_two_wheeler() || footings.iter().all(Option::is_none) {
        return Impulse::default();
    }
    let (forward, up) = (chassis.forward(), chassis.up());
    let Some(left) = Vec3::z().cross(&forward).try_normalize(1.0e-3) else {
        return Impulse::default();
    };
    let lean_rad = RealField::atan2(up.dot(&left), up.z);
    if lean_rad.abs() > LOST_RAD {
        return Impulse::default();
    }
    // What the steer asks and not what the yaw rate is: leaning after a slide ends in a fall.
    let along_mps = forward.dot(&chassis.linear_mps);
    let square = along_mps * along_mps;
    let curve_mps2 =
        square * road_wheel_rad / (fit.wheelbase_m + fit.understeer_rad_per_mps2 * square).max(0.1);
    let wanted_rad =
        ComplexField::atan(curve_mps2 / GRAVITY_MPS2).clamp(-LEAN_RAD_MAX, LEAN_RAD_MAX);
    // Turning about the forward axis lifts the left side: the other way than leaning left.
    let leaning_radps = -chassis.angular_radps.dot(&forward);
    let share = RETURN_SHARE * (wanted_rad - lean_rad) - DAMPING_SECS * leaning_radps;
    let weight_nm = fit.physics.mass_kg * GRAVITY_MPS2 * fit.physics.centre_of_mass_m.z;
    let torque_nm = share.clamp(-TORQUE_SHARE_MAX, TORQUE_SHARE_MAX) * weight_nm;
    Impulse { linear_ns: Vec3::zeros(), angular_nms: forward * (-torque_nm * dt_secs) }
}
