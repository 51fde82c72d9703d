//! The shapes of bodies, also for rays.

use rapier3d::prelude::SharedShape;
use schemas::{Pose, Vec3};

use super::{BodyHandle, Physics};
use crate::convert::{from_rapier, pose_from_rapier};
use crate::rays::Shape;

impl Physics {
    /// The shapes of a body, each with its pose in the world.
    pub(crate) fn shapes(&self, handle: BodyHandle) -> impl Iterator<Item = (Shape, Pose)> {
        let body = &self.bodies[handle];
        body.colliders().iter().filter_map(|&collider| {
            let collider = self.colliders.get(collider)?;
            let body_from_shape = collider.position_wrt_parent()?;
            let world_from_shape = pose_from_rapier(&(*body.position() * *body_from_shape));
            let shape = collider.shape();
            let cuboid =
                || Some(Shape::Box { half_m: from_rapier(shape.as_cuboid()?.half_extents) });
            let capsule = || {
                let capsule = shape.as_capsule()?;
                let (half_segment_m, radius_m) = (capsule.half_height(), capsule.radius);
                Some(Shape::Capsule { half_segment_m, radius_m })
            };
            Some((cuboid().or_else(capsule)?, world_from_shape))
        })
    }
}

pub(super) fn box_shape(half_m: Vec3) -> SharedShape {
    SharedShape::cuboid(half_m.x, half_m.y, half_m.z)
}
