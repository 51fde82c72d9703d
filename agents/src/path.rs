//! A way over lanes, from where a vehicle is.

mod change;
mod longer;

use std::cell::Cell;
use std::collections::VecDeque;

use nalgebra::{ComplexField, Vector2};
use schemas::Vec3;
use serde::{Deserialize, Serialize};

use crate::network::{Lane, LaneId, LanePoint, Network, Place, Stop, wrapped};
pub(crate) use change::NextChange;

/// Samples for which there is room at once.
const POINTS: usize = 128;

thread_local! {
    /// Used again from driver to driver.
    static ROOM: Cell<Vec<PathPoint>> = const { Cell::new(Vec::new()) };
}

/// Works with room for the samples of a way; whatever is in it is left from before.
pub(crate) fn with_room<T>(work: impl FnOnce(&mut Vec<PathPoint>) -> T) -> T {
    let mut points = ROOM.take();
    let result = work(&mut points);
    ROOM.set(points);
    result
}

/// One lane of the way, or the change from it to the lane beside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Leg {
    pub lane: LaneId,
    pub from_m: f32,
    pub to_m: f32,
    /// The lane beside on which the leg ends.
    pub onto: Option<LaneId>,
}

/// Legs ahead of a vehicle, the first of them under it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Path {
    legs: VecDeque<Leg>,
    /// Where on the first leg the vehicle is, from the entry of the leg's lane.
    at_m: f32,
}

/// A place on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PathPoint {
    pub point: LanePoint,
    /// From the vehicle.
    pub ahead_m: f32,
}

/// A stop line on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StopAhead {
    pub lane: LaneId,
    /// From the vehicle's origin; a little below zero for a line just passed.
    pub ahead_m: f32,
    pub why: Stop,
}

impl Leg {
    pub(crate) fn length_m(&self) -> f32 {
        self.to_m - self.from_m
    }

    /// The lane it ends on.
    pub(crate) fn last_lane(&self) -> LaneId {
        self.onto.unwrap_or(self.lane)
    }

    /// The way at a distance from the entry of the leg's lane.
    pub(crate) fn point(&self, network: &Network, at_m: f32) -> Option<LanePoint> {
        let lane = network.lane(self.lane)?;
        let own = lane.at(at_m);
        let Some(onto) = self.onto.and_then(|onto| network.lane(onto)) else { return Some(own) };
        let length_m = self.length_m().max(1.0e-3);
        let share = ((at_m - self.from_m) / length_m).clamp(0.0, 1.0);
        let other = onto.at(lane.abreast_m(at_m, onto));
        Some(blend(&own, &other, share, length_m))
    }
}

/// Between two lanes: a quintic from one to the other, which begins and ends without course or
/// bend.
fn blend(own: &LanePoint, other: &LanePoint, u: f32, length_m: f32) -> LanePoint {
    let way = u * u * u * (10.0 + u * (-15.0 + 6.0 * u));
    let slope = 30.0 * u * u * (1.0 - u) * (1.0 - u) / length_m;
    let bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (length_m * length_m);
    let across = other.point_m - own.point_m;
    let (sin, cos) = (ComplexField::sin(own.heading_rad), ComplexField::cos(own.heading_rad));
    let left_m = -across.x * sin + across.y * cos;
    LanePoint {
        point_m: own.point_m + across * way,
        heading_rad: own.heading_rad + ComplexField::atan(left_m * slope),
        curvature_per_m: own.curvature_per_m + left_m * bend,
        ..*own
    }
}

impl Path {
    pub(crate) fn is_empty(&self) -> bool {
        self.legs.is_empty()
    }

