//! The shapes of bodies.

use nalgebra::Point3;
use rapier3d::prelude::SharedShape;
use schemas::Vec3;

use super::{BodyHandle, Physics};
use crate::convert::{pose_from_rapier, to_rapier};

pub(super) fn box_shape(half_m: Vec3) -> SharedShape {
    SharedShape::cuboid(half_m.x, half_m.y, half_m.z)
}

impl Physics {
    /// Whether a point, world frame, is inside of what bodies touch of a body.
    pub(crate) fn is_inside(&self, handle: BodyHandle, point_m: Vec3) -> bool {
        let body = &self.bodies[handle];
        let world_from_body = pose_from_rapier(body.position());
        let own_m = world_from_body.inverse_transform_point(&Point3::from(point_m));
        body.colliders().iter().filter_map(|&collider| self.colliders.get(collider)).any(|part| {
            let body_from_shape = part.position_wrt_parent().map(pose_from_rapier);
            let at_m = body_from_shape.map_or(own_m, |pose| pose.inverse_transform_point(&own_m));
            part.shape().contains_local_point(to_rapier(at_m.coords))
        })
    }
}
