//! Where bodies are put, and how fast they are made.

use schemas::{Pose, Vec3};

use super::{BodyHandle, Physics};
use crate::convert::{pose_to_rapier, to_rapier};

impl Physics {
    pub(crate) fn set_velocity(
        &mut self,
        handle: BodyHandle,
        linear_mps: Vec3,
        angular_radps: Vec3,
    ) {
        let body = &mut self.bodies[handle];
        body.set_linvel(to_rapier(linear_mps), true);
        body.set_angvel(to_rapier(angular_radps), true);
    }

    pub(crate) fn set_pose(&mut self, handle: BodyHandle, world_from_body: &Pose) {
        let pose = pose_to_rapier(world_from_body);
        // A body that is lent to be changed costs as if it were, and many only stand.
        let body = &self.bodies[handle];
        if [body.position(), body.next_position()] != [&pose; 2] {
            self.bodies[handle].set_position(pose, true);
        }
    }
}
