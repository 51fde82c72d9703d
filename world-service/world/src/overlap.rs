//! Whether two boxes overlap.

use nalgebra::Matrix3;
use schemas::{Pose, Vec3};

use crate::blueprint::Blueprint;

/// A box anywhere in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrientedBox {
    centre_m: Vec3,
    axes: Matrix3<f32>,
    half_m: Vec3,
}

impl OrientedBox {
    /// The bounding box of a blueprint at a pose.
    pub(crate) fn new(world_from_actor: &Pose, blueprint: &Blueprint) -> Self {
        let centre_m = blueprint.box_centre_m();
        let world_from_box =
            world_from_actor * Pose::translation(centre_m.x, centre_m.y, centre_m.z);
        Self::of(&world_from_box, blueprint.box_half_extent_m())
    }

    pub(crate) fn of(world_from_box: &Pose, half_m: Vec3) -> Self {
        Self {
            centre_m: world_from_box.translation.vector,
            axes: world_from_box.rotation.to_rotation_matrix().into_inner(),
            half_m,
        }
    }

    pub(crate) fn centre_m(&self) -> Vec3 {
        self.centre_m
    }

    /// The middle of its front, and the way that it points.
    pub(crate) fn front(&self) -> (Vec3, Vec3) {
        let forward = self.axes.column(0).into_owned();
        (self.centre_m + forward * self.half_m.x, forward)
    }

    /// Of the sphere around it.
    pub(crate) fn radius_m(&self) -> f32 {
        self.half_m.norm()
    }

    /// Separating axes: the faces of both and the cross products of their edges.
    ///
    /// - **Source:** Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        let apart_m = other.centre_m - self.centre_m;
        let reach_m = self.radius_m() + other.radius_m();
        if apart_m.norm_squared() > reach_m * reach_m {
            return false;
        }
        let faces = self.axes.column_iter().chain(other.axes.column_iter());
        let edges = self.axes.column_iter().flat_map(|a| {
            other.axes.column_iter().map(move |b| a.into_owned().cross(&b.into_owned()))
        });
        faces.map(|axis| axis.into_owned()).chain(edges).all(|axis| {
            // Parallel edges give no axis of their own; the faces decide then.
            axis.norm_squared() < 1.0e-6
                || apart_m.dot(&axis).abs() <= self.extent_m(axis) + other.extent_m(axis)
        })
    }

    /// Half of its length along an axis, times that axis's length.
    fn extent_m(&self, axis: Vec3) -> f32 {
        (self.axes.tr_mul(&axis)).abs().dot(&self.half_m)
    }
}

#[cfg(test)]
mod tests {
    use schemas::level_pose;

    use super::*;

    fn at(x: f32, y: f32, yaw_rad: f32) -> OrientedBox {
        OrientedBox::of(&level_pose(Vec3::new(x, y, 0.0), yaw_rad), Vec3::new(2.0, 1.0, 1.0))
    }

    #[test]
    fn boxes_overlap_when_no_axis_separates_them() {
        assert!(at(0.0, 0.0, 0.0).overlaps(&at(3.9, 1.9, 0.0)));
        assert!(!at(0.0, 0.0, 0.0).overlaps(&at(4.1, 0.0, 0.0)));
        assert!(!at(0.0, 0.0, 0.0).overlaps(&at(0.0, 2.1, 0.0)));
    }

    #[test]
    fn a_turned_box_may_reach_further() {
        let quarter = std::f32::consts::FRAC_PI_2;
        assert!(!at(0.0, 0.0, 0.0).overlaps(&at(0.0, 2.5, 0.0)));
        assert!(at(0.0, 0.0, 0.0).overlaps(&at(0.0, 2.5, quarter)));
        // The corner of a box turned by 45° points between the corners of the other.
        assert!(!at(0.0, 0.0, 0.0).overlaps(&at(3.4, 2.6, quarter / 2.0)));
    }
}
