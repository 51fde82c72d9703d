//! Poses and vectors in single precision: what physics computes and the wire carries.
//!
//! **Frames:** right-handed; world x east, y north, z up (OpenDRIVE, REP-103); actor x forward,
//! y left, z up (ISO 8855). Lengths in metres, angles in radians.

use nalgebra::{Isometry3, Vector3};
pub use nalgebra::{Translation3, UnitQuaternion};

/// A vector or point; the name that holds it says unit and frame.
pub type Vec3 = Vector3<f32>;
/// `a_from_b`: maps coordinates in `b` to coordinates in `a`.
pub type Pose = Isometry3<f32>;

/// A pose on level ground: position and heading, counter-clockwise from x.
pub fn level_pose(position_m: Vec3, yaw_rad: f32) -> Pose {
    Pose::from_parts(
        Translation3::from(position_m),
        UnitQuaternion::from_axis_angle(&Vec3::z_axis(), yaw_rad),
    )
}

/// Heading of a pose's x axis in the x-y plane, counter-clockwise from x.
pub fn yaw_rad(pose: &Pose) -> f32 {
    let forward = pose.rotation * Vec3::x();
    forward.y.atan2(forward.x)
}
