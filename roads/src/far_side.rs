//! Far-side lamps: a light is seen a second time beyond its junction, by those who wait at the line
//! with the near lamps beside or above them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::kinds::LaneTypes;
use crate::lights::TrafficLight;
use crate::map::Map;
use crate::place::Waypoint;

/// A light that itself stands this far beyond where vehicles wait is seen from there, in metres.
const OWN_AHEAD_M: f64 = 8.0;
/// How far beyond where vehicles wait far-side lamps may stand, in metres.
const REACH_M: f64 = 60.0;
/// The most that a way through a junction turns which leads straight on, in radians.
const STRAIGHT_RAD: f64 = 0.5;
/// How far before its junction a light may hold its lanes, in metres.
const BEFORE_M: u32 = 30;
/// How far beyond the junction a post stands beside the lanes that leave it, in metres.
const PAST_M: f64 = 0.5;
/// Distance of a post from the kerb, in metres.
const KERB_GAP_M: f64 = 0.7;
/// Step across a junction, in metres.
const STEP_M: f64 = 0.5;

/// Finds the feet of far-side posts.
pub(crate) struct FarSide<'m> {
    map: &'m Map,
    /// Where the traffic of each lane leaves it, by road, section and lane.
    ends: BTreeMap<(u32, u32, i32), Waypoint>,
}

/// Where vehicles wait for a light, and the direction in which they do.
struct Line {
    middle: Point3<f64>,
    ahead: Vector3<f64>,
}

impl<'m> FarSide<'m> {
    pub(crate) fn new(map: &'m Map) -> Self {
        let lanes = map.driving_lanes();
        Self { map, ends: lanes.into_iter().map(|(start, end)| (key(&start), end)).collect() }
    }

    /// The foot of the post with a light's far-side lamps, x along the traffic that waits for it:
    /// beside the lanes that lead straight on, or opposite the lanes of a road that ends here.
    /// `None` for a light that stands beyond its junction itself, or where there is no room.
    pub(crate) fn foot(&self, light: &TrafficLight) -> Option<Isometry3<f64>> {
        let line = Line::of(light)?;
        if line.along_m(&light.pose.point) > OWN_AHEAD_M {
            return None;
        }
        let ways = self.ways(light);
        let place = self.beside_exit(&ways).or_else(|| self.opposite(&ways, &line))?;
        let is_beyond = (OWN_AHEAD_M..=REACH_M).contains(&line.along_m(&place));
        let is_clear = self.map.inside(place, LaneTypes::TRAFFIC).is_none();
        let heading_rad = line.ahead.y.atan2(line.ahead.x);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad);
        (is_beyond && is_clear).then(|| Isometry3::from_parts(Translation3::from(place), turn))
    }

    /// Where the ways begin that a light's lanes are or lead to inside its junction.
    fn ways(&self, light: &TrafficLight) -> Vec<Waypoint> {
        let inside = |lane: &Waypoint| -> Vec<Waypoint> {
            if self.map.is_in_junction(lane) {
                return vec![*lane];
            }
            let ahead = (1..=BEFORE_M).map(|ahead_m| self.map.next(lane, f64::from(ahead_m)));
            let found = ahead.map(|places| {
                places.into_iter().filter(|place| self.map.is_in_junction(place)).collect()
            });
            found.into_iter().find(|ways: &Vec<_>| !ways.is_empty()).unwrap_or_default()
        };
        light.lanes.iter().flat_map(inside).collect()
    }

    /// Beside the kerb, where the straightest way through the junction has left it.
    fn beside_exit(&self, ways: &[Waypoint]) -> Option<Point3<f64>> {
        let turns = ways.iter().filter_map(|start| {
            let end = self.ends.get(&key(start))?;
            let [from, to] = [start, end].map(|place| self.map.pose(place) * Vector3::x());
            Some((from.angle(&to), end))
        });
        let (turn_rad, end) = turns.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        if turn_rad > STRAIGHT_RAD {
            return None;
        }
        let exits = self.map.next(end, PAST_M);
        let exit = exits.into_iter().find(|exit| !self.map.is_in_junction(exit))?;
        let is_right = self.map.lane(&exit).is_right_hand_traffic;
        let beside = |place: &Waypoint| {
            let next = if is_right { self.map.right(place) } else { self.map.left(place) };
            next.filter(|next| LaneTypes::TRAFFIC.contains(self.map.lane(next).lane_type))
        };
        let outer = std::iter::successors(Some(exit), beside).last()?;
        let beside_m = self.map.lane(&outer).width_m / 2.0 + KERB_GAP_M;
        let left_m = if is_right { -beside_m } else { beside_m };
        Some(self.map.pose(&outer) * Point3::new(0.0, left_m, 0.0))
    }

    /// Straight ahead of the line, beyond the last lane of the junction.
    fn opposite(&self, ways: &[Waypoint], line: &Line) -> Option<Point3<f64>> {
        let junction = ways.iter().find_map(|lane| self.map.lane(lane).junction_id)?;
        let steps = (1..=(REACH_M / STEP_M) as u32).rev();
        let (ahead_m, z_m) = steps.map(|step| f64::from(step) * STEP_M).find_map(|ahead_m| {
            let lane = self.map.inside(line.at(ahead_m), LaneTypes::TRAFFIC)?;
            let is_same = self.map.lane(&lane).junction_id == Some(junction);
            is_same.then_some((ahead_m, self.map.lane_pose(&lane)?.point.z))
        })?;
        let place = line.at(ahead_m + STEP_M + KERB_GAP_M);
        Some(Point3::new(place.x, place.y, z_m))
    }
}

impl Line {
    /// The middle of all boxes of a light.
    fn of(light: &TrafficLight) -> Option<Self> {
        let count = light.boxes.len() as f64;
        let sum = |part: fn(&Isometry3<f64>) -> Vector3<f64>| -> Vector3<f64> {
            light.boxes.iter().map(|waiting| part(&waiting.pose)).sum()
        };
        let ahead = sum(|pose| pose.rotation * Vector3::x());
        let level = Vector3::new(ahead.x, ahead.y, 0.0).try_normalize(f64::EPSILON)?;
        Some(Self { middle: (sum(|pose| pose.translation.vector) / count).into(), ahead: level })
    }

    fn at(&self, ahead_m: f64) -> Point3<f64> {
        self.middle + self.ahead * ahead_m
    }

    fn along_m(&self, point: &Point3<f64>) -> f64 {
        self.ahead.dot(&(point - self.middle))
    }
}

fn key(place: &Waypoint) -> (u32, u32, i32) {
    (place.road, place.section, place.lane)
}
