//! Which ways through a junction come near each other.

use std::collections::BTreeMap;

use super::{Conflict, Lane, LaneId, Network};

/// Vehicles on lanes whose middles come nearer than this would touch, in metres.
const NEAR_M: f32 = 2.7;
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
    let mut met: Option<[(f32, f32); 2]> = None;
    for from in &a.points {
        for to in &b.points {
            let apart = from.point_m - to.point_m;
            if apart.xy().norm_squared() < NEAR_M * NEAR_M && apart.z.abs() < STOREY_M {
                let here = [(from.at_m, from.at_m), (to.at_m, to.at_m)];
                let [on_a, on_b] = met.unwrap_or(here);
                met = Some([widened(on_a, from.at_m), widened(on_b, to.at_m)]);
            }
        }
    }
    met
}

fn widened((from_m, until_m): (f32, f32), at_m: f32) -> (f32, f32) {
    (from_m.min(at_m), until_m.max(at_m))
}
