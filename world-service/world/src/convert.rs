//! Between Rapier's vectors (glam) and ours (nalgebra); no other module names glam.

use rapier3d::math as rapier;
use schemas::{Pose, Translation3, UnitQuaternion, Vec3};

pub(crate) fn to_rapier(vector: Vec3) -> rapier::Vector {
    rapier::Vector::new(vector.x, vector.y, vector.z)
}

pub(crate) fn from_rapier(vector: rapier::Vector) -> Vec3 {
    Vec3::new(vector.x, vector.y, vector.z)
}

pub(crate) fn pose_to_rapier(pose: &Pose) -> rapier::Pose {
    rapier::Pose::from_parts(to_rapier(pose.translation.vector), rotation_to_rapier(pose.rotation))
}

pub(crate) fn rotation_to_rapier(rotation: UnitQuaternion<f32>) -> rapier::Rotation {
    let q = rotation.coords;
    rapier::Rotation::from_xyzw(q.x, q.y, q.z, q.w)
}

pub(crate) fn pose_from_rapier(pose: &rapier::Pose) -> Pose {
    let q = pose.rotation;
    // The solver keeps quaternions normalised; normalising again would change bits.
    let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(q.w, q.x, q.y, q.z));
    Pose::from_parts(Translation3::from(from_rapier(pose.translation)), rotation)
}
