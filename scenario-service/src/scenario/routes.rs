//! Where the lanes lead from a place: goals that can be reached.

use std::collections::{BTreeSet, VecDeque};

use super::lanes::{Lanes, Place};

/// Between two places looked at.
const STEP_M: f64 = 5.0;
/// Places looked at before the search is given up.
const PLACES_MAX: usize = 20_000;

/// A place and the shortest way to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    /// Where.
    pub(crate) place: Place,
    /// Along the lanes.
    pub(crate) route_m: f64,
    /// How much the way turns in all, whichever way.
    pub(crate) turned_rad: f64,
    /// About how long a normal driver takes from standstill, with nobody else on the road.
    pub(crate) drive_secs: f64,
}

/// A normal driver's highest speed, and how far below the limit it stays.
const SPEED_MPS_MAX: f64 = 50.0 / 3.6;
const MARGIN_MPS: f64 = 3.0 / 3.6;
/// Sideways acceleration in bends.
const CURVE_MPS2: f64 = 3.5;
/// To get under way and to stop; more is lost before and after bends, per radian.
const START_SECS: f64 = 5.0;
const TURN_SECS_PER_RAD: f64 = 1.5;

/// How long a normal driver takes for one step.
fn step_secs(lanes: Lanes<'_>, place: Place, turned_rad: f64) -> f64 {
    let limit_mps = lanes.speed_limit_mps(place).map_or(SPEED_MPS_MAX, |mps| mps - MARGIN_MPS);
    let bend_mps = (CURVE_MPS2 * STEP_M / turned_rad.max(1.0e-6)).sqrt();
    let mps = limit_mps.min(SPEED_MPS_MAX).min(bend_mps).max(1.0);
    STEP_M / mps + turned_rad * TURN_SECS_PER_RAD
}

/// Road, section, lane, and which piece of it.
type Piece = (u32, u32, i32, i64);

fn piece_of(place: Place) -> Piece {
    (place.road, place.section, place.lane, (place.s / STEP_M).floor() as i64)
}

/// Everything within a route of this length, without changing lanes; nearest first.
pub(crate) fn reachable(lanes: Lanes<'_>, from: Place, route_m_max: f64) -> Vec<Reached> {
    let start = Reached { place: from, route_m: 0.0, turned_rad: 0.0, drive_secs: START_SECS };
    let mut reached = vec![start];
    let mut seen = BTreeSet::from([piece_of(from)]);
    let mut pending = VecDeque::from([0]);
    while let Some(at) = pending.pop_front().and_then(|index: usize| reached.get(index).copied()) {
        let route_m = at.route_m + STEP_M;
        if route_m > route_m_max || reached.len() >= PLACES_MAX {
            continue;
        }
        for place in lanes.ways_ahead(at.place, STEP_M) {
            if seen.insert(piece_of(place)) {
                let turn_rad = lanes.turn_rad(at.place, place).abs();
                let turned_rad = at.turned_rad + turn_rad;
                let drive_secs = at.drive_secs + step_secs(lanes, place, turn_rad);
                pending.push_back(reached.len());
                reached.push(Reached { place, route_m, turned_rad, drive_secs });
            }
        }
    }
    reached
}

/// The pieces of lanes that a search came over.
pub(crate) struct Pieces(BTreeSet<Piece>);

/// For looking up many places.
pub(crate) fn pieces(reached: &[Reached]) -> Pieces {
    Pieces(reached.iter().map(|reached| piece_of(reached.place)).collect())
}

impl Pieces {
    /// Whether a place is among them or next to one.
    pub(crate) fn leads_to(&self, place: Place) -> bool {
        let (road, section, lane, piece) = piece_of(place);
        (piece - 1..=piece + 1).any(|piece| self.0.contains(&(road, section, lane, piece)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn what_is_reached_is_as_far_as_the_way_to_it_or_nearer() {
        let map = testing::map();
        let lanes = Lanes::new(&map);
        let from = lanes.spawn_places().next().unwrap();
        let reached = reachable(lanes, from, 200.0);
        assert!(reached.len() > 40, "{}", reached.len());
        let start_m = lanes.pose(from).translation.vector;
        for Reached { place, route_m, .. } in &reached {
            let straight_m = f64::from((lanes.pose(*place).translation.vector - start_m).norm());
            assert!(straight_m <= route_m + 0.5, "{straight_m} after {route_m}");
        }
        assert!(pieces(&reached).leads_to(from));
    }

    #[test]
    fn turns_add_up_and_what_lies_behind_is_not_ahead() {
        let map = testing::map();
        let lanes = Lanes::new(&map);
        let from = lanes.spawn_places().next().unwrap();
        let near = reachable(lanes, from, 20.0);
        let far = reachable(lanes, from, 600.0);
        assert!(near.len() < 10);
        assert!(far.iter().any(|reached| reached.turned_rad > 3.0));
        let near = pieces(&near);
        assert!(lanes.spawn_places().any(|place| !near.leads_to(place)));
    }
}