    /// Whether all that it names exists; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self, network: &Network) -> bool {
        let exists = |leg: &Leg| {
            network.lane(leg.lane).is_some()
                && leg.onto.is_none_or(|onto| network.lane(onto).is_some())
                && leg.from_m.is_finite()
                && leg.to_m.is_finite()
        };
        self.at_m.is_finite() && self.legs.iter().all(exists)
    }

    /// Where the vehicle is: the lane it is on or, in the second half of a change, going to.
    pub(crate) fn place(&self, network: &Network) -> Option<Place> {
        let leg = self.legs.front()?;
        let at = Place { lane: leg.lane, at_m: self.at_m };
        let Some(onto) = leg.onto.filter(|_| self.at_m > f32::midpoint(leg.from_m, leg.to_m))
        else {
            return Some(at);
        };
        let (from, to) = (network.lane(leg.lane)?, network.lane(onto)?);
        Some(Place { lane: onto, at_m: from.abreast_m(self.at_m, to) })
    }

    /// The lane of the first leg.
    pub(crate) fn own<'n>(&self, network: &'n Network) -> Option<(LaneId, &'n Lane)> {
        let leg = self.legs.front()?;
        Some((leg.lane, network.lane(leg.lane)?))
    }

    pub(crate) fn length_m(&self) -> f32 {
        let whole: f32 = self.legs.iter().map(Leg::length_m).sum();
        let driven_m = self.legs.front().map_or(0.0, |leg| self.at_m - leg.from_m);
        (whole - driven_m).max(0.0)
    }

    pub(crate) fn push(&mut self, leg: Leg) {
        if self.legs.is_empty() {
            self.at_m = leg.from_m;
        }
        self.legs.push_back(leg);
    }

    pub(crate) fn last(&self) -> Option<&Leg> {
        self.legs.back()
    }

    /// Drops the legs that begin at a distance or beyond, but never the one under the vehicle.
    pub(crate) fn cut(&mut self, from_m: f32) {
        let kept = self.ahead().take_while(|(begins_m, _)| *begins_m + 0.01 < from_m).count();
        self.legs.truncate(kept.max(1));
    }

    /// Moves along by a distance; legs that were driven fall away.
    pub(crate) fn go(&mut self, distance_m: f32) {
        self.at_m += distance_m;
        while let Some(leg) = self.legs.front()
            && self.at_m > leg.to_m
        {
            let over_m = self.at_m - leg.to_m;
            if self.legs.len() == 1 {
                self.at_m = leg.to_m;
                break;
            }
            self.legs.pop_front();
            self.at_m = self.legs.front().map_or(0.0, |leg| leg.from_m) + over_m;
        }
    }

    /// Moves the place abreast of the vehicle, never back; tells by how much.
    pub(crate) fn follow(&mut self, network: &Network, position_m: &Vec3) -> f32 {
        let mut before_m = None;
        for _ in 0..3 {
            let Some(ahead_m) = self.passed_m(network, position_m) else { break };
            before_m.get_or_insert_with(|| self.length_m());
            self.go(ahead_m);
        }
        before_m.map_or(0.0, |before_m| (before_m - self.length_m()).max(0.0))
    }

    /// How far ahead of its place the vehicle is, if it is worth a move.
    fn passed_m(&self, network: &Network, position_m: &Vec3) -> Option<f32> {
        let here = self.at(network, 0.0)?;
        let away = position_m - here.point.point_m;
        // Who moves along its way without dynamics is there.
        if away.xy() == Vector2::zeros() {
            return None;
        }
        let heading = here.point.heading();
        let ahead_m = away.x * heading.x + away.y * heading.y;
        (ahead_m >= 0.01).then_some(ahead_m)
    }

    /// The path some metres ahead; at its end for more than is left.
    pub(crate) fn at(&self, network: &Network, ahead_m: f32) -> Option<PathPoint> {
        let mut at_m = self.at_m + ahead_m;
        let mut legs = self.legs.iter().peekable();
        while let Some(leg) = legs.next() {
            if at_m <= leg.to_m || legs.peek().is_none() {
                let over_m = (at_m - leg.to_m).max(0.0);
                let point = leg.point(network, at_m.min(leg.to_m))?;
                return Some(PathPoint { point, ahead_m: ahead_m - over_m });
            }
            at_m = at_m - leg.to_m + legs.peek().map_or(0.0, |next| next.from_m);
        }
        None
    }

    /// Points of the path from the vehicle to a distance, every `step_m` and at the end.
    pub(crate) fn sample(
        &self,
        network: &Network,
        horizon_m: f32,
        step_m: f32,
        points: &mut Vec<PathPoint>,
    ) {
        points.clear();
        points.reserve(((horizon_m / step_m) as usize + 2).min(POINTS));
        let mut ahead_m = 0.0;
        let mut done_m = 0.0;
        for (index, leg) in self.legs.iter().enumerate() {
            let start_m = if index == 0 { self.at_m } else { leg.from_m };
            let length_m = (leg.to_m - start_m).max(0.0);
            let lane = network.lane(leg.lane).filter(|_| leg.onto.is_none());
            let mut after = lane.filter(|_| start_m > 0.0).map_or(0, |lane| lane.after(start_m));
            let until_m = done_m + length_m;
            while ahead_m <= until_m && ahead_m <= horizon_m {
                let at_m = start_m + ahead_m - done_m;
                if let Some(lane) = lane {
                    points.push(PathPoint { point: lane.at_next(at_m, &mut after), ahead_m });
                } else if let Some(point) = leg.point(network, at_m) {
                    points.push(PathPoint { point, ahead_m });
                }
                ahead_m += step_m;
            }
            done_m += length_m;
            if done_m >= horizon_m {
                return;
            }
        }
        if let Some(end) = self.at(network, done_m) {
            points.push(end);
        }
    }

    /// Whether it leads over a lane soon that bends more than this somewhere.
    pub(crate) fn is_tight(&self, network: &Network, within_m: f32, bend_per_m: f32) -> bool {
        let mut near = self.ahead().take_while(|(begins_m, _)| *begins_m <= within_m);
        near.any(|(_, leg)| network.lane(leg.lane).is_some_and(|it| it.bend_per_m > bend_per_m))
    }

    /// Where it leads, from the vehicle on and at most so far, a point every `step_m` and at the
    /// end.
    pub(crate) fn places_m(&self, network: &Network, step_m: f32, most: usize) -> Vec<Vec3> {
        let mut points = Vec::new();
        let horizon_m = step_m * most.saturating_sub(2) as f32;
        self.sample(network, horizon_m, step_m, &mut points);
        points.iter().map(|at| at.point.point_m).collect()
    }

    /// Legs with the distance from the vehicle at which each begins; the first begins behind it.
    pub(crate) fn ahead(&self) -> impl Iterator<Item = (f32, &Leg)> {
        let mut begins_m = self.legs.front().map_or(0.0, |leg| leg.from_m - self.at_m);
        self.legs.iter().map(move |leg| {
            let at_m = begins_m;
            begins_m += leg.length_m();
            (at_m, leg)
        })
    }

    /// Stop lines up to a distance, nearest first, from `behind_m` behind the vehicle's origin on.
    pub(crate) fn stops(&self, network: &Network, behind_m: f32, horizon_m: f32) -> Vec<StopAhead> {
        self.lines(network, behind_m, horizon_m).collect()
    }

    /// As [`stops`](Self::stops), one after the other.
    pub(crate) fn lines<'a>(
        &'a self,
        network: &'a Network,
        behind_m: f32,
        horizon_m: f32,
    ) -> impl Iterator<Item = StopAhead> + 'a {
        let near = self.ahead().take_while(move |(begins_m, _)| *begins_m <= horizon_m);
        let lanes = near.enumerate().filter_map(|(index, (begins_m, leg))| {
            let lane = network.lane(leg.last_lane()).filter(|lane| !lane.stops.is_empty())?;
            let mut after = self.legs.iter().skip(index + 1).map(|after| after.lane);
            Some((begins_m, leg, lane, after.find(|after| *after != leg.last_lane())))
        });
        lanes.flat_map(move |(begins_m, leg, lane, next)| {
            let offset_m = begins_m - own_from_m(network, leg, lane);
            let held = lane.stops.iter().filter(move |line| lane.holds(line.why, next));
            let lines = held.map(move |line| StopAhead {
                lane: leg.last_lane(),
                ahead_m: line.at_m + offset_m,
                why: line.why,
            });
            lines.filter(move |line| {
                (-behind_m..=horizon_m).contains(&line.ahead_m)
                    && line.ahead_m >= begins_m - 0.01
                    && line.ahead_m <= begins_m + leg.length_m() + 0.01
            })
        })
    }
}

