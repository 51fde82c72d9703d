//! The topics of one vehicle.

use schemas::ActorState;
use serde_json::{Value, json};

use crate::convert::{EGO_FRAME, MAP_FRAME, pose, quaternion, time, vector};
use crate::topics::{self, Topic};

/// Of a place whose type of covariance is 0: unknown.
const UNKNOWN_COVARIANCE: [f64; 9] = [0.0; 9];

/// All of them. Odometry has its velocities in the frame of the ego, as ROS has them.
pub(crate) fn messages(ego: &ActorState, map: &roads::Map, now: u64) -> [(Topic, Value); 5] {
    let (stamp, place) = (time(now), &ego.world_from_actor);
    let transform = json!({
        "timestamp": stamp,
        "parent_frame_id": MAP_FRAME,
        "child_frame_id": EGO_FRAME,
        "translation": vector(place.translation.vector),
        "rotation": quaternion(place),
    });
    let in_ego = |of| vector(place.rotation.inverse() * of);
    let odometry = json!({
        "timestamp": stamp,
        "frame_id": MAP_FRAME,
        "body_frame_id": EGO_FRAME,
        "pose": pose(place),
        "linear_velocity": in_ego(ego.linear_velocity_mps),
        "angular_velocity": in_ego(ego.angular_velocity_radps),
    });
    let in_map = json!({"timestamp": stamp, "frame_id": MAP_FRAME, "pose": pose(place)});
    let on_earth = map.geo_place(&place.translation.vector.cast::<f64>().into());
    let fix = json!({
        "timestamp": stamp,
        "frame_id": EGO_FRAME,
        "latitude": on_earth.latitude_deg,
        "longitude": on_earth.longitude_deg,
        "altitude": on_earth.altitude_m,
        "position_covariance": UNKNOWN_COVARIANCE,
        "position_covariance_type": 0,
    });
    let control = &ego.control;
    let state = topics::state(&[
        ego.linear_velocity_mps.norm(),
        ego.linear_acceleration_mps2.norm(),
        control.throttle,
        control.brake,
        control.steer,
        f32::from(ego.gear),
        ego.speed_limit_mps,
        ego.road_wheel_rad,
    ]);
    [
        (Topic::Tf, json!({"transforms": [transform]})),
        (Topic::Odometry, odometry),
        (Topic::Pose, in_map),
        (Topic::Fix, fix),
        (Topic::State, state),
    ]
}
