//! The shapes of bodies.

use rapier3d::prelude::SharedShape;
use schemas::Vec3;

pub(super) fn box_shape(half_m: Vec3) -> SharedShape {
    SharedShape::cuboid(half_m.x, half_m.y, half_m.z)
}