/// Where a leg begins, on the lane that it ends on.
fn own_from_m(network: &Network, leg: &Leg, lane: &Lane) -> f32 {
    match (leg.onto, network.lane(leg.lane)) {
        (Some(_), Some(own)) => own.abreast_m(leg.from_m, lane),
        _ => leg.from_m,
    }
}

/// Curvature of a way at one of its samples: that of the lane there or, if it is more, the turn up
/// to the next sample. Lanes that meet at an angle, and lanes shorter than a step, have the latter
/// alone.
pub(crate) fn curvature_per_m(points: &[PathPoint], index: usize) -> f32 {
    points.get(index).map_or(0.0, |here| here.curvature_per_m(points.get(index + 1)))
}

impl PathPoint {
    /// As [`curvature_per_m`], with the next sample.
    #[inline]
    pub(crate) fn curvature_per_m(&self, next: Option<&Self>) -> f32 {
        /// Turns that a vehicle does not slow down for: maps are not drawn more exactly.
        const KINK_RAD_MIN: f32 = 0.05;
        const STEP_M_MIN: f32 = 2.0;
        let own = self.point.curvature_per_m.abs();
        let Some(next) = next else { return own };
        let turn_rad = wrapped(next.point.heading_rad - self.point.heading_rad).abs();
        if turn_rad <= KINK_RAD_MIN {
            return own;
        }
        let step_m = (next.ahead_m - self.ahead_m).max(STEP_M_MIN);
        own.max((turn_rad - KINK_RAD_MIN) / step_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network() -> Network {
        let text = roads::town::build("Town03_Opt").unwrap();
        Network::new(&roads::Map::parse("Town03_Opt", &text).unwrap())
    }

    /// A change to the lane beside that takes 20 m, and the lanes it leads from and to.
    fn change(network: &Network) -> (Path, LaneId, LaneId) {
        let ids = 0..network.lane_count() as LaneId;
        let lanes = ids.filter_map(|id| Some((id, network.lane(id)?)));
        let beside = |(id, lane): (LaneId, &Lane)| {
            Some((id, lane.left.filter(|_| lane.length_m() > 60.0)?.lane))
        };
        let (lane, onto) = lanes.filter_map(beside).next().unwrap();
        let mut path = Path::default();
        path.push(Leg { lane, from_m: 10.0, to_m: 30.0, onto: Some(onto) });
        path.push(Leg { lane: onto, from_m: 30.0, to_m: 60.0, onto: None });
        (path, lane, onto)
    }

    #[test]
    fn who_stops_in_a_change_settles_on_the_nearer_lane() {
        let network = network();
        let (begun, lane, onto) = change(&network);
        for (driven_m, nearer) in [(5.0, lane), (15.0, onto)] {
            let mut path = begun.clone();
            path.go(driven_m);
            path.settle(&network);
            assert!(!path.is_changing());
            assert_eq!(path.own(&network).unwrap().0, nearer, "{driven_m} m");
        }
    }

    #[test]
    fn a_cut_keeps_what_begins_before_it_and_the_leg_under_the_vehicle() {
        let network = network();
        let (begun, lane, onto) = change(&network);
        for (from_m, last) in [(25.0, (onto, 50.0)), (20.0, (onto, 20.0)), (-1.0, (onto, 20.0))] {
            let mut path = begun.clone();
            path.cut(from_m);
            assert_eq!((path.last().unwrap().last_lane(), path.length_m()), last, "{from_m} m");
            assert_eq!(path.own(&network).unwrap().0, lane);
        }
    }
}
