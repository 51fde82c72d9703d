//! Bodies on the ground: a fallen pedestrian, a rolled car, a hood that touches a kerb.
//!
//! The eight corners of a body's box are kept out of the ground by sequential impulses with Coulomb
//! friction (Catto, "Iterative dynamics with temporal coherence", GDC 2005), ahead of Rapier's
//! step. A box and not the capsule, so that a fallen person does not roll away.

use nalgebra::Matrix3;
use schemas::Vec3;

use crate::ground::Ground;
use crate::physics::{BodyState, Response};
use crate::vehicle::Impulse;

/// Passes over the corners, at most; eight corners settle to a millimetre.
const PASSES_MAX: usize = 6;
/// A pass that changes the body's speed by less than this is the last one.
const SETTLED_MPS: f32 = 1.0e-3;
/// Friction of clothes and sheet metal on asphalt.
const FRICTION: f32 = 0.65;
/// Share of the penetration that one substep takes back.
const CORRECTION: f32 = 0.2;
/// Penetration that is left alone, so that a resting body keeps its contacts.
const SLOP_M: f32 = 0.003;
/// Fastest correction of penetration.
const CORRECTION_MPS_MAX: f32 = 1.5;
/// Slower than this nothing rubs.
const STANDING_MPS: f32 = 1.0e-6;
/// Ground this far above a corner still pushes it up.
const LOOK_FROM_M: f32 = 1.0;

/// One corner in the ground.
struct Corner {
    arm_m: Vec3,
    normal: Vec3,
    /// Velocity of the corner per unit of impulse on it.
    mobility: Matrix3<f32>,
    /// Impulse along the normal per unit of speed along it.
    mass_along_normal_kg: f32,
    /// Speed at which the ground lets the corner come up.
    correction_mps: f32,
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
    let mut corners = [const { None }; 8];
    for (index, corner) in corners.iter_mut().enumerate() {
        let sign = |bit: usize| if index & bit == 0 { -1.0 } else { 1.0 };
        let in_body_m = centre_m + Vec3::new(sign(1), sign(2), sign(4)).component_mul(&half_m);
        let point_m = state.world_from_body.transform_point(&in_body_m.into()).coords;
        *corner = Corner::touching(point_m, state, response, ground, dt_secs);
    }
    let mut total = Impulse::default();
    let mut linear_mps = state.linear_mps - Vec3::z() * (gravity_mps2 * dt_secs);
    let mut angular_radps = state.angular_radps;
    let settled_ns = SETTLED_MPS / response.inverse_mass_per_kg;
    for _ in 0..PASSES_MAX {
        let mut largest_ns_squared = 0.0f32;
        for corner in corners.iter_mut().flatten() {
            let velocity_mps = linear_mps + angular_radps.cross(&corner.arm_m);
            let impulse_ns = corner.resolve(velocity_mps);
            let angular_nms = corner.arm_m.cross(&impulse_ns);
            linear_mps += impulse_ns * response.inverse_mass_per_kg;
            angular_radps += response.inverse_inertia * angular_nms;
            total += Impulse { linear_ns: impulse_ns, angular_nms };
            largest_ns_squared = largest_ns_squared.max(impulse_ns.norm_squared());
        }
        if largest_ns_squared < settled_ns * settled_ns {
            break;
        }
    }
    total
}

impl Corner {
    /// The corner at a point; `None` above the ground.
    fn touching(
        point_m: Vec3,
        state: &BodyState,
        response: &Response,
        ground: &Ground,
        dt_secs: f32,
    ) -> Option<Self> {
        if ground.is_all_below(point_m) {
            return None;
        }
        let surface = ground.below(point_m + Vec3::z() * LOOK_FROM_M);
        let normal = surface.normal;
        let penetration_m = (surface.height_m - point_m.z) * normal.z;
        if penetration_m <= 0.0 {
            return None;
        }
        let arm_m = point_m - state.centre_of_mass_m;
        let lever = arm_m.cross_matrix();
        let mobility = Matrix3::from_diagonal_element(response.inverse_mass_per_kg)
            - lever * response.inverse_inertia * lever;
        let correction_mps = (penetration_m - SLOP_M).max(0.0) * CORRECTION / dt_secs;
        Some(Self {
            arm_m,
            normal,
            mobility,
            mass_along_normal_kg: 1.0 / normal.dot(&(mobility * normal)),
            correction_mps: correction_mps.min(CORRECTION_MPS_MAX),
            pushed_ns: 0.0,
            rubbed_ns: Vec3::zeros(),
        })
    }

    /// The impulse that brings this corner, moving at `velocity_mps`, to rest within friction.
    fn resolve(&mut self, velocity_mps: Vec3) -> Vec3 {
        let along_normal_mps = velocity_mps.dot(&self.normal);
        let push_ns = (self.correction_mps - along_normal_mps) * self.mass_along_normal_kg;
        let pushed_ns = (self.pushed_ns + push_ns).max(0.0);
        let normal_ns = self.normal * (pushed_ns - self.pushed_ns);
        self.pushed_ns = pushed_ns;

        let sliding_mps = velocity_mps - self.normal * along_normal_mps;
        let speed_squared = sliding_mps.norm_squared();
        if speed_squared < STANDING_MPS * STANDING_MPS {
            return normal_ns;
        }
        let mobility_per_kg = sliding_mps.dot(&(self.mobility * sliding_mps)) / speed_squared;
        let wanted_ns = self.rubbed_ns - sliding_mps / mobility_per_kg;
        let rubbed_ns = wanted_ns.cap_magnitude(FRICTION * self.pushed_ns);
        let friction_ns = rubbed_ns - self.rubbed_ns;
        self.rubbed_ns = rubbed_ns;
        normal_ns + friction_ns
    }
}
