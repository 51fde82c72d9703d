//! Roundabouts, which maps do not name: lanes that lead around a circle.

use schemas::Vec3;

use super::{Lane, LaneId, Network, wrapped};

/// Longest way around, and most lanes of it.
const AROUND_M_MAX: f32 = 300.0;
const LANES_MAX: usize = 64;
/// Way around over the mean distance from the middle, off a whole turn; of a square 0.7.
const OFF_RAD_MAX: f32 = 0.5;
/// Nearest and farthest place of a ring from its middle, over the mean; a square has up to 1.23.
const ROUND: std::ops::Range<f32> = 0.85..1.15;
/// A lane between two junctions of a ring bends, unless it is shorter than this, over the mean: the
/// sides of an octagon are 0.77, those of a square of houses 0.9 and more.
const STRAIGHT_MAX: f32 = 0.8;
/// How much of a circle's bend, at least.
const BENT_MIN: f32 = 0.5;
/// Junctions of a ring at least: a loop with fewer is a bend or a place to turn back.
const JUNCTIONS_MIN: usize = 2;

/// Marks the lanes of rings, and the ways through junctions that lead onto one.
pub(super) fn mark(network: &mut Network) {
    let ids = 0..network.lanes.len() as LaneId;
    let rings: Vec<Vec<LaneId>> = ids
        .flat_map(|id| [(id, 1.0), (id, -1.0)])
        .filter_map(|(id, side)| around(network, id, side))
        .collect();
    for id in rings.into_iter().flatten() {
        if let Some(lane) = network.lanes.get_mut(id as usize) {
            lane.is_ring = true;
        }
    }
    let is_ring = |id: &LaneId| network.lane(*id).is_some_and(|lane| lane.is_ring);
    let enters: Vec<bool> = (0..)
        .zip(&network.lanes)
        .map(|(id, lane)| {
            let first = network.lane(lane.entered.lane);
            let last = network.through(id).last().and_then(|last| network.lane(last));
            let from_ring = first.is_some_and(|first| first.previous.iter().any(is_ring));
            let to_ring = last.is_some_and(|last| last.next.iter().any(is_ring));
            lane.junction.is_some() && !lane.is_ring && !from_ring && to_ring
        })
        .collect();
    for (lane, enters) in network.lanes.iter_mut().zip(enters) {
        lane.enters_ring = enters;
    }
}

/// The lanes of the circle on which a lane lies, if it does: `side` is 1 to the left, -1 to the
/// right.
fn around(network: &Network, start: LaneId, side: f32) -> Option<Vec<LaneId>> {
    if network.lane(start)?.junction.is_some() {
        return None;
    }
    let (mut lanes, mut at, mut length_m) = (Vec::new(), start, 0.0);
    loop {
        let lane = network.lane(at)?;
        lanes.push(at);
        length_m += lane.length_m();
        if length_m > AROUND_M_MAX || lanes.len() > LANES_MAX {
            return None;
        }
        at = onward(network, lane, side)?;
        if at == start {
            return is_circle(network, &lanes).then_some(lanes);
        }
    }
}

/// The way on that turns most to a side: around a circle, and past the ways out of it.
fn onward(network: &Network, lane: &Lane, side: f32) -> Option<LaneId> {
    let turn = |id: &&LaneId| network.lane(**id).map_or(0.0, |next| side * turned_rad(next));
    lane.next.iter().max_by(|a, b| turn(a).total_cmp(&turn(b))).copied()
}

/// How far a lane turns, to the left.
fn turned_rad(lane: &Lane) -> f32 {
    let turns = lane.points.windows(2).map(|pair| pair[1].heading_rad - pair[0].heading_rad);
    turns.map(wrapped).sum()
}

fn is_circle(network: &Network, lanes: &[LaneId]) -> bool {
    let lanes: Vec<&Lane> = lanes.iter().filter_map(|id| network.lane(*id)).collect();
    let junctions = lanes.iter().filter(|lane| lane.junction.is_some()).count();
    let places = || lanes.iter().flat_map(|lane| lane.points.iter().map(|point| point.point_m));
    let count = places().count().max(1) as f32;
    let middle_m = places().sum::<Vec3>() / count;
    let away_m = || places().map(|at| (at - middle_m).xy().norm());
    let mean_m = away_m().sum::<f32>() / count;
    let round = away_m().all(|away_m| ROUND.contains(&(away_m / mean_m.max(1.0))));
    let whole_m: f32 = lanes.iter().map(|lane| lane.length_m()).sum();
    let off_rad = (whole_m / mean_m.max(1.0) - std::f32::consts::TAU).abs();
    let bends = lanes.iter().filter(|lane| lane.junction.is_none()).all(|lane| {
        let share = lane.length_m() / mean_m.max(1.0);
        share < STRAIGHT_MAX || turned_rad(lane).abs() > BENT_MIN * share
    });
    junctions >= JUNCTIONS_MIN && round && bends && off_rad < OFF_RAD_MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(town: &str) -> Network {
        let text = roads::town::build(town).unwrap();
        Network::new(&roads::Map::parse(town, &text).unwrap())
    }

    #[test]
    fn the_roundabout_of_a_town_is_found_with_its_ways_in_and_no_block_of_houses() {
        let network = network("Town03_Opt");
        let ring = network.lanes.iter().filter(|lane| lane.is_ring).count();
        let enter = network.lanes.iter().filter(|lane| lane.enters_ring).count();
        assert!(ring >= 8 && enter >= 4, "{ring}, {enter}");
        for town in ["Town01_Opt", "Town02_Opt", "Town10HD_Opt"] {
            let network = self::network(town);
            assert!(!network.lanes.iter().any(|lane| lane.is_ring || lane.enters_ring), "{town}");
        }
    }
}
