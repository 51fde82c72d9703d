//! Springs, dampers and anti-roll bars: from the ground under each wheel to its load.

use std::f32::consts::TAU;

use super::spec::{GRAVITY_MPS2, is_front};
use super::{Chassis, Footing, VehicleSpec, WHEEL_COUNT};
use crate::ground::Ground;
use schemas::Vec3;

/// Compression from rest at which the bump stop begins.
const BUMP_M: f32 = 0.08;
/// Stiffness of the bump stop.
const BUMP_N_PER_M: f32 = 180_000.0;
/// Height above the wheel's contact point from which the ground is looked for: a kerb or a deep
/// compression must stay below, a bridge overhead above.
const LOOK_FROM_M: f32 = 0.5;
/// A wheel on ground steeper than this against the vehicle's up axis carries nothing (about 75°).
const ALIGNMENT_MIN: f32 = 0.25;

/// What each wheel stands on; `None` for wheels in the air.
pub(super) fn footings(
    spec: &VehicleSpec,
    chassis: &Chassis,
    ground: &Ground,
) -> [Option<Footing>; WHEEL_COUNT] {
    let mut footings: [Option<Footing>; WHEEL_COUNT] =
        std::array::from_fn(|wheel| unloaded_footing(spec, chassis, ground, wheel));
    let compressions = footings.map(|footing| footing.map_or(0.0, |at| at.compression_m));
    for (wheel, slot) in footings.iter_mut().enumerate() {
        let Some(footing) = slot else { continue };
        // The wheel on the other side of the axle.
        let twist_m = footing.compression_m - compressions[wheel ^ 1];
        footing.load_n = (spring_and_damper_n(spec, chassis, footing, wheel)
            + spec.anti_roll_n_per_m * twist_m)
            .max(0.0);
        if footing.load_n <= 0.0 {
            *slot = None;
        }
    }
    footings
}

/// Whether every wheel bears on the ground and no spring is near its end.
pub(super) fn carry(footings: &[Option<Footing>; WHEEL_COUNT]) -> bool {
    footings.iter().all(|footing| footing.is_some_and(|footing| footing.compression_m < BUMP_M))
}

/// Where the wheel's axis meets the ground, taken as the plane under the wheel.
fn unloaded_footing(
    spec: &VehicleSpec,
    chassis: &Chassis,
    ground: &Ground,
    wheel: usize,
) -> Option<Footing> {
    let (x_m, y_m) = spec.wheel_xy_m(wheel);
    let foot_m = chassis.world_from_point(Vec3::new(x_m, y_m, 0.0));
    let up = chassis.up();
    let surface = ground.below(foot_m + up * LOOK_FROM_M);
    let alignment = up.dot(&surface.normal);
    if alignment < ALIGNMENT_MIN {
        return None;
    }
    let surface_m = Vec3::new(foot_m.x, foot_m.y, surface.height_m);
    let compression_m = (surface_m - foot_m).dot(&surface.normal) / alignment;
    let droop_m = spec.static_load_n(wheel) / spring_n_per_m(spec, wheel);
    if compression_m <= -droop_m {
        return None;
    }
    let point_m = foot_m + up * compression_m;
    Some(Footing { surface, point_m, compression_m, load_n: 0.0 })
}

fn spring_and_damper_n(
    spec: &VehicleSpec,
    chassis: &Chassis,
    footing: &Footing,
    wheel: usize,
) -> f32 {
    let normal = footing.surface.normal;
    let closing_mps = -chassis.velocity_at(footing.point_m).dot(&normal);
    let stiffness = spring_n_per_m(spec, wheel);
    let damping = 2.0 * spec.damping_ratio * (stiffness * corner_mass_kg(spec, wheel)).sqrt();
    let bump_m = (footing.compression_m - BUMP_M).max(0.0);
    spec.static_load_n(wheel)
        + stiffness * footing.compression_m
        + BUMP_N_PER_M * bump_m
        + damping * closing_mps
}

fn corner_mass_kg(spec: &VehicleSpec, wheel: usize) -> f32 {
    spec.static_load_n(wheel) / GRAVITY_MPS2
}

/// Front a tenth softer than rear, so that the body stays level over a bump.
fn spring_n_per_m(spec: &VehicleSpec, wheel: usize) -> f32 {
    let axle = if is_front(wheel) { 0.95 } else { 1.05 };
    let radps = TAU * spec.ride_hz * axle;
    corner_mass_kg(spec, wheel) * radps * radps
}
