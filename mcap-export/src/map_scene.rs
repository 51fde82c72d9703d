//! The map as lines: the edges of its driving lanes.

use nalgebra::Point3;
use roads::{Map, Waypoint};
use serde_json::{Value, json};

use crate::convert::{Entity, opaque, pose};

/// From one point of an edge to the next.
const STEP_M: f64 = 2.0;
/// How wide a line is drawn.
const LINE_M: f64 = 0.1;
const GREY: [f32; 3] = [0.8, 0.8, 0.8];
/// Line segments of two points each.
const LINE_LIST: u8 = 2;
/// Points at most, so that the largest maps stay one message that viewers take.
const POINTS_MAX: usize = 400_000;

/// The scene of a map, which does not change.
pub(crate) fn of(map: &Map, now: u64) -> Value {
    let mut points: Vec<Value> = Vec::new();
    for (from, to) in map.driving_lanes() {
        let mut here = from;
        let mut edges = edges_at(map, &here);
        for _ in 0..((to.s - from.s).abs() / STEP_M) as usize {
            let next = map.next(&here, STEP_M).into_iter().next();
            let is_same = |next: &Waypoint| (next.road, next.lane) == (here.road, here.lane);
            let Some(next) = next.filter(is_same) else { break };
            let there = edges_at(map, &next);
            if points.len() < POINTS_MAX {
                for (one, other) in edges.iter().zip(&there) {
                    points.extend([one, other].map(|at| json!({"x": at.x, "y": at.y, "z": at.z})));
                }
            }
            (here, edges) = (next, there);
        }
    }
    let none: [Value; 0] = [];
    let mut entity = Entity::new("lanes");
    entity.lines.push(json!({
        "type": LINE_LIST,
        "pose": pose(&schemas::Pose::identity()),
        "thickness": LINE_M,
        "scale_invariant": false,
        "points": points,
        "color": opaque(GREY),
        "colors": none,
        "indices": none,
    }));
    json!({"deletions": none, "entities": [entity.message(now)]})
}

/// The left and the right edge of a lane.
fn edges_at(map: &Map, at: &Waypoint) -> [Point3<f64>; 2] {
    let (pose, half_m) = (map.pose(at), map.lane(at).width_m / 2.0);
    [half_m, -half_m].map(|side_m| pose * Point3::new(0.0, side_m, 0.0))
}
