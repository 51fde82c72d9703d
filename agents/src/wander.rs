//! A path without a destination: any way that goes on.

use roads::Map;

use crate::network::{LaneId, Network, Place};
use crate::path::{Leg, Path};
use crate::pilot::VehicleView;

/// Most lanes that are added to a path in one tick.
pub(crate) const LANES_MAX: usize = 64;

/// Begins an empty path on the vehicle's lane.
pub(crate) fn begin(path: &mut Path, network: &Network, map: &Map, view: &VehicleView) {
    if !path.is_empty() {
        return;
    }
    let place = network.vehicle_place(map, &view.world_from_vehicle);
    let place = place.and_then(|place| Some((place, network.lane(place.lane)?)));
    if let Some((Place { lane: id, at_m }, lane)) = place {
        path.push(Leg { lane: id, from_m: at_m, to_m: lane.length_m(), onto: None });
    }
}

/// Adds lanes until so much way is ahead, for a vehicle that can start on a climb of this sine.
pub(crate) fn extend(
    path: &mut Path,
    network: &Network,
    (wanted_m, climb_max): (f32, f32),
    draw: &mut dyn FnMut() -> u64,
) {
    for _ in 0..LANES_MAX {
        let last = path.last().filter(|_| path.length_m() < wanted_m);
        let leg = last.and_then(|last| any_next(network, last, climb_max, draw));
        let Some(leg) = leg else { return };
        path.push(leg);
    }
}

/// The next lane of a path, by choice among those that go on and do not climb too steeply; the
/// least steep ones where all do.
fn any_next(
    network: &Network,
    last: &Leg,
    climb_max: f32,
    draw: &mut dyn FnMut() -> u64,
) -> Option<Leg> {
    let mut choice = network.going_on(&network.lane(last.last_lane())?.next);
    let climb = |id: &LaneId| network.lane(*id).map_or(f32::INFINITY, |lane| lane.climb);
    let least = choice.iter().map(climb).fold(f32::INFINITY, f32::min);
    choice.retain(|id| climb(id) <= climb_max.max(least));
    let index = match choice.len() {
        0 => return None,
        1 => 0,
        count => (draw() % count as u64) as usize,
    };
    let lane = *choice.get(index)?;
    Some(Leg { lane, from_m: 0.0, to_m: network.lane(lane)?.length_m(), onto: None })
}
