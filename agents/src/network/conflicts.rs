//! Which ways through a junction come near each other.

use std::collections::BTreeMap;

use super::{Lane, LaneId, Network};

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
    let mut found: Vec<(LaneId, LaneId)> = Vec::new();
    for lanes in by_junction.values() {
        for (index, a) in lanes.iter().enumerate() {
            for b in lanes.iter().skip(index + 1) {
                let pair = network.lane(*a).zip(network.lane(*b));
                if pair.is_some_and(|(a, b)| meet(a, b)) {
                    found.extend([(*a, *b), (*b, *a)]);
                }
            }
        }
    }
    found.sort_unstable();
    for (lane, other) in found {
        if let Some(lane) = network.lanes.get_mut(lane as usize) {
            lane.conflicts.push(other);
        }
    }
}

fn meet(a: &Lane, b: &Lane) -> bool {
    let parts = a.previous.iter().any(|before| b.previous.contains(before));
    let follows = a.next.iter().any(|next| b.previous.is_empty() && b.next.contains(next));
    if parts && !follows {
        return false;
    }
    a.points.iter().any(|from| {
        b.points.iter().any(|to| {
            let apart = from.point_m - to.point_m;
            apart.xy().norm_squared() < NEAR_M * NEAR_M && apart.z.abs() < STOREY_M
        })
    })
}
