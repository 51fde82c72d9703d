//! Points, rotations, boxes.

use schemas::carla::{self, RotationDeg};
use schemas::{Pose, Vec3};
use serde::{Deserialize, Serialize};

use super::ActorRef;

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Vector2D {
    pub(crate) x: f32,
    pub(crate) y: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Vector3D {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) z: f32,
}

pub(crate) type Location = Vector3D;

/// Degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rotation {
    pub(crate) pitch: f32,
    pub(crate) yaw: f32,
    pub(crate) roll: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Transform {
    pub(crate) location: Location,
    pub(crate) rotation: Rotation,
}

/// Centre and half sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct BoundingBox {
    pub(crate) location: Location,
    pub(crate) extent: Vector3D,
    pub(crate) rotation: Rotation,
    /// Clients of 0.10 know none.
    #[serde(default)]
    pub(crate) actor_id: ActorRef,
}

impl Vector3D {
    /// A point, velocity or force of ours.
    pub(crate) fn of(ours: Vec3) -> Self {
        let mirrored = carla::mirror_y(ours);
        Self { x: mirrored.x, y: mirrored.y, z: mirrored.z }
    }

    /// As it is, without a change of axes: sizes.
    pub(crate) fn size(ours: Vec3) -> Self {
        Self { x: ours.x, y: ours.y, z: ours.z }
    }

    /// In our axes.
    pub(crate) fn ours(self) -> Vec3 {
        carla::mirror_y(Vec3::new(self.x, self.y, self.z))
    }
}

/// CARLA's angular velocity in degrees per second from ours in radians per second: a mirror turns
/// the sense of rotation about every axis that lies in it.
pub(crate) fn spin_deg(ours_radps: Vec3) -> Vector3D {
    let Vector3D { x, y, z } = mirrored_spin(ours_radps);
    Vector3D { x: x.to_degrees(), y: y.to_degrees(), z: z.to_degrees() }
}

/// The same without a change of units. No part is -0.0.
pub(crate) fn mirrored_spin(spin: Vec3) -> Vector3D {
    Vector3D::size(Vec3::new(-spin.x, spin.y, -spin.z).add_scalar(0.0))
}

/// The inverse of [`spin_deg`].
pub(crate) fn spin_from_deg(theirs_degps: Vector3D) -> Vec3 {
    let Vector3D { x, y, z } = theirs_degps;
    Vec3::new(-x.to_radians(), y.to_radians(), -z.to_radians())
}

/// Torques and angular impulses of CARLA's, whose masses are kilograms, lengths centimetres and
/// angles degrees.
pub(crate) fn twist_from_deg(theirs: Vector3D) -> Vec3 {
    /// Square metres in a square centimetre.
    const M2_PER_CM2: f32 = 1e-4;
    spin_from_deg(theirs) * M2_PER_CM2
}

impl Transform {
    /// CARLA's name for a pose of ours.
    pub(crate) fn of(pose: &Pose) -> Self {
        let RotationDeg { pitch, yaw, roll } = carla::rotation_from_pose(pose);
        let location = Location::of(pose.translation.vector);
        Self { location, rotation: Rotation { pitch, yaw, roll } }
    }

    /// In our axes.
    pub(crate) fn ours(&self) -> Pose {
        let Rotation { pitch, yaw, roll } = self.rotation;
        let Location { x, y, z } = self.location;
        carla::pose_from_transform(Vec3::new(x, y, z), RotationDeg { pitch, yaw, roll })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_is_location_then_pitch_yaw_roll() {
        let transform = Transform {
            location: Location { x: 1.0, y: 2.0, z: 3.0 },
            rotation: Rotation { pitch: 4.0, yaw: 5.0, roll: 6.0 },
        };
        let bytes = rmp_serde::to_vec(&transform).unwrap();
        let mut wanted = vec![0x92, 0x93];
        for (at, number) in [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0].into_iter().enumerate() {
            if at == 3 {
                wanted.push(0x93);
            }
            wanted.push(0xca);
            wanted.extend_from_slice(&number.to_be_bytes());
        }
        assert_eq!(bytes, wanted);
        assert_eq!(rmp_serde::from_slice::<Transform>(&bytes).unwrap(), transform);
    }

    #[test]
    fn turning_left_is_a_negative_yaw_rate() {
        assert_eq!(spin_deg(Vec3::new(0.0, 0.0, 1.0)).z, -1.0f32.to_degrees());
        assert!(spin_deg(Vec3::zeros()).z.is_sign_positive());
        let back = spin_from_deg(spin_deg(Vec3::new(0.1, 0.2, 0.3)));
        assert!((back - Vec3::new(0.1, 0.2, 0.3)).norm() < 1e-6);
    }
}
