//! Tyre forces under combined slip, together with the spin of the wheel.
//!
//! The contact patch is a bristle: it deflects with the slip velocity and relaxes with rolling
//! (Pacejka, *Tyre and Vehicle Dynamics*, 3rd ed., chapters 3 and 7). At speed that is the usual
//! slip curve with a relaxation length; at rest it is a spring, so a braked vehicle on a slope
//! stands still instead of creeping. Force over deflection follows the brush model up to the
//! friction limit and falls to sliding friction beyond it; near standstill it is linear up to the
//! limit instead, so that a tyre which slid to a stop does not push the vehicle back.
//!
//! Spin and deflection are solved together and implicitly: a wheel is so light that at 100 km/h
//! an explicit step would have to be shorter than a millisecond.

use serde::{Deserialize, Serialize};

use super::Wheel;
use super::brakes::WheelBrake;

/// Rolling distance over which a deflection settles.
const LONGITUDINAL_RELAXATION_M: f32 = 0.25;
const LATERAL_RELAXATION_M: f32 = 0.4;
/// Normalised deflection at which the whole patch slides and friction is highest.
const PEAK: f32 = 3.0;
/// Highest normalised deflection; the patch slides without deflecting further.
const SLIDING: f32 = 5.0;
/// Sliding friction over the highest friction.
const SLIDING_SHARE: f32 = 0.9;
/// Highest friction sideways over that along the wheel: road tests of one car corner at 0.85 to
/// 0.95 of the deceleration with which they brake.
const LATERAL_SHARE: f32 = 0.92;
/// Loss of friction when the load doubles.
const LOAD_SENSITIVITY: f32 = 0.08;
/// Rolling speed from which the brush model holds entirely.
const BRUSH_MPS: f32 = 3.0;
/// Damping of the bristle at rest, as seconds of slip velocity added to the deflection.
const DAMPING_SECS: f32 = 0.04;
/// Resistance of rolling over load.
const ROLLING_RESISTANCE: f32 = 0.011;
/// Slip at which anti-lock brakes and traction control hold a usual wheel at most...
const CONTROLLED_SLIP: f32 = 0.11;
/// ...which is one of this longitudinal stiffness; a softer one slips more for the same force...
const USUAL_STIFFNESS: f32 = 22.0;
/// ...and the most of it over that of the highest friction, which a slippery road or a stiff tyre
/// brings sooner.
const CONTROLLED_SHARE: f32 = 0.85;
/// Below this speed anti-lock lets the wheel lock, so that the vehicle comes to a stand.
pub(super) const ANTI_LOCK_MPS: f32 = 1.5;
/// Speed below which traction control allows the slip velocity of this speed.
const LAUNCH_MPS: f32 = 4.5;

/// Deflection of the contact patch in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tyre {
    pub forward_m: f32,
    pub left_m: f32,
}

/// What one tyre meets in one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct TyreInput {
    /// Velocity of the chassis at the contact point along the wheel's heading and to its left.
    pub forward_mps: f32,
    pub left_mps: f32,
    pub load_n: f32,
    /// Load at which the friction coefficient holds.
    pub nominal_load_n: f32,
    pub friction: f32,
    /// Slip stiffness to the side over load, per radian.
    pub lateral_stiffness: f32,
    /// Load over the nominal one beyond which lateral stiffness stays as it is.
    pub lateral_load_max: f32,
    /// Slip stiffness along the wheel over load.
    pub longitudinal_stiffness: f32,
    pub radius_m: f32,
    /// Resistance of the bearing.
    pub damping_nms: f32,
    /// Damping of the standing tyre over the usual one.
    pub damping_share: f32,
    pub inertia_kgm2: f32,
    pub drive_nm: f32,
    pub brake: WheelBrake,
    pub traction_control: bool,
    pub dt_secs: f32,
}

/// Force of the road on the tyre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TyreForce {
    pub forward_n: f32,
    pub left_n: f32,
}

