//! The lines at which lights and signs hold traffic.

use roads::{Map, SignKind, Waypoint};

use super::{LaneId, Network, Place, Stop, StopLine};

/// Lines of one lane nearer to each other than this are one, in metres.
const SAME_LINE_M: f32 = 1.0;

/// Adds the stop lines of a map to the lanes of its network.
pub(super) fn mark(network: &mut Network, map: &Map) {
    let lights = map.traffic_lights().lights;
    for (index, light) in (0..).zip(&lights) {
        for place in &light.boxes {
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
        lane.stops.dedup_by(|a, b| a.why == b.why && are_one(a, b));
    }
    for (index, light) in (0..).zip(&lights) {
        for held in &light.lanes {
            speak(network, held, index);
        }
    }
}

/// Notes a way through a junction to which a light speaks, on the lanes before it where another
/// light has the same line.
fn speak(network: &mut Network, held: &Waypoint, light: u32) {
    let held = network.place(held).and_then(|place| network.lane(place.lane));
    let Some(way) = held.filter(|lane| lane.junction.is_some()).map(|lane| lane.entered.lane)
    else {
        return;
    };
    let before = network.lane(way).map_or(Vec::new(), |lane| lane.previous.clone());
    for id in before {
        let Some(lane) = network.lanes.get_mut(id as usize) else { continue };
        let shares = |line: &StopLine| {
            let mut others = lane.stops.iter().filter(|other| other.why != line.why);
            others.any(|other| matches!(other.why, Stop::Light(_)) && are_one(line, other))
        };
        if lane.stops.iter().find(|line| line.why == Stop::Light(light)).is_some_and(shares) {
            lane.spoken.push((light, way));
        }
    }
}

/// Whether two lines of a lane are one.
pub(super) fn are_one(line: &StopLine, other: &StopLine) -> bool {
    (line.at_m - other.at_m).abs() < SAME_LINE_M
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

#[cfg(test)]
mod tests {
    use crate::network::{Lane, Stop};

    #[test]
    fn of_several_lights_at_one_line_those_hold_that_speak_to_the_way() {
        let lane = Lane { spoken: vec![(1, 7), (2, 8), (3, 8)], ..Lane::default() };
        let held = |next| [1, 2, 3].map(|light| lane.holds(Stop::Light(light), next));
        assert_eq!(held(Some(7)), [true, false, false]);
        assert_eq!(held(Some(8)), [false, true, true]);
        assert_eq!(held(Some(9)), [true; 3], "no light speaks to that way");
        assert_eq!(held(None), [true; 3]);
        assert!(lane.holds(Stop::Sign, Some(7)));
    }
}
