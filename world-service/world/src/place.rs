//! Where a thing comes to stand when it is put near the ground.

use blueprints::{VehicleModel, WalkerModel};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use schemas::{Pose, Translation3, Vec3};

use crate::blueprint::{Blueprint, BodySpec};
use crate::ground::Ground;

/// A thing put at most this far above or below its place on the ground is put onto it.
const REACH_M: f32 = 1.5;
/// A wheel this deep in the ground is still lifted by its spring alone.
const SINK_M: f32 = 0.04;
/// Width over which the ground under a two-wheeler is levelled.
const TRACK_M_MIN: f32 = 0.3;
/// A thing tilted by more than this is meant to fall (cosine of 45°).
const UPRIGHT: f32 = 0.7;

/// Where something is put.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub world_from_actor: Pose,
    /// Whether it stands on the ground, at rest.
    pub standing: bool,
}

/// The wanted pose, but for a vehicle that would sink into the ground or a walker near it: those
/// are set onto it.
pub(crate) fn exactly(blueprint: &Blueprint, wanted: &Pose, ground: &Ground) -> Placed {
    match &blueprint.body {
        BodySpec::Vehicle(model) if !is_sunk(model, wanted, ground) => {
            Placed { world_from_actor: *wanted, standing: false }
        }
        _ => on_ground(blueprint, wanted, ground),
    }
}

/// Whether a wheel is deeper in the ground than its spring forgives.
fn is_sunk(model: &VehicleModel, wanted: &Pose, ground: &Ground) -> bool {
    corners_xy_m(model).into_iter().any(|(x_m, y_m)| {
        let wheel_m = wanted.transform_point(&Vec3::new(x_m, y_m, 0.0).into()).coords;
        let surface = ground.below(wheel_m + Vec3::z() * REACH_M);
        surface.height_m - wheel_m.z > SINK_M
    })
}

/// The wanted pose, set onto the ground when it is near and upright.
pub(crate) fn on_ground(blueprint: &Blueprint, wanted: &Pose, ground: &Ground) -> Placed {
    let upright = (wanted.rotation * Vec3::z()).z > UPRIGHT;
    let placed = match &blueprint.body {
        BodySpec::Vehicle(model) => vehicle_on_ground(model, wanted, ground),
        BodySpec::Walker(model) => walker_on_ground(model, wanted, ground),
        BodySpec::Prop(_) | BodySpec::None(_) => *wanted,
    };
    let lift_m = placed.translation.z - wanted.translation.z;
    if upright && lift_m.abs() <= REACH_M {
        Placed { world_from_actor: placed, standing: true }
    } else {
        Placed { world_from_actor: *wanted, standing: false }
    }
}

/// Where a vehicle stands: front left, front right, rear left, rear right.
fn corners_xy_m(model: &VehicleModel) -> [(f32, f32); 4] {
    let base_m = model.wheelbase_m / 2.0;
    let track_m = model.track_m.max(TRACK_M_MIN) / 2.0;
    [(base_m, track_m), (base_m, -track_m), (-base_m, track_m), (-base_m, -track_m)]
}

/// All wheels on the plane through the ground under them, heading kept.
fn vehicle_on_ground(model: &VehicleModel, wanted: &Pose, ground: &Ground) -> Pose {
    let [front_left, front_right, rear_left, rear_right] = corners_xy_m(model).map(|(x_m, y_m)| {
        let point_m = wanted.transform_point(&Vec3::new(x_m, y_m, 0.0).into()).coords;
        let surface = ground.below(point_m + Vec3::z() * REACH_M);
        Vec3::new(point_m.x, point_m.y, surface.height_m)
    });
    let forward = front_left + front_right - rear_left - rear_right;
    let left = front_left + rear_left - front_right - rear_right;
    let centre_m = (front_left + front_right + rear_left + rear_right) / 4.0;
    let up = forward.cross(&left);
    let rotation = rotation_from_axes(forward, up).unwrap_or(wanted.rotation);
    Pose::from_parts(Translation3::from(centre_m), rotation)
}

/// Upright, the lower end on the ground, heading kept.
fn walker_on_ground(model: &WalkerModel, wanted: &Pose, ground: &Ground) -> Pose {
    let centre_m = wanted.translation.vector;
    let foot_m = centre_m - Vec3::z() * (model.height_m / 2.0);
    let surface = ground.below(foot_m + Vec3::z() * REACH_M);
    let standing_m = Vec3::new(centre_m.x, centre_m.y, surface.height_m + model.height_m / 2.0);
    let heading = wanted.rotation * Vec3::x();
    let rotation = rotation_from_axes(heading, Vec3::z()).unwrap_or(wanted.rotation);
    Pose::from_parts(Translation3::from(standing_m), rotation)
}

/// The rotation with this up axis whose x axis comes nearest to `forward`.
pub(crate) fn rotation_from_axes(forward: Vec3, up: Vec3) -> Option<UnitQuaternion<f32>> {
    let up = up.try_normalize(1.0e-6)?;
    let left = up.cross(&forward).try_normalize(1.0e-6)?;
    let axes = Matrix3::from_columns(&[left.cross(&up), left, up]);
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)))
}

#[cfg(test)]
mod tests {
    use schemas::level_pose;

    use super::*;
    use crate::blueprint;

    fn slope() -> Ground {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.1 * x);
        Ground::new([
            ([at(-50.0, -50.0), at(50.0, -50.0), at(50.0, 50.0)], 1.0),
            ([at(-50.0, -50.0), at(50.0, 50.0), at(-50.0, 50.0)], 1.0),
        ])
    }

    fn blueprint(id: &str) -> &'static Blueprint {
        blueprint::get(blueprint::index_of(id).unwrap()).unwrap()
    }

    #[test]
    fn a_vehicle_lies_along_the_slope_and_keeps_its_heading() {
        let wanted = level_pose(Vec3::new(3.0, 4.0, 0.8), 1.0);
        let placed = on_ground(blueprint("vehicle.lincoln.mkz"), &wanted, &slope());
        assert!(placed.standing);
        let pose = placed.world_from_actor;
        assert!((pose.translation.z - 0.3).abs() < 1.0e-3, "{pose}");
        let up = pose.rotation * Vec3::z();
        assert!((up.x / up.z + 0.1).abs() < 1.0e-3, "{up}");
        assert!((schemas::yaw_rad(&pose) - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_walker_stands_upright_on_its_feet() {
        let wanted = level_pose(Vec3::new(10.0, 0.0, 1.0 + 0.5), 0.0);
        let placed = on_ground(blueprint("walker.pedestrian.0001"), &wanted, &slope());
        assert!(placed.standing);
        assert!((placed.world_from_actor.translation.z - (1.0 + 0.875)).abs() < 1.0e-3);
    }

    #[test]
    fn what_is_high_in_the_air_stays_there() {
        let wanted = level_pose(Vec3::new(0.0, 0.0, 8.0), 0.0);
        let placed = on_ground(blueprint("vehicle.lincoln.mkz"), &wanted, &slope());
        assert!(!placed.standing);
        assert_eq!(placed.world_from_actor, wanted);
    }
}