/// Advances spin and deflection and returns the force on the chassis.
#[inline(always)]
pub(super) fn advance(wheel: &mut Wheel, input: &TyreInput) -> TyreForce {
    let contact = Contact::new(input, wheel.spin_radps);
    // The second pass uses the stiffness at the deflection that the first one found.
    let first = contact.solve(wheel, contact.softening(wheel.tyre), input);
    let solved = contact.solve(wheel, contact.softening(first.tyre), input);
    let force = contact.force(&solved, input);
    *wheel = solved;
    wheel.tyre = contact.slide(wheel.tyre);
    force
}

/// Highest force of a tyre in its plane: less than proportional to the load.
#[inline(always)]
pub(super) fn friction_n(input: &TyreInput) -> f32 {
    friction_of(input.load_n, input.nominal_load_n, input.friction)
}

/// The same of a load, beside the one at which the coefficient holds.
#[inline(always)]
pub(super) fn friction_of(load_n: f32, nominal_load_n: f32, friction: f32) -> f32 {
    let overload = load_n / nominal_load_n - 1.0;
    let sensitivity = (1.0 - LOAD_SENSITIVITY * overload).clamp(0.7, 1.1);
    friction * sensitivity * load_n
}

/// Constants of one contact patch for one substep.
struct Contact {
    /// Deflection stiffness in newtons per metre.
    forward_n_per_m: f32,
    left_n_per_m: f32,
    friction_n: f32,
    /// How much of an old deflection is left after the substep.
    forward_keep: f32,
    left_keep: f32,
    damping_secs: f32,
    /// 0 at a standstill, 1 where the brush model holds.
    brush: f32,
}

impl Contact {
    #[inline(always)]
    fn new(input: &TyreInput, spin_radps: f32) -> Self {
        let stiffening_n = input.load_n.min(input.lateral_load_max * input.nominal_load_n);
        let rolling_mps = input.forward_mps.abs().max((spin_radps * input.radius_m).abs());
        let brush = (rolling_mps / BRUSH_MPS).min(1.0);
        let keep = |relaxation_m: f32| 1.0 / (1.0 + input.dt_secs * rolling_mps / relaxation_m);
        Self {
            forward_n_per_m: input.longitudinal_stiffness * input.load_n
                / LONGITUDINAL_RELAXATION_M,
            left_n_per_m: input.lateral_stiffness * stiffening_n / LATERAL_RELAXATION_M,
            friction_n: friction_n(input),
            forward_keep: keep(LONGITUDINAL_RELAXATION_M),
            left_keep: keep(LATERAL_RELAXATION_M),
            damping_secs: DAMPING_SECS * input.damping_share * (1.0 - brush),
            brush,
        }
    }

    /// Normalised deflection: what the linear force would be over the highest friction.
    #[inline(always)]
    fn normalised(&self, tyre: Tyre) -> f32 {
        let forward = self.forward_n_per_m * tyre.forward_m;
        let left = self.left_n_per_m * tyre.left_m / LATERAL_SHARE;
        (forward * forward + left * left).sqrt() / self.friction_n.max(1.0e-3)
    }

    /// Force at this deflection over the linear one.
    #[inline(always)]
    fn softening(&self, tyre: Tyre) -> f32 {
        softening(self.normalised(tyre), self.brush)
    }

    /// The wheel after the substep, with a force that grows linearly by `softening`.
    #[inline(always)]
    fn solve(&self, wheel: &Wheel, softening: f32, input: &TyreInput) -> Wheel {
        let dt = input.dt_secs;
        let Tyre { forward_m, left_m } = wheel.tyre;
        // force = stiffness · (rest + gain · (spin · radius − forward))
        let stiffness = self.forward_n_per_m * softening;
        let rest_m = forward_m * self.forward_keep;
        let gain_secs = dt * self.forward_keep + self.damping_secs;
        let radius = input.radius_m;
        let resistance = input.inertia_kgm2 / dt + radius * radius * stiffness * gain_secs;
        let torque_nm = input.inertia_kgm2 / dt * wheel.spin_radps + input.drive_nm
            - radius * stiffness * (rest_m - gain_secs * input.forward_mps);
        let free_radps = torque_nm / resistance;
        let spin_radps = brake(traction(free_radps, input), resistance, input);

        let slip_mps = spin_radps * radius - input.forward_mps;
        Wheel {
            spin_radps,
            contact: wheel.contact,
            tyre: Tyre {
                forward_m: (forward_m + dt * slip_mps) * self.forward_keep,
                left_m: (left_m - dt * input.left_mps) * self.left_keep,
            },
        }
    }

