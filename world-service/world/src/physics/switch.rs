//! What clients turn on and off, and the hold of a walker's balance.

use rapier3d::prelude::RigidBodyType;
use schemas::{UnitQuaternion, Vec3};

use super::{BodyHandle, LYING_SLEEP_MPS, Physics, SLEEP_MPS};
use crate::convert::{rotation_to_rapier, to_rapier};

impl Physics {
    /// Off: the body stays where it is put and cannot be pushed.
    pub(crate) fn set_simulated(&mut self, handle: BodyHandle, on: bool) {
        let kind = if on { RigidBodyType::Dynamic } else { RigidBodyType::Fixed };
        self.bodies[handle].set_body_type(kind, true);
    }

    /// Off: the body does not fall.
    pub(crate) fn set_gravity(&mut self, handle: BodyHandle, on: bool) {
        let body = &mut self.bodies[handle];
        body.set_gravity_scale(if on { 1.0 } else { 0.0 }, false);
        body.wake_up(true);
    }

    /// Off: nothing touches the body.
    pub(crate) fn set_collisions(&mut self, handle: BodyHandle, on: bool) {
        for collider in self.bodies[handle].colliders() {
            if let Some(collider) = self.colliders.get_mut(*collider) {
                collider.set_enabled(on);
            }
        }
    }

    /// Keeps an awake body upright while it turns.
    pub(crate) fn hold_upright(
        &mut self,
        handle: BodyHandle,
        upright: UnitQuaternion<f32>,
        turn_radps: f32,
    ) {
        let body = &mut self.bodies[handle];
        body.set_rotation(rotation_to_rapier(upright), false);
        body.set_angvel(to_rapier(Vec3::z() * turn_radps), false);
        body.activation_mut().normalized_linear_threshold = SLEEP_MPS;
    }

    /// Lets a body that lies fall asleep although it trembles against what it leans on.
    pub(crate) fn lay_down(&mut self, handle: BodyHandle) {
        self.bodies[handle].activation_mut().normalized_linear_threshold = LYING_SLEEP_MPS;
    }
}
