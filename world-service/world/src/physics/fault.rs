//! Bodies whose motion became impossible.

use rapier3d::pipeline::Quarantine;
use rapier3d::prelude::RigidBodyType;
use schemas::{HaltReason, Pose, Vec3, limits};

use super::{BodyHandle, BodyState, Fault, Physics};
use crate::convert::{pose_to_rapier, to_rapier};

/// A body faster than this, or turning faster in rad/s, has been hit by a numerical failure and not
/// by a car.
const SPEED_MAX: f32 = 2.0 * limits::SPEED_MPS_MAX;

/// What no body can do of these velocities, metres and radians per second.
pub(super) fn velocity_fault(linear_mps: &Vec3, angular_radps: &Vec3) -> Option<HaltReason> {
    let values = || linear_mps.iter().chain(angular_radps.iter());
    if !values().all(|value| value.is_finite()) {
        return Some(HaltReason::NotFinite);
    }
    let is_slow = values().all(|value| value.abs() <= SPEED_MAX);
    (!is_slow).then_some(HaltReason::TooFast)
}

/// Why nothing can be at this pose.
pub(crate) fn pose_fault(pose: &Pose) -> Option<HaltReason> {
    let place_m = &pose.translation.vector;
    if !place_m.iter().chain(pose.rotation.coords.iter()).all(|value| value.is_finite()) {
        return Some(HaltReason::NotFinite);
    }
    let is_near = place_m.iter().all(|value| value.abs() <= limits::COORDINATE_M_MAX);
    (!is_near).then_some(HaltReason::TooFar)
}

impl BodyState {
    /// What no body can do of this one's motion.
    pub(crate) fn fault(&self) -> Option<HaltReason> {
        pose_fault(&self.world_from_body)
            .or_else(|| velocity_fault(&self.linear_mps, &self.angular_radps))
    }
}

impl Physics {
    /// Of the last step, ordered by body.
    pub(super) fn faults(&self, taken_out: &Quarantine) -> Vec<Fault> {
        let shapes = taken_out.colliders().iter();
        let owners = shapes.filter_map(|shape| self.colliders.get(*shape)?.parent());
        let lost = taken_out.bodies().iter().copied().chain(owners);
        let mut faults: Vec<Fault> = lost.map(|body| (body, HaltReason::NotFinite)).collect();
        for body in self.islands.active_bodies() {
            faults.extend(self.state(body).fault().map(|reason| (body, reason)));
        }
        if !faults.is_empty() {
            faults.sort_by_key(|(body, _)| body.into_raw_parts());
            faults.dedup_by_key(|(body, _)| *body);
        }
        faults
    }

    /// Puts a body back and switches it off; it stands in the way of others if it `touches`.
    pub(crate) fn put_to_rest(&mut self, handle: BodyHandle, pose: &Pose, touches: bool) {
        let body = &mut self.bodies[handle];
        body.set_enabled(true);
        body.reset_forces(false);
        body.reset_torques(false);
        body.set_linvel(to_rapier(Vec3::zeros()), false);
        body.set_angvel(to_rapier(Vec3::zeros()), false);
        body.set_position(pose_to_rapier(pose), true);
        body.set_body_type(RigidBodyType::Fixed, true);
        self.set_collisions(handle, touches);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_component_that_is_no_number_is_a_fault_wherever_it_is() {
        for axis in 0..3 {
            for value in [f32::NAN, f32::INFINITY] {
                let mut wrong = Vec3::new(1.0, -2.0, 3.0);
                wrong[axis] = value;
                let fault = Some(HaltReason::NotFinite);
                assert_eq!(velocity_fault(&wrong, &Vec3::zeros()), fault);
                assert_eq!(velocity_fault(&Vec3::zeros(), &wrong), fault);
                assert_eq!(pose_fault(&Pose::translation(wrong.x, wrong.y, wrong.z)), fault);
            }
        }
    }

    #[test]
    fn what_is_at_the_limit_is_possible() {
        let (still, fast) = (Vec3::zeros(), Vec3::x() * SPEED_MAX);
        assert_eq!(velocity_fault(&fast, &-fast), None);
        assert_eq!(velocity_fault(&still, &(fast * 1.01)), Some(HaltReason::TooFast));
        let far = |x_m: f32| pose_fault(&Pose::translation(x_m, 0.0, 0.0));
        assert_eq!(far(-limits::COORDINATE_M_MAX), None);
        assert_eq!(far(-limits::COORDINATE_M_MAX * 1.01), Some(HaltReason::TooFar));
    }
}
