//! Bodies whose motion became impossible.

use rapier3d::pipeline::Quarantine;
use rapier3d::prelude::RigidBodyType;
use schemas::{HaltReason, Pose, Vec3};

use super::{BodyHandle, Fault, Physics};
use crate::convert::{pose_to_rapier, to_rapier};

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
