//! The driving lanes of a map as drivers inside the tick use them: measured along their middle,
//! linked, with the lines to stop at.
//!
//! Built once per map and shared by all its worlds. Lanes are named by position, which is the same
//! for the same map, so that a snapshot can hold lanes.

mod build;
mod climbs;
mod conflicts;
mod crossings;
mod grid;
mod places;
mod point;
mod rings;
mod shared;
mod stops;
mod ways;

use std::collections::BTreeMap;

use nalgebra::ComplexField;
use roads::{Map, Waypoint};
use schemas::{Pose, Vec3};
use serde::{Deserialize, Serialize};

pub(crate) use crossings::Crossing;
use grid::Grid;
pub(crate) use point::LanePoint;
pub use shared::RedLights;
use ways::Entered;

/// Nobody begins where a lane is narrower.
const PLACE_WIDTH_M: f32 = 2.2;

/// Position of a lane in its [`Network`].
pub type LaneId = u32;

/// The driving lanes of a map.
#[derive(Debug, Default)]
pub struct Network {
    lanes: Vec<Lane>,
    /// By road, section and lane of the map.
    by_key: BTreeMap<(u32, u32, i32), LaneId>,
    grid: Grid,
    crossings: Vec<Crossing>,
    /// By light: all that have a line with it, where they speak to several ways.
    sharing: BTreeMap<u32, Vec<u32>>,
}

/// One lane of one section.
#[derive(Debug, Default)]
pub(crate) struct Lane {
    /// Road, section and lane of the map.
    key: (u32, u32, i32),
    /// Where its traffic enters and leaves it, as road coordinates.
    entry_s: f64,
    exit_s: f64,
    /// The middle of the lane from its entry to its exit; at least two.
    points: Vec<LanePoint>,
    pub next: Vec<LaneId>,
    pub previous: Vec<LaneId>,
    pub left: Option<Beside>,
    pub right: Option<Beside>,
    /// The junction it leads through.
    pub junction: Option<u32>,
    /// Where its traffic came into that; its own entry outside of junctions.
    pub entered: Entered,
    /// Whether its traffic keeps to the left of the road.
    keeps_left: bool,
    /// Lanes of the junction that come near it, in order of lanes.
    pub conflicts: Vec<Conflict>,
    /// Where its traffic may have to stop, in order.
    pub stops: Vec<StopLine>,
    /// Where several lights have one line: which of them speaks to which of the lanes that lead on.
    pub spoken: Vec<(u32, LaneId)>,
    /// Whether no car can drive along it: it has no room, or turns back too tightly.
    pub is_barred: bool,
    /// Whether some way on never ends; where all do, whether one leads to the end of a road.
    pub goes_on: bool,
    /// Of its tightest bend.
    pub bend_per_m: f32,
    /// Sine of the climb that no way from its entry on avoids; 0 where one does not climb.
    pub climb: f32,
    /// Whether it leads around a roundabout, or through a junction onto one.
    pub is_ring: bool,
    pub enters_ring: bool,
}

/// A neighbouring lane of the same direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beside {
    pub lane: LaneId,
    /// Where the markings allow to change over; empty when nowhere.
    pub from_m: f32,
    pub to_m: f32,
}

/// Another lane of the junction that comes near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conflict {
    pub lane: LaneId,
    /// Where on the own lane the other one comes near and where it is left behind.
    pub from_m: f32,
    pub until_m: f32,
}

/// Where vehicles stop for a light or sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StopLine {
    pub at_m: f32,
    pub why: Stop,
}

/// What a stop line belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// Position of the light among [`Map::traffic_lights`].
    Light(u32),
    Sign,
    Yield,
    /// People on one of the network's crossings.
    Crossing(u32),
}

/// A place on a lane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Place {
    pub lane: LaneId,
    /// From the lane's entry.
    pub at_m: f32,
}

/// A place on a lane near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    pub place: Place,
    /// From the lane's middle, seen from above.
    pub away_m: f32,
    pub heading_rad: f32,
}

impl Network {
    /// Measures the driving lanes of a map.
    ///
    /// **Cost:** linear in the length of the lanes; some ten milliseconds for a town.
    #[must_use]
    pub fn new(map: &Map) -> Self {
        build::network(map)
    }

    pub(crate) fn lane(&self, id: LaneId) -> Option<&Lane> {
        self.lanes.get(id as usize)
    }

    /// Lanes of the map.
    #[must_use]
    pub fn lane_count(&self) -> usize {
        self.lanes.len()
    }

    pub(crate) fn crossing(&self, index: u32) -> Option<&Crossing> {
        self.crossings.get(index as usize)
    }

