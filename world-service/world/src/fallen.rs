//! Bodies on the ground: a fallen pedestrian, a rolled car, a hood that touches a kerb.
//!
//! The eight corners of a body's box are kept out of the ground by sequential impulses with Coulomb
//! friction (Catto, "Iterative dynamics with temporal coherence", GDC 2005), ahead of Rapier's
//! step. A box and not the capsule, so that a fallen person does not roll away.

use schemas::Vec3;

use crate::ground::Ground;
use crate::physics::{BodyState, Response};
use crate::vehicle::Impulse;

/// Passes over the corners; eight corners settle to a millimetre.
const PASSES: usize = 6;
/// Friction of clothes and sheet metal on asphalt.
const FRICTION: f32 = 0.65;
/// Share of the penetration that one substep takes back.
const CORRECTION: f32 = 0.2;
/// Penetration that is left alone, so that a resting body keeps its contacts.
const SLOP_M: f32 = 0.003;
/// Fastest correction of penetration.
const CORRECTION_MPS_MAX: f32 = 1.5;
/// Ground this far above a corner still pushes it up.
const LOOK_FROM_M: f32 = 1.0;

/// One corner in the ground.
struct Corner {
    arm_m: Vec3,
    normal: Vec3,
    penetration_m: f32,
    /// Summed over the passes: along the normal, and in the ground's plane.
    pushed_ns: f32,
    rubbed_ns: Vec3,
}

/// What the ground does to a box-shaped body during one substep.
///
/// - **Frame:** `centre_m` and `half_m` of the box in the body's frame.
pub(crate) fn ground_impulse(
    state: &BodyState,
    response: &Response,
    (centre_m, half_m): (Vec3, Vec3),
    ground: &Ground,
    gravity_mps2: f32,
    dt_secs: f32,
) -> Impulse {
    let mut corners = touching(state, centre_m, half_m, ground);
    let mut total = Impulse::default();
    if corners.is_empty() {
        return total;
    }
    let mut linear_mps = state.linear_mps - Vec3::z() * (gravity_mps2 * dt_secs);
    let mut angular_radps = state.angular_radps;
    for _ in 0..PASSES {
        for corner in &mut corners {
            let velocity_mps = linear_mps + angular_radps.cross(&corner.arm_m);
            let impulse_ns = corner.resolve(velocity_mps, response, dt_secs);
            let angular_nms = corner.arm_m.cross(&impulse_ns);
            linear_mps += impulse_ns * response.inverse_mass_per_kg;
            angular_radps += response.inverse_inertia * angular_nms;
            total += Impulse { linear_ns: impulse_ns, angular_nms };
        }
    }
    total
}

fn touching(state: &BodyState, centre_m: Vec3, half_m: Vec3, ground: &Ground) -> Vec<Corner> {
    let sign = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
    (0..8usize)
        .filter_map(|corner| {
            let signs = Vec3::new(sign(corner & 1), sign(corner & 2), sign(corner & 4));
            let in_body_m = centre_m + signs.component_mul(&half_m);
            let point_m = state.world_from_body.transform_point(&in_body_m.into()).coords;
            let surface = ground.below(point_m + Vec3::z() * LOOK_FROM_M);
            let penetration_m = (surface.height_m - point_m.z) * surface.normal.z;
            (penetration_m > 0.0).then(|| Corner {
                arm_m: point_m - state.centre_of_mass_m,
                normal: surface.normal,
                penetration_m,
                pushed_ns: 0.0,
                rubbed_ns: Vec3::zeros(),
            })
        })
        .collect()
}

impl Corner {
    /// The impulse that brings this corner, moving at `velocity_mps`, to rest within friction.
    fn resolve(&mut self, velocity_mps: Vec3, response: &Response, dt_secs: f32) -> Vec3 {
        let correction_mps =
            ((self.penetration_m - SLOP_M).max(0.0) * CORRECTION / dt_secs).min(CORRECTION_MPS_MAX);
        let wanted_mps = correction_mps - velocity_mps.dot(&self.normal);
        let push_ns = wanted_mps / self.mobility_per_kg(self.normal, response);
        let pushed_ns = (self.pushed_ns + push_ns).max(0.0);
        let normal_ns = self.normal * (pushed_ns - self.pushed_ns);
        self.pushed_ns = pushed_ns;

        let sliding_mps = velocity_mps - self.normal * velocity_mps.dot(&self.normal);
        let Some(direction) = sliding_mps.try_normalize(1.0e-6) else { return normal_ns };
        let wanted_ns = -sliding_mps / self.mobility_per_kg(direction, response);
        let rubbed_ns = (self.rubbed_ns + wanted_ns).cap_magnitude(FRICTION * self.pushed_ns);
        let friction_ns = rubbed_ns - self.rubbed_ns;
        self.rubbed_ns = rubbed_ns;
        normal_ns + friction_ns
    }

    /// Speed along `direction` per unit of impulse along it.
    fn mobility_per_kg(&self, direction: Vec3, response: &Response) -> f32 {
        let twist = self.arm_m.cross(&direction);
        response.inverse_mass_per_kg + (response.inverse_inertia * twist).dot(&twist)
    }
}
