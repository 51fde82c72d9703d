//! Which ways through a junction come near each other.

use std::collections::BTreeMap;

use super::{Conflict, Lane, LaneId, Network};

/// Vehicles on lanes whose middles come nearer than this would touch, in metres.
const NEAR_M: f32 = 2.7;
/// No car turns more tightly. Who comes out of a tighter bend is so far beside its lane, at most.
const CURVATURE_PER_M_MAX: f32 = 0.2;
const BESIDE_M: f32 = 1.0;
/// Lanes higher or lower than this cross without meeting.
const STOREY_M: f32 = 3.0;

/// Finds the conflicts of all lanes of junctions. Lanes that part at their beginning do not count:
/// there, one vehicle follows the other.
pub(super) fn find(network: &mut Network) {
    let mut by_junction: BTreeMap<u32, Vec<LaneId>> = BTreeMap::new();
    for (id, lane) in (0..).zip(&network.lanes) {
        if let Some(junction) = lane.junction {
            by_junction.entry(junction).or_default().push(id);
        }
    }
    let mut found: Vec<(LaneId, Conflict)> = Vec::new();
    for lanes in by_junction.values() {
        for (index, a) in lanes.iter().enumerate() {
            for b in lanes.iter().skip(index + 1) {
                let met = network.lane(*a).zip(network.lane(*b)).and_then(|(a, b)| meet(a, b));
                let Some([(from_a_m, until_a_m), (from_b_m, until_b_m)]) = met else { continue };
                found.push((*a, Conflict { lane: *b, from_m: from_a_m, until_m: until_a_m }));
                found.push((*b, Conflict { lane: *a, from_m: from_b_m, until_m: until_b_m }));
            }
        }
    }
    for (lane, conflict) in found {
        if let Some(lane) = network.lanes.get_mut(lane as usize) {
            lane.conflicts.push(conflict);
        }
    }
    for lane in &mut network.lanes {
        lane.conflicts.sort_unstable_by_key(|conflict| conflict.lane);
    }
}

/// Where on each of two lanes the other one comes near and is left behind, if they meet.
fn meet(a: &Lane, b: &Lane) -> Option<[(f32, f32); 2]> {
    let parts = a.previous.iter().any(|before| b.previous.contains(before));
    let follows = a.next.iter().any(|next| b.previous.is_empty() && b.next.contains(next));
    if parts && !follows {
        return None;
    }
    let [beside_a_m, beside_b_m] = [a, b].map(too_tight_from_m);
    let mut met: Option<[(f32, f32); 2]> = None;
    for from in &a.points {
        for to in &b.points {
            let apart = from.point_m - to.point_m;
            let is_beside = from.at_m >= beside_a_m || to.at_m >= beside_b_m;
            let near_m = if is_beside { NEAR_M + BESIDE_M } else { NEAR_M };
            if apart.xy().norm_squared() < near_m * near_m && apart.z.abs() < STOREY_M {
                let here = [(from.at_m, from.at_m), (to.at_m, to.at_m)];
                let [on_a, on_b] = met.unwrap_or(here);
                met = Some([widened(on_a, from.at_m), widened(on_b, to.at_m)]);
            }
        }
    }
    met
}

/// From where on vehicles may be beside a lane, as it bends more tightly there than they turn;
/// endless if it does nowhere.
fn too_tight_from_m(lane: &Lane) -> f32 {
    let mut points = lane.points.iter();
    let tight = points.find(|point| point.curvature_per_m.abs() > CURVATURE_PER_M_MAX);
    tight.map_or(f32::INFINITY, |point| point.at_m)
}

fn widened((from_m, until_m): (f32, f32), at_m: f32) -> (f32, f32) {
    (from_m.min(at_m), until_m.max(at_m))
}

#[cfg(test)]
mod tests {
    use schemas::Vec3;

    use super::*;
    use crate::network::LanePoint;

    /// A lane straight ahead, as far to the left as said, that bends so much from 10 m on.
    fn lane(left_m: f32, curvature_per_m: f32) -> Lane {
        let point = |at_m: f32| LanePoint {
            at_m,
            point_m: Vec3::new(at_m, left_m, 0.0),
            heading_rad: 0.0,
            curvature_per_m: if at_m < 10.0 { 0.0 } else { curvature_per_m },
            limit_mps: 0.0,
            width_m: 3.5,
        };
        let points = (0..=10).map(|step| point(2.0 * step as f32)).collect();
        Lane { points, ..Lane::default() }
    }

    #[test]
    fn who_comes_out_of_a_bend_too_tight_for_cars_may_be_on_the_lane_beside() {
        let beside = lane(3.5, 0.0);
        assert_eq!(meet(&lane(0.0, 0.19), &beside), None);
        let met = meet(&lane(0.0, 0.25), &beside);
        assert_eq!(met, Some([(10.0, 20.0), (10.0, 20.0)]));
        assert_eq!(meet(&lane(0.0, 0.25), &lane(4.0, 0.0)), None);
    }
}
