//! The topics of one vehicle.

use roads::LaneTypes;
use schemas::{ActorState, Frame, TrafficLightColour, Vec3};
use serde_json::{Value, json};

use crate::convert::{Entity, MAP_FRAME, opaque, pose, time, vector};
use crate::topic::Topic;
use crate::topics;

/// Of a place whose type of covariance is 0: unknown.
const UNKNOWN_COVARIANCE: [f64; 9] = [0.0; 9];

/// Of a way, in metres: two ends nearer than this are the same.
const SAME_END_M: f32 = 2.0;
const CAR: [f32; 3] = [0.2, 0.5, 1.0];

/// All of them, but for the way. Odometry has its velocities in the frame of the ego, as ROS has
/// them.
pub(crate) fn messages(
    frame: &Frame,
    ego: &ActorState,
    map: &roads::Map,
    (ego_frame, now): (&'static str, u64),
) -> [(Topic, Value); 4] {
    let (stamp, place) = (time(now), &ego.world_from_actor);
    let in_ego = |of| vector(place.rotation.inverse() * of);
    let odometry = json!({
        "timestamp": stamp,
        "frame_id": MAP_FRAME,
        "body_frame_id": ego_frame,
        "pose": pose(place),
        "linear_velocity": in_ego(ego.linear_velocity_mps),
        "angular_velocity": in_ego(ego.angular_velocity_radps),
    });
    let in_map = json!({"timestamp": stamp, "frame_id": MAP_FRAME, "pose": pose(place)});
    let point = place.translation.vector.cast::<f64>().into();
    let on_earth = map.geo_place(&point);
    let on_earth = [on_earth.latitude_deg, on_earth.longitude_deg, on_earth.altitude_m];
    let lane = map.inside(point, LaneTypes::DRIVING).map(|at| at.lane);
    let light = ego.traffic_light.and_then(|id| {
        let light = frame.traffic_lights.iter().find(|light| light.actor == id)?;
        Some(light.colour)
    });
    let state = topics::state(ego, lane, light.unwrap_or(TrafficLightColour::Unknown));
    [
        (Topic::Odometry, odometry),
        (Topic::Pose, in_map),
        (Topic::Fix, fix(ego_frame, now, on_earth)),
        (Topic::State, state),
    ]
}

/// The ego as a box that moves with its frame.
pub(crate) fn car(ego: &ActorState, ego_frame: &'static str, now: u64) -> Value {
    let mut entity = Entity::new(ego.id.get());
    entity.frame = ego_frame;
    let [x, y, z] = ego.box_centre_m.into();
    let centre = pose(&schemas::Pose::translation(x, y, z));
    let size = vector(ego.box_half_extent_m * 2.0);
    entity.cubes.push(json!({"pose": centre, "size": size, "color": opaque(CAR)}));
    let none: [Value; 0] = [];
    json!({"deletions": none, "entities": [entity.message(now)]})
}

/// The way that is told.
#[derive(Debug, Default)]
pub(crate) struct Way {
    /// Where the one leads that was told last.
    end_m: Option<Vec3>,
}

impl Way {
    /// A way through these places, if it leads elsewhere than the one before; without any, that
    /// there is none any more.
    pub(crate) fn tell(&mut self, places_m: &[Vec3], now: u64) -> Option<Value> {
        let end_m = places_m.last().copied();
        let is_same = match (self.end_m, end_m) {
            (Some(before), Some(end)) => (end - before).norm() < SAME_END_M,
            (before, end) => before == end,
        };
        if is_same {
            return None;
        }
        self.end_m = end_m;
        let ahead = |index: usize| {
            let (here, next) = (places_m[index], places_m.get(index + 1));
            let (from, to) = next
                .map_or_else(|| (places_m[index.saturating_sub(1)], here), |next| (here, *next));
            let heading_rad = (to.y - from.y).atan2(to.x - from.x);
            let turn = schemas::UnitQuaternion::from_axis_angle(&Vec3::z_axis(), heading_rad);
            pose(&schemas::Pose::from_parts(here.into(), turn))
        };
        let poses: Vec<Value> = (0..places_m.len()).map(ahead).collect();
        Some(json!({"timestamp": time(now), "frame_id": MAP_FRAME, "poses": poses}))
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_told_when_it_leads_elsewhere_and_when_it_ends() {
        let mut way = Way::default();
        let places = [Vec3::zeros(), Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
        assert!(way.tell(&[], 0).is_none());
        let told = way.tell(&places, 0).unwrap();
        let poses = told["poses"].as_array().unwrap();
        assert_eq!(poses.len(), 3);
        for pose in poses {
            assert!((pose["orientation"]["z"].as_f64().unwrap() - 0.5f64.sqrt()).abs() < 1e-6);
        }
        // Some metres on, the same way.
        assert!(way.tell(&places[1..], 1).is_none());
        assert!(way.tell(&places[..1], 2).is_some());
        assert_eq!(way.tell(&[], 3).unwrap()["poses"], json!([]));
    }
}
