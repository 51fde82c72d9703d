//! The topics of one vehicle.

use schemas::ActorState;
use serde_json::{Value, json};

use crate::convert::{EGO_FRAME, MAP_FRAME, pose, time, transforms, vector};
use crate::topics::{self, Topic};

/// Of a place whose type of covariance is 0: unknown.
const UNKNOWN_COVARIANCE: [f64; 9] = [0.0; 9];

/// All of them. Odometry has its velocities in the frame of the ego, as ROS has them.
pub(crate) fn messages(ego: &ActorState, map: &roads::Map, now: u64) -> [(Topic, Value); 5] {
    let (stamp, place) = (time(now), &ego.world_from_actor);
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
    let on_earth = [on_earth.latitude_deg, on_earth.longitude_deg, on_earth.altitude_m];
    [
        (Topic::Tf, transforms(EGO_FRAME, place, now)),
        (Topic::Odometry, odometry),
        (Topic::Pose, in_map),
        (Topic::Fix, fix(EGO_FRAME, now, on_earth)),
        (Topic::State, topics::state(ego)),
    ]
}

/// A place on Earth.
pub(crate) fn fix(frame_id: &str, now: u64, [latitude, longitude, altitude]: [f64; 3]) -> Value {
    json!({
        "timestamp": time(now),
        "frame_id": frame_id,
        "latitude": latitude,
        "longitude": longitude,
        "altitude": altitude,
        "position_covariance": UNKNOWN_COVARIANCE,
        "position_covariance_type": 0,
    })
}
