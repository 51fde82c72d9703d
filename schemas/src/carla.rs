//! The one place where CARLA's conventions exist: left-handed (x forward/east, y right/south, z
//! up), degrees, yaw clockwise seen from above, positive steer to the right.
//!
//! **Source:** CARLA documentation, "Coordinates and transformations"; signs checked against the
//! wheel.

use nalgebra::{Rotation3, Translation3, UnitQuaternion};

use crate::{Pose, Vec3, WorldId};

/// Before the number of a world in its name as a map.
const WORLD_PREFIX: &str = "world-";

/// What CARLA's clients load to come into a world that is open to them.
pub fn name_of_world(world: WorldId) -> String {
    format!("{WORLD_PREFIX}{}", world.get())
}

/// The world of such a name, which may be that of a file in a folder.
pub fn world_named(name: &str) -> Option<WorldId> {
    let number = name.rsplit('/').next()?.strip_prefix(WORLD_PREFIX)?;
    WorldId::new(number.parse().ok()?)
}

/// CARLA's `Rotation`, in degrees; positive pitch looks up, positive yaw turns right, positive roll
/// leans right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotationDeg {
    /// About the left axis, positive up.
    pub pitch: f32,
    /// About the vertical, clockwise seen from above, 0 along x.
    pub yaw: f32,
    /// About the forward axis, positive right side down.
    pub roll: f32,
}

/// A point, vector or velocity in CARLA's frame from one in ours, or back: both mirror y. Never
/// -0.0, which CARLA's client prints as such.
pub fn mirror_y(vector: Vec3) -> Vec3 {
    Vec3::new(vector.x, -vector.y, vector.z).add_scalar(0.0)
}

/// CARLA's rotation of a pose in our world; yaw and roll are more than -180° and at most 180°. No
/// angle is -0.0.
pub fn rotation_from_pose(pose: &Pose) -> RotationDeg {
    /// What CARLA's client prints as 0, or as -0; single precision cannot tell it from none.
    const NONE_DEG: f32 = 5.0e-7;
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let degrees = [roll, -pitch, -yaw].map(f32::to_degrees);
    let [roll, pitch, yaw] = degrees.map(|one| if one.abs() < NONE_DEG { 0.0 } else { one });
    RotationDeg { pitch, yaw: upper_half(yaw), roll: upper_half(roll) }
}

/// Half a turn is always 180° and never -180°: programs compare a heading with the one they asked
/// for. What is nearer to half a turn than physics can hold a heading counts as one.
fn upper_half(degrees: f32) -> f32 {
    const HALF_TURN_DEG: f32 = 180.0;
    const NEAR_DEG: f32 = 1.0e-3;
    if degrees <= NEAR_DEG - HALF_TURN_DEG { HALF_TURN_DEG } else { degrees }
}

/// Our pose of CARLA's transform.
pub fn pose_from_transform(location: Vec3, rotation: RotationDeg) -> Pose {
    let rotation = Rotation3::from_euler_angles(
        rotation.roll.to_radians(),
        -rotation.pitch.to_radians(),
        -rotation.yaw.to_radians(),
    );
    Pose::from_parts(
        Translation3::from(mirror_y(location)),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// Kilometres per hour.
pub fn kmh(speed_mps: f32) -> f32 {
    speed_mps * 3.6
}

/// Metres per second.
pub fn mps(speed_kmh: f32) -> f32 {
    speed_kmh / 3.6
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_world_is_found_by_its_name_wherever_clients_think_it_lies() {
        let world = WorldId::of_host(3, 17);
        let name = name_of_world(world);
        assert_eq!(world_named(&name), Some(world));
        assert_eq!(world_named(&format!("/Game/Carla/Maps/{name}")), Some(world));
        for other in ["Town01", "world-", "world-x", "world-0", "world--1"] {
            assert_eq!(world_named(other), None, "{other}");
        }
    }

    #[test]
    fn left_is_negative_yaw_and_up_is_positive_pitch() {
        let left =
            pose_from_transform(Vec3::zeros(), RotationDeg { yaw: -90.0, ..Default::default() });
        assert!((left * Vec3::x() - Vec3::y()).norm() < 1e-6);
        let up =
            pose_from_transform(Vec3::zeros(), RotationDeg { pitch: 90.0, ..Default::default() });
        assert!((up * Vec3::x() - Vec3::z()).norm() < 1e-6);
        let right_down =
            pose_from_transform(Vec3::zeros(), RotationDeg { roll: 90.0, ..Default::default() });
        assert!((right_down * -Vec3::y() + Vec3::z()).norm() < 1e-6);
    }

    #[test]
    fn nothing_is_minus_zero() {
        let told = |x: f32, y: f32, z: f32| [x, y, z].map(|part| format!("{part:.6}")).concat();
        let zeros = "0.0000000.0000000.000000";
        for zero in [0.0, -0.0] {
            let mirrored = mirror_y(Vec3::repeat(zero));
            assert_eq!(told(mirrored.x, mirrored.y, mirrored.z), zeros);
        }
        for yaw in [0.0, 4.0e-7] {
            let turned = RotationDeg { yaw: -yaw, ..Default::default() };
            let pose = pose_from_transform(Vec3::zeros(), turned);
            let RotationDeg { pitch, yaw, roll } = rotation_from_pose(&pose);
            assert_eq!(told(pitch, yaw, roll), zeros);
        }
    }

    #[test]
    fn half_a_turn_is_positive() {
        for yaw in [180.0, -180.0, -179.9995] {
            let pose =
                pose_from_transform(Vec3::zeros(), RotationDeg { yaw, ..Default::default() });
            assert_eq!(rotation_from_pose(&pose).yaw, 180.0, "{yaw}");
        }
    }

    proptest! {
        #[test]
        fn there_and_back(pitch in -89.0f32..89.0, yaw in -179.0f32..179.0, roll in -179.0f32..179.0) {
            let rotation = RotationDeg { pitch, yaw, roll };
            let back = rotation_from_pose(&pose_from_transform(Vec3::new(1.0, 2.0, 3.0), rotation));
            // Half a degree near the pole at ±90°, where single-precision Euler angles degenerate.
            let tolerance = if pitch.abs() > 85.0 { 0.5 } else { 0.01 };
            prop_assert!((back.pitch - pitch).abs() < tolerance);
            prop_assert!((back.yaw - yaw).abs() < tolerance);
            prop_assert!((back.roll - roll).abs() < tolerance);
        }
    }
}