    #[inline(always)]
    fn force(&self, wheel: &Wheel, input: &TyreInput) -> TyreForce {
        let slip_mps = wheel.spin_radps * input.radius_m - input.forward_mps;
        let deflected = Tyre {
            forward_m: wheel.tyre.forward_m + self.damping_secs * slip_mps,
            left_m: wheel.tyre.left_m - self.damping_secs * input.left_mps,
        };
        let share = self.softening(deflected);
        TyreForce {
            forward_n: self.forward_n_per_m * deflected.forward_m * share,
            left_n: self.left_n_per_m * deflected.left_m * share,
        }
    }

    /// Lets a patch that slides keep no more deflection than sliding needs.
    #[inline(always)]
    fn slide(&self, tyre: Tyre) -> Tyre {
        let sliding = 1.0 + (SLIDING - 1.0) * self.brush;
        let scale = sliding / self.normalised(tyre).max(sliding);
        Tyre { forward_m: tyre.forward_m * scale, left_m: tyre.left_m * scale }
    }
}

/// Force over friction limit at a normalised deflection, divided by that deflection.
#[inline(always)]
fn softening(deflection: f32, brush: f32) -> f32 {
    let linear = 1.0 / deflection.max(1.0);
    linear + (brush_softening(deflection) - linear) * brush
}

#[inline(always)]
fn brush_softening(deflection: f32) -> f32 {
    if deflection < PEAK {
        // Parabolic pressure over the patch.
        1.0 - deflection / 3.0 + deflection * deflection / 27.0
    } else {
        let beyond = ((deflection - PEAK) / (SLIDING - PEAK)).min(1.0);
        (1.0 - (1.0 - SLIDING_SHARE) * beyond) / deflection
    }
}

/// Slip at which a wheel is held, near the peak of friction.
#[inline(always)]
fn controlled_slip(input: &TyreInput) -> f32 {
    let peak = PEAK * input.friction / input.longitudinal_stiffness;
    let softness = (USUAL_STIFFNESS / input.longitudinal_stiffness).max(1.0);
    (CONTROLLED_SLIP * softness).min(CONTROLLED_SHARE * peak).min(1.0)
}

/// Holds a driven wheel at the slip of the highest friction.
#[inline(always)]
fn traction(free_radps: f32, input: &TyreInput) -> f32 {
    if !input.traction_control || input.drive_nm == 0.0 {
        return free_radps;
    }
    let direction = input.drive_nm.signum();
    let along_mps = (input.forward_mps * direction).max(0.0);
    let limit_mps = along_mps + controlled_slip(input) * along_mps.max(LAUNCH_MPS);
    (free_radps * direction).min(limit_mps / input.radius_m) * direction
}

/// Spin after brake and rolling resistance, which can stop the wheel but not turn it.
#[inline(always)]
fn brake(free_radps: f32, resistance: f32, input: &TyreInput) -> f32 {
    let friction_nm = brake_nm(input)
        + ROLLING_RESISTANCE * input.load_n * input.radius_m
        + input.damping_nms * free_radps.abs();
    let slower_by = (friction_nm / resistance).min(free_radps.abs());
    let spin_radps = free_radps - free_radps.signum() * slower_by;
    let rolling_mps = input.forward_mps.abs();
    if !input.brake.anti_lock || rolling_mps < ANTI_LOCK_MPS {
        return spin_radps;
    }
    let direction = input.forward_mps.signum();
    let slowest_radps = rolling_mps * (1.0 - controlled_slip(input)) / input.radius_m;
    let wanted_radps = slowest_radps.min((free_radps * direction).max(0.0));
    (spin_radps * direction).max(wanted_radps) * direction
}

