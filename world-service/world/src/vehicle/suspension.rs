//! Springs, dampers and anti-roll bars: from the ground under each wheel to its load.

use std::f32::consts::TAU;

use blueprints::VehicleModel;
use schemas::Vec3;

use super::fit::{Fit, GRAVITY_MPS2, WHEELS_MAX, WheelFit};
use super::{Chassis, Footing};
use crate::ground::{Ground, Known};

/// Compression from rest at which the bump stop begins.
const BUMP_M: f32 = 0.08;
/// Stiffness of the bump stop over the load at rest, per metre.
const BUMP_PER_M: f32 = 40.0;
/// Height above the wheel's contact point from which the ground is looked for: a kerb or a deep
/// compression must stay below, a bridge overhead above.
const LOOK_FROM_M: f32 = 0.5;
/// A wheel on ground steeper than this against the vehicle's up axis carries nothing (about 75°).
const ALIGNMENT_MIN: f32 = 0.25;

/// Natural frequency and damping ratio of the body on its springs while it lands: as stiff as a
/// substep of 10 ms can follow, so that a vehicle that is put above the road stands at once.
const LANDING_RADPS: f32 = 25.0;
const LANDING_DAMPING_RATIO: f32 = 0.8;
/// A wheel that moves slower than this against the ground has landed.
const STANDING_MPS: f32 = 0.05;

/// What each wheel stands on; `None` for wheels in the air, and beyond the last one.
pub(super) type Footings = [Option<Footing>; WHEELS_MAX];

/// Spring and damper of one wheel, made for the mass it carries.
#[derive(Clone, Debug)]
pub(crate) struct Spring {
    ride: Rates,
    landing: Rates,
    /// Extension at which it carries nothing.
    droop_m: f32,
}

/// Of a spring and its damper.
#[derive(Clone, Copy, Debug)]
struct Rates {
    stiffness_n_per_m: f32,
    damping_n_per_mps: f32,
}

impl Rates {
    /// Those that let a mass swing with this frequency and damping ratio.
    fn new(mass_kg: f32, radps: f32, damping_ratio: f32) -> Self {
        Self {
            stiffness_n_per_m: mass_kg * radps * radps,
            damping_n_per_mps: 2.0 * damping_ratio * mass_kg * radps,
        }
    }
}

impl Spring {
    /// Front a tenth softer than rear, so that the body stays level over a bump.
    pub(super) fn new(model: &VehicleModel, load_n: f32, front: bool) -> Self {
        let axle = if front { 0.95 } else { 1.05 };
        let radps = TAU * model.ride_hz * axle;
        let mass_kg = load_n / GRAVITY_MPS2;
        Self {
            ride: Rates::new(mass_kg, radps, model.damping_ratio),
            landing: Rates::new(mass_kg, LANDING_RADPS, LANDING_DAMPING_RATIO),
            droop_m: GRAVITY_MPS2 / (radps * radps),
        }
    }
}

/// What each wheel stands on, with its load.
pub(super) fn footings(
    fit: &Fit,
    chassis: &Chassis,
    (ground, known): (&Ground, &mut [Known; WHEELS_MAX]),
    landing: bool,
) -> Footings {
    let mut footings: Footings = [const { None }; WHEELS_MAX];
    for ((slot, known), wheel) in footings.iter_mut().zip(known).zip(&fit.wheels) {
        *slot = unloaded_footing(wheel, chassis, (ground, known));
    }
    let compressions = footings.each_ref().map(|at| at.as_ref().map_or(0.0, |at| at.compression_m));
    let anti_roll_n_per_m = fit.model.anti_roll_n_per_m;
    for (slot, wheel) in footings.iter_mut().zip(&fit.wheels) {
        let Some(footing) = slot else { continue };
        let across_m = wheel.partner.map_or(footing.compression_m, |index| compressions[index]);
        let twist_m = footing.compression_m - across_m;
        let spring = &wheel.spring;
        let rates = if landing { &spring.landing } else { &spring.ride };
        let carried_n = spring_and_damper_n(wheel, rates, chassis, footing);
        footing.load_n = (carried_n + anti_roll_n_per_m * twist_m).max(0.0);
        if footing.load_n <= 0.0 {
            *slot = None;
        }
    }
    footings
}

/// Whether every wheel bears on the ground and no spring is near its end.
pub(super) fn carry(fit: &Fit, footings: &Footings) -> bool {
    footings
        .iter()
        .take(fit.wheels.len())
        .all(|footing| footing.is_some_and(|footing| footing.compression_m < BUMP_M))
}

/// Whether no wheel that bears on the ground moves against it any more.
pub(super) fn stand(chassis: &Chassis, footings: &Footings) -> bool {
    footings.iter().flatten().all(|at| closing_mps(chassis, at).abs() < STANDING_MPS)
}

/// Where the wheel's axis meets the ground, taken as the plane under the wheel.
fn unloaded_footing(
    wheel: &WheelFit,
    chassis: &Chassis,
    (ground, known): (&Ground, &mut Known),
) -> Option<Footing> {
    let foot_m = chassis.world_from_point(wheel.foot_m);
    let up = chassis.up();
    let surface = ground.below_from(known, foot_m + up * LOOK_FROM_M);
    let alignment = up.dot(&surface.normal);
    if alignment < ALIGNMENT_MIN {
        return None;
    }
    let surface_m = Vec3::new(foot_m.x, foot_m.y, surface.height_m);
    let compression_m = (surface_m - foot_m).dot(&surface.normal) / alignment;
    if compression_m <= -wheel.spring.droop_m {
        return None;
    }
    let point_m = foot_m + up * compression_m;
    Some(Footing { surface, point_m, compression_m, load_n: 0.0 })
}

/// Speed of a wheel's contact point into the ground.
fn closing_mps(chassis: &Chassis, footing: &Footing) -> f32 {
    -chassis.velocity_at(footing.point_m).dot(&footing.surface.normal)
}

fn spring_and_damper_n(
    wheel: &WheelFit,
    rates: &Rates,
    chassis: &Chassis,
    footing: &Footing,
) -> f32 {
    let bump_m = (footing.compression_m - BUMP_M).max(0.0);
    wheel.load_n
        + rates.stiffness_n_per_m * footing.compression_m
        + BUMP_PER_M * wheel.load_n * bump_m
        + rates.damping_n_per_mps * closing_mps(chassis, footing)
}