    pub(crate) fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// Places outside of junctions, on lanes that go on, at least `apart_m` from each other along a
    /// lane: x along the lane, at ground level. On a map whose lanes all end, on any of them.
    #[must_use]
    pub fn places(&self, apart_m: f32) -> Vec<Pose> {
        let mut places = Vec::new();
        let all_end = !self.lanes.iter().any(|lane| lane.goes_on);
        let good = |lane: &&Lane| lane.junction.is_none() && (lane.goes_on || all_end);
        for lane in self.lanes.iter().filter(good) {
            let mut at_m = apart_m / 2.0;
            while at_m + apart_m / 2.0 <= lane.length_m() {
                let at = lane.at(at_m);
                if at.width_m >= PLACE_WIDTH_M {
                    places.push(schemas::level_pose(at.point_m, at.heading_rad));
                }
                at_m += apart_m.max(1.0);
            }
        }
        places
    }

    /// Where roads begin: places `from_m` behind the beginning of lanes to which no other leads.
    #[must_use]
    pub fn sources(&self, from_m: f32) -> Vec<Pose> {
        let begins = |lane: &&Lane| {
            lane.junction.is_none() && lane.previous.is_empty() && lane.length_m() > 2.0 * from_m
        };
        let places = self.lanes.iter().filter(begins).map(|lane| lane.at(from_m));
        let wide = places.filter(|at| at.width_m >= PLACE_WIDTH_M);
        wide.map(|at| schemas::level_pose(at.point_m, at.heading_rad)).collect()
    }

    /// The place of a waypoint of the map; `None` beside driving lanes.
    pub(crate) fn place(&self, at: &Waypoint) -> Option<Place> {
        let lane = *self.by_key.get(&(at.road, at.section, at.lane))?;
        Some(Place { lane, at_m: self.lane(lane)?.at_s(at.s) })
    }

    /// Lanes whose middle is at most `radius_m` away, each at its nearest place; by lane.
    pub(crate) fn near(&self, point_m: &Vec3, radius_m: f32) -> Vec<Near> {
        let mut found = Vec::new();
        self.grid.lanes(point_m, radius_m, &mut found);
        found.sort_unstable();
        found.dedup();
        let near = found.into_iter().filter_map(|id| {
            let (place, away_m) = self.lane(id)?.nearest(id, point_m)?;
            let heading_rad = self.lane(id)?.at(place.at_m).heading_rad;
            (away_m <= radius_m).then_some(Near { place, away_m, heading_rad })
        });
        near.collect()
    }

    /// The lights whose lines lie at most `within_m` before a place, or just beyond it.
    pub(crate) fn lights_before(&self, at: Place, within_m: f32) -> impl Iterator<Item = u32> {
        /// Whoever waits at a line has it before the bumper.
        const BEYOND_M: f32 = 2.0;
        let on = move |id: LaneId, at_m: f32| {
            let lines = self.lane(id).map_or(&[][..], |lane| lane.stops.as_slice());
            lines.iter().filter_map(move |line| match line.why {
                Stop::Light(light) if (-BEYOND_M..=within_m).contains(&(at_m - line.at_m)) => {
                    Some(light)
                }
                _ => None,
            })
        };
        let previous = self.lane(at.lane).map_or(&[][..], |lane| lane.previous.as_slice());
        let before = previous.iter().flat_map(move |id| {
            let length_m = self.lane(*id).map_or(0.0, Lane::length_m);
            on(*id, length_m + at.at_m)
        });
        on(at.lane, at.at_m).chain(before)
    }

    /// The nearest place on a lane that leads about this way.
    pub(crate) fn along(&self, point_m: &Vec3, heading_rad: f32, radius_m: f32) -> Option<Near> {
        let turn = |near: &Near| (1.0 - ComplexField::cos(near.heading_rad - heading_rad)).max(0.0);
        self.near(point_m, radius_m)
            .into_iter()
            .filter(|near| turn(near) < 1.0)
            .min_by(|a, b| (a.away_m + 3.0 * turn(a)).total_cmp(&(b.away_m + 3.0 * turn(b))))
    }
}

impl Lane {
    pub(crate) fn length_m(&self) -> f32 {
        self.points.last().map_or(0.0, |point| point.at_m)
    }

    /// The middle at a distance from the entry, kept within the lane.
    pub(crate) fn at(&self, at_m: f32) -> LanePoint {
        self.at_before(self.after(at_m), at_m)
    }

    /// How many points there are up to a distance from the entry.
    pub(crate) fn after(&self, at_m: f32) -> usize {
        // They are about evenly spaced, and a search would leap through all of them.
        let share = (at_m / self.length_m().max(1.0e-6)).clamp(0.0, 1.0);
        let mut after = (share * self.points.len() as f32) as usize;
        while after > 0 && self.points.get(after - 1).is_none_or(|point| point.at_m > at_m) {
            after -= 1;
        }
        while self.points.get(after).is_some_and(|point| point.at_m <= at_m) {
            after += 1;
        }
        after
    }

    /// As [`at`](Self::at), for places in order: `after` is that of the place before.
    #[inline(always)]
    pub(crate) fn at_next(&self, at_m: f32, after: &mut usize) -> LanePoint {
        while self.points.get(*after).is_some_and(|point| point.at_m <= at_m) {
            *after += 1;
        }
        self.at_before(*after, at_m)
    }

