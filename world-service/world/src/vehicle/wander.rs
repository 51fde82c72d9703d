//! How the road moves a car aside: by its front wheels under way, by all of them when it lands.
//!
//! Grooves and crossfall let no car keep a lane to the millimetre. CARLA's agents rely on it: to
//! them nothing is ahead whose direction differs by less than rounding from their own.

use std::f32::consts::TAU;

use nalgebra::ComplexField;
use schemas::{Handling, Vec3};

use super::fit::{Fit, WheelFit};

/// Slip angle of each of the waves, in radians, up to the first of these speeds; from the second on
/// there is none, as controllers at the limit of their tyres bear no push.
const WAVE_RAD: f32 = 0.001;
const FADES_MPS: [f32; 2] = [12.0, 16.0];
/// How fast the road moves aside below a car that lands; it makes 6 to 8 mm.
const SETTLES_MPS: f32 = 0.05;
/// Waves over the ground, as parts of a cycle for each metre along x and y: 11 and 14 m long, and
/// across each other, so that no heading leads along the crests of both.
const WAVES_PER_M: [[f32; 2]; 2] = [[0.0755, 0.0504], [-0.0335, 0.0632]];

/// The slip angle that the road adds to that of a wheel at a place, in radians.
///
/// - **Domain:** front wheels of cars that steer as CARLA's; 0 for all others.
/// - **Determinism:** a function of place and speed alone.
pub(super) fn slip_rad(fit: &Fit, wheel: &WheelFit, point_m: Vec3, forward_mps: f32) -> f32 {
    let [from_mps, to_mps] = FADES_MPS;
    let share = ((to_mps - forward_mps.abs()) / (to_mps - from_mps)).clamp(0.0, 1.0);
    if !is_moved(fit) || !wheel.is_front || share == 0.0 {
        return 0.0;
    }
    share * WAVE_RAD * height(point_m)
}

/// How fast the road moves to the left below a car that lands at a place, in metres per second.
///
/// - **Domain:** cars that steer as CARLA's; 0 for all others.
/// - **Determinism:** a function of place alone.
pub(super) fn settling_mps(fit: &Fit, position_m: Vec3) -> f32 {
    if is_moved(fit) { SETTLES_MPS.copysign(height(position_m)) } else { 0.0 }
}

fn is_moved(fit: &Fit) -> bool {
    fit.physics.handling == Handling::Carla && !fit.model.is_two_wheeler()
}

/// Sum of the waves at a place.
fn height(point_m: Vec3) -> f32 {
    let wave = |[x_per_m, y_per_m]: [f32; 2]| {
        let cycles = x_per_m * point_m.x + y_per_m * point_m.y;
        ComplexField::sin(TAU * (cycles - cycles.floor()))
    };
    WAVES_PER_M.into_iter().map(wave).sum()
}
