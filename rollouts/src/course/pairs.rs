//! Pairs of a start and a goal, drawn under a task's conditions.

use std::sync::Arc;

use agents::Network;
use nalgebra::Point3;
use roads::{LaneTypes, Map};
use schemas::{Pose, SplitMix64, Translation3, Vec3};

use super::shuffle;
use crate::limits::PAIRS_MAX;
use crate::route::{Route, STEP_M};
use crate::task::{Bends, Task};

/// Pairs of a town and task are the same everywhere: they come from this seed.
const SEED: u64 = 2017;
/// A lane that no width is known of, in metres.
const HALF_WIDTH_M: f64 = 1.75;

/// A start, and the shortest way from it to a goal.
#[derive(Debug)]
pub(super) struct Pair {
    /// On the ground in the middle of the lane.
    pub start: Pose,
    pub route: Arc<Route>,
}

/// Up to `wanted` pairs, none twice: every start once, then those that have a second goal, and so
/// on. Starts and goals are at least 10 m from junctions, as the map's spread places are.
pub(super) fn draw(map: &Map, network: &Network, task: &Task, wanted: usize) -> Vec<Pair> {
    let places: Vec<Pose> = map.spread_places().iter().map(|place| on_ground(map, place)).collect();
    let mut random = SplitMix64::new(SEED);
    let mut starts: Vec<usize> = (0..places.len()).collect();
    shuffle(&mut starts, &mut random);
    let mut open: Vec<(usize, Vec<usize>)> = starts
        .into_iter()
        .map(|start| {
            let mut goals = possible(&places, start, task.bounds_m(map.name()));
            shuffle(&mut goals, &mut random);
            (start, goals)
        })
        .collect();
    let mut found = Vec::new();
    while !open.is_empty() && found.len() < wanted.min(PAIRS_MAX) {
        open.retain_mut(|(start, goals)| {
            if found.len() >= wanted.min(PAIRS_MAX) {
                return false;
            }
            while let Some(goal) = goals.pop() {
                if let Some(route) = route(map, network, task, (&places[*start], &places[goal])) {
                    found.push(Pair { start: places[*start], route: Arc::new(route) });
                    return true;
                }
            }
            false
        });
    }
    found
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
fn possible(places: &[Pose], start: usize, (_, longest_m): (f32, f32)) -> Vec<usize> {
    let from = places[start].translation.vector;
    let near = |goal: &usize| {
        let apart_m = (places[*goal].translation.vector - from).norm();
        *goal != start && apart_m <= longest_m
    };
    (0..places.len()).filter(near).collect()
}

/// The shortest way, if it is one of the task's.
fn route(
    map: &Map,
    network: &Network,
    task: &Task,
    (start, goal): (&Pose, &Pose),
) -> Option<Route> {
    let way = network.way(map, start, goal, STEP_M)?;
    let (shortest_m, longest_m) = task.bounds_m(map.name());
    let length_m = way.last()?.at_m;
    if !(shortest_m..=longest_m).contains(&length_m) || !(task.fits)(&Bends::of(&way)) {
        return None;
    }
    Route::new(&way, |point| {
        let place: Point3<f64> =
            nalgebra::convert::<_, nalgebra::Vector3<f64>>(point.point_m).into();
        let width_m = map.nearest(place, LaneTypes::DRIVING).map(|lane| map.lane(&lane).width_m);
        (width_m.map_or(HALF_WIDTH_M, |width_m| width_m / 2.0)) as f32
    })
}
