//! Pairs of a start and a goal, drawn under a task's conditions.

use std::sync::Arc;

use agents::{Network, Spot, Way};
use nalgebra::Point3;
use roads::{LaneTypes, Map};
use schemas::{Pose, SplitMix64, Translation3, Vec3};

use super::{parking, shuffle};
use crate::limits::PAIRS_MAX;
use crate::line::StopLine;
use crate::route::{Route, STEP_M};
use crate::task::{Bends, Onto, Task};

/// Pairs of a town and task are the same everywhere: they come from this seed.
const SEED: u64 = 2017;

/// A start, and the shortest way from it to a goal.
#[derive(Debug)]
pub(super) struct Pair {
    /// On the ground in the middle of the lane.
    pub start: Pose,
    pub route: Arc<Route>,
}

/// A place to begin or end at.
pub(super) struct Place {
    /// On the ground in the middle of the lane.
    pub pose: Pose,
    pub spot: Spot,
    /// How far to the right of it a way ends.
    pub right_m: f32,
}

/// Up to `wanted` pairs, none twice: every start once, then those that have a second goal, and so
/// on. Starts and goals are at least 10 m from junctions, as the map's spread places are.
pub(super) fn draw(
    map: &Map,
    network: &Network,
    task: &Task,
    lines: &[StopLine],
    wanted: usize,
) -> Vec<Pair> {
    let bounds_m = *task.way.length_m.of(map.name());
    let places = map.spread_places().iter().filter_map(|place| Place::of(map, network, place));
    let places: Vec<Place> = places.collect();
    let parking = (task.way.into == Onto::Parking).then(|| parking::places(map, network));
    let ends = parking.as_ref().unwrap_or(&places);
    let mut random = SplitMix64::new(SEED);
    let mut starts: Vec<usize> = (0..places.len()).collect();
    shuffle(&mut starts, &mut random);
    let mut open: Vec<(usize, Vec<usize>)> = starts
        .into_iter()
        .map(|start| {
            let mut goals = possible(&places[start], ends, bounds_m);
            shuffle(&mut goals, &mut random);
            (start, goals)
        })
        .collect();
    let wanted = wanted.min(PAIRS_MAX);
    let mut found = Vec::new();
    while !open.is_empty() && found.len() < wanted {
        open.retain_mut(|(start, goals)| {
            if found.len() >= wanted || goals.is_empty() {
                return false;
            }
            let ways = network.ways(places[*start].spot);
            while let Some(goal) = goals.pop() {
                let goal = &ends[goal];
                if let Some(route) = route(map, task, lines, ways.to(goal.spot), goal.right_m) {
                    found.push(Pair { start: places[*start].pose, route: Arc::new(route) });
                    return true;
                }
            }
            false
        });
    }
    found
}

impl Place {
    fn of(map: &Map, network: &Network, place: &nalgebra::Isometry3<f64>) -> Option<Self> {
        let pose = on_ground(map, place);
        Some(Self { pose, spot: network.spot(map, &pose)?, right_m: 0.0 })
    }
}

/// A spawn point hangs above the ground.
fn on_ground(map: &Map, place: &nalgebra::Isometry3<f64>) -> Pose {
    let point: Point3<f64> = place.translation.vector.into();
    let lane = map.nearest(point, LaneTypes::DRIVING).map(|lane| map.pose(&lane));
    let pose: Pose = nalgebra::convert(*place);
    let z_m = lane.map_or(pose.translation.z, |lane| lane.translation.z as f32);
    let position_m = Vec3::new(pose.translation.x, pose.translation.y, z_m);
    Pose::from_parts(Translation3::from(position_m), pose.rotation)
}

/// Goals that are not too far away as the crow flies.
fn possible(start: &Place, ends: &[Place], (_, longest_m): (f32, f32)) -> Vec<usize> {
    let away_m =
        |goal: &Place| (goal.pose.translation.vector - start.pose.translation.vector).norm();
    // A place is no goal of its own.
    let near = |goal: &usize| (0.01..=longest_m).contains(&away_m(&ends[*goal]));
    (0..ends.len()).filter(near).collect()
}

/// The shortest way as a route, if it is one of the task's; one that ends `right_m` to the right.
fn route(
    map: &Map,
    task: &Task,
    lines: &[StopLine],
    way: Option<Way<'_>>,
    right_m: f32,
) -> Option<Route> {
    let way = way?;
    let (shortest_m, longest_m) = *task.way.length_m.of(map.name());
    let fits = (shortest_m..=longest_m).contains(&way.length_m())
        && (!task.way.roundabout || way.is_around_ring())
        && task.way.fits(&Bends::of(way.headings()));
    let mut points = fits.then(|| way.points(STEP_M))?;
    let (first, last) = (points.first()?, points.last()?);
    if !task.way.fits_limits(first.limit_mps, last.limit_mps) {
        return None;
    }
    parking::turn_in(&mut points, right_m);
    let route = Route::new(&points, |point| map.lane(&point.on).width_m as f32 / 2.0)?;
    let is_held_by = |light: usize| u32::try_from(light).is_ok_and(|light| way.is_held_by(light));
    (!route.has_kink()).then(|| route.with_lines(lines, is_held_by))
}