/// Torque of the brake, as far as anti-lock lets it.
#[inline(always)]
fn brake_nm(input: &TyreInput) -> f32 {
    let brake = &input.brake;
    if !brake.anti_lock || input.forward_mps.abs() < ANTI_LOCK_MPS {
        return brake.torque_nm;
    }
    let bears_n = (friction_n(input) - brake.less_n).max(0.0);
    let low_n = if brake.less_n > 0.0 { bears_n.min(brake.low_n) } else { brake.low_n };
    brake.torque_nm.min(low_n * input.radius_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOOT: WheelBrake =
        WheelBrake { torque_nm: 0.0, anti_lock: false, low_n: f32::INFINITY, less_n: 0.0 };

    fn input() -> TyreInput {
        TyreInput {
            forward_mps: 0.0,
            left_mps: 0.0,
            load_n: 4_000.0,
            nominal_load_n: 4_000.0,
            friction: 1.0,
            lateral_stiffness: 18.0,
            lateral_load_max: 2.0,
            longitudinal_stiffness: 22.0,
            damping_nms: 0.0,
            damping_share: 1.0,
            radius_m: 0.33,
            inertia_kgm2: 1.3,
            drive_nm: 0.0,
            brake: WheelBrake { torque_nm: 0.0, ..FOOT },
            traction_control: false,
            dt_secs: 0.01,
        }
    }

    fn settled(mut wheel: Wheel, input: &TyreInput) -> (Wheel, TyreForce) {
        let mut force = TyreForce::default();
        for _ in 0..200 {
            force = advance(&mut wheel, input);
        }
        (wheel, force)
    }

    #[test]
    fn force_is_continuous_and_highest_at_the_peak() {
        let force = |deflection: f32| deflection * brush_softening(deflection);
        assert!((force(PEAK - 1.0e-4) - force(PEAK + 1.0e-4)).abs() < 1.0e-4);
        assert!((force(PEAK) - 1.0).abs() < 1.0e-6);
        assert!((force(50.0) - SLIDING_SHARE).abs() < 1.0e-6);
    }

    #[test]
    fn a_locked_wheel_pushes_against_its_sliding() {
        let brake = WheelBrake { torque_nm: 1.0e5, ..FOOT };
        let (wheel, force) = settled(
            Wheel { spin_radps: 60.0, ..Wheel::default() },
            &TyreInput { forward_mps: 20.0, left_mps: 20.0, brake, ..input() },
        );
        assert_eq!(wheel.spin_radps, 0.0);
        assert!(force.forward_n < 0.0 && force.left_n < 0.0, "{force:?}");
        assert!(force.forward_n.hypot(force.left_n) <= 4_000.0 * 1.001, "{force:?}");
    }

    #[test]
    fn anti_lock_keeps_the_wheel_rolling_near_the_highest_friction() {
        let brake = WheelBrake { torque_nm: 1.0e5, anti_lock: true, ..FOOT };
        let (wheel, force) = settled(
            Wheel { spin_radps: 60.0, ..Wheel::default() },
            &TyreInput { forward_mps: 20.0, brake, ..input() },
        );
        assert!(wheel.spin_radps * 0.33 > 17.0, "{wheel:?}");
        assert!(force.forward_n < -0.95 * 4_000.0, "{force:?}");
    }

    #[test]
    fn a_side_force_below_the_limit_grows_with_the_slip_angle() {
        let at = |left_mps: f32| {
            let wheel = Wheel { spin_radps: 20.0 / 0.33, ..Wheel::default() };
            settled(wheel, &TyreInput { forward_mps: 20.0, left_mps, ..input() }).1.left_n
        };
        assert!(at(0.4) < 0.0 && at(0.8) < at(0.4));
        // Linear range: stiffness times load times angle.
        let wanted = -18.0 * 4_000.0 * (0.1 / 20.0);
        assert!((at(0.1) / wanted - 1.0).abs() < 0.05, "{} {wanted}", at(0.1));
    }
}