    /// The middle at a distance from the entry, with the first point beyond it.
    #[inline(always)]
    fn at_before(&self, after: usize, at_m: f32) -> LanePoint {
        let index = after.clamp(1, self.points.len().saturating_sub(1).max(1));
        let Some([from, to]) = self.points.get(index - 1..=index) else {
            return LanePoint {
                at_m: 0.0,
                point_m: Vec3::zeros(),
                heading_rad: 0.0,
                curvature_per_m: 0.0,
                limit_mps: 0.0,
                width_m: 0.0,
            };
        };
        LanePoint::between(from, to, at_m)
    }

    /// Its points between two distances from the entry.
    pub(crate) fn between(&self, from_m: f32, to_m: f32) -> &[LanePoint] {
        let first = self.points.partition_point(|point| point.at_m <= from_m);
        let end = self.points.partition_point(|point| point.at_m < to_m);
        self.points.get(first..end).unwrap_or_default()
    }

    /// The map's name of a place.
    pub(crate) fn waypoint(&self, at_m: f32) -> Waypoint {
        let (road, section, lane) = self.key;
        Waypoint { road, section, lane, s: self.s_at(at_m) }
    }

    /// Where one of the junction's other lanes comes near, if it does.
    pub(crate) fn conflict(&self, other: LaneId) -> Option<&Conflict> {
        let at = self.conflicts.binary_search_by_key(&other, |conflict| conflict.lane).ok()?;
        self.conflicts.get(at)
    }

    /// Where its line of this kind is; its end if it has none.
    pub(crate) fn stop_m(&self, why: Stop) -> f32 {
        let line = self.stops.iter().find(|line| line.why == why);
        line.map_or(self.length_m(), |line| line.at_m)
    }

    /// Whether both lead to one lane.
    pub(crate) fn joins(&self, other: &Self) -> bool {
        self.next.iter().any(|next| other.next.contains(next))
    }

    /// The place abreast on the lane beside, which is of the same section.
    pub(crate) fn abreast_m(&self, at_m: f32, beside: &Self) -> f32 {
        beside.at_s(self.s_at(at_m))
    }

    /// Points are evenly spaced in road coordinates.
    fn at_s(&self, s: f64) -> f32 {
        let last = self.points.len().saturating_sub(1);
        let share = ((s - self.entry_s) / (self.exit_s - self.entry_s)).clamp(0.0, 1.0);
        let position = if share.is_finite() { share * last as f64 } else { 0.0 };
        let index = (position as usize).min(last.saturating_sub(1));
        let (Some(from), Some(to)) = (self.points.get(index), self.points.get(index + 1)) else {
            return 0.0;
        };
        from.at_m + (to.at_m - from.at_m) * (position - index as f64) as f32
    }

    fn s_at(&self, at_m: f32) -> f64 {
        let last = self.points.len().saturating_sub(1).max(1);
        let after = self.after(at_m).clamp(1, last);
        let (Some(from), Some(to)) = (self.points.get(after - 1), self.points.get(after)) else {
            return self.entry_s;
        };
        let within = ((at_m - from.at_m) / (to.at_m - from.at_m).max(1.0e-6)).clamp(0.0, 1.0);
        let share = ((after - 1) as f64 + f64::from(within)) / last as f64;
        self.entry_s + (self.exit_s - self.entry_s) * share
    }

    /// The nearest place to a point on the same storey, and how far it is, seen from above.
    fn nearest(&self, id: LaneId, point_m: &Vec3) -> Option<(Place, f32)> {
        /// Lanes higher or lower than this are another road's.
        const STOREY_M: f32 = 3.0;
        let mut best: Option<(f32, f32)> = None;
        for pair in self.points.windows(2) {
            let [from, to] = pair else { continue };
            let way = (to.point_m - from.point_m).xy();
            let beside = (point_m - from.point_m).xy();
            let share = (beside.dot(&way) / way.norm_squared().max(1.0e-9)).clamp(0.0, 1.0);
            let away_m = (beside - way * share).norm();
            let height_m = from.point_m.z + (to.point_m.z - from.point_m.z) * share;
            let same_storey = (height_m - point_m.z).abs() < STOREY_M;
            if same_storey && best.is_none_or(|(least_m, _)| away_m < least_m) {
                best = Some((away_m, from.at_m + (to.at_m - from.at_m) * share));
            }
        }
        best.map(|(away_m, at_m)| (Place { lane: id, at_m }, away_m))
    }
}

/// The next lower whole number; without SSE 4.1 `f32::floor` is a call.
#[inline]
pub(crate) fn floor(number: f32) -> i32 {
    let towards_zero = number as i32;
    towards_zero.saturating_sub(i32::from(number < towards_zero as f32))
}

/// An angle between -π and π.
#[inline]
pub(crate) fn wrapped(angle_rad: f32) -> f32 {
    use std::f32::consts::{PI, TAU};
    /// Angles below are what they are; most are.
    const SMALL_RAD: f32 = 3.0;
    if angle_rad.abs() < SMALL_RAD {
        return angle_rad;
    }
    angle_rad - ((angle_rad + PI) / TAU).floor() * TAU
}
