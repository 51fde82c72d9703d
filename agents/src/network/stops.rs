//! The lines at which lights and signs hold traffic.

use roads::{Map, SignKind, Waypoint};

use super::{LaneId, Network, Place, Stop, StopLine};

/// Lines of one lane nearer to each other than this are one, in metres.
const SAME_LINE_M: f32 = 1.0;

/// Adds the stop lines of a map to the lanes of its network.
pub(super) fn mark(network: &mut Network, map: &Map) {
    for (index, light) in (0..).zip(map.traffic_lights().lights) {
        for place in light.boxes {
            add(network, &place.front, Stop::Light(index));
        }
    }
    for sign in map.traffic_signs() {
        let why = match sign.kind {
            SignKind::Stop => Stop::Sign,
            SignKind::Yield => Stop::Yield,
            SignKind::SpeedLimit { .. } => continue,
        };
        for place in sign.boxes {
            add(network, &place.front, why);
        }
    }
    for lane in &mut network.lanes {
        lane.stops.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        lane.stops.dedup_by(|a, b| a.why == b.why && (a.at_m - b.at_m).abs() < SAME_LINE_M);
    }
}

fn add(network: &mut Network, at: &Waypoint, why: Stop) {
    let Some(place) = network.place(at) else { return };
    if is_behind_junction(network, place) {
        return;
    }
    if let Some(lane) = network.lanes.get_mut(place.lane as usize) {
        lane.stops.push(StopLine { at_m: place.at_m, why });
    }
}

/// Whether a place is where a lane comes out of a junction, far from its end. Maps whose lights
/// speak to the wrong direction have lines there, of several lights that never show green together,
/// and who waited at them would stand in the junction.
fn is_behind_junction(network: &Network, at: Place) -> bool {
    const BEHIND_M: f32 = 5.0;
    const FROM_END_M: f32 = 10.0;
    let inside = |id: &LaneId| network.lane(*id).is_some_and(|lane| lane.junction.is_some());
    network.lane(at.lane).is_some_and(|lane| {
        let comes_out = !lane.previous.is_empty() && lane.previous.iter().all(inside);
        let is_early = at.at_m < BEHIND_M && lane.length_m() - at.at_m > FROM_END_M;
        lane.junction.is_none() && comes_out && is_early
    })
}
