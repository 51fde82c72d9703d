//! Where vehicles may start.

use nalgebra::{Isometry3, Vector2, Vector3};

use crate::kinds::LaneType;
use crate::lanes::{LaneEntry, LaneTable, lane_pose, parts};
use crate::limits;
use crate::model::Model;

/// Room kept free before and behind a spread place within its lane, in metres.
const END_GAP_M: f64 = 10.0;
/// Distance between spread places of one lane, in metres, at least.
const SPACING_M: f64 = 25.0;
/// Narrower lanes take no vehicle.
const WIDTH_MIN_M: f64 = 2.4;
/// Height of a spawn point above the ground, in metres.
const HEIGHT_M: f64 = 0.5;
/// Room kept free before and behind what is put between spread places, in metres.
const FILLED_GAP_M: f64 = 5.0;
/// Length and width of the place that a car takes, with room around it, in metres.
const PLACE_M: [f64; 2] = [7.5, 2.3];
/// Roads this far above each other do not meet, in metres.
const STOREY_M: f64 = 3.0;
/// How many spawn points CARLA's maps have: programs count on their numbers.
const CARLA_COUNTS: [(&str, usize); 8] = [
    ("Town01", 255),
    ("Town02", 101),
    ("Town03", 265),
    ("Town04", 372),
    ("Town05", 302),
    ("Town06", 436),
    ("Town07", 116),
    ("Town10HD", 155),
];

/// Poses of vehicles in driving lanes outside junctions.
#[derive(Debug)]
pub(crate) struct SpawnPoints {
    pub(crate) poses: Vec<Isometry3<f64>>,
    /// How many of them, the first ones, are spread evenly.
    pub(crate) spread_count: usize,
}

/// Where one lane has spawn points, in road coordinates and ascending.
struct Row<'a> {
    entry: &'a LaneEntry,
    taken_s: Vec<f64>,
}

impl SpawnPoints {
    /// Spreads places over all driving lanes, road by road as the text lists them, then fills the
    /// largest gaps between them until a map with the name of one of CARLA's has as many as that.
    pub(crate) fn new(model: &Model, table: &LaneTable, name: &str) -> Self {
        let drivable = |entry: &&LaneEntry| {
            parts(model, entry).is_some_and(|(road, _, lane)| {
                lane.lane_type == LaneType::Driving && road.junction.is_none()
            })
        };
        let lanes = table.lanes.iter().filter(drivable);
        let mut rows: Vec<Row<'_>> =
            lanes.map(|entry| Row { entry, taken_s: spread(model, entry) }).collect();
        let place = |row: &Row<'_>| model.roads.get(row.entry.road as usize).map(|road| road.place);
        rows.sort_by_key(place);
        let spread_s = rows.iter().flat_map(|row| row.taken_s.iter().map(|s| (row.entry, *s)));
        let poses = spread_s.filter_map(|(entry, s)| pose(model, entry, s));
        let mut poses: Vec<_> = poses.take(limits::SPAWN_POINTS_MAX).collect();
        let spread_count = poses.len();
        fill(model, &mut rows, wanted_count(name), &mut poses);
        Self { poses, spread_count }
    }
}

/// 0 for a map that is none of CARLA's.
fn wanted_count(name: &str) -> usize {
    let name = name.rsplit('/').next().unwrap_or(name);
    let name = name.strip_suffix("_Opt").unwrap_or(name);
    CARLA_COUNTS.iter().find(|(known, _)| *known == name).map_or(0, |(_, count)| *count)
}

fn spread(model: &Model, entry: &LaneEntry) -> Vec<f64> {
    let usable_m = entry.length_m() - 2.0 * END_GAP_M;
    if usable_m < 0.0 {
        return Vec::new();
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a lane is shorter than a million metres"
    )]
    let gaps = (usable_m / SPACING_M).floor() as usize;
    let share = |index: usize| if gaps == 0 { 0.5 } else { index as f64 / gaps as f64 };
    (0..=gaps)
        .map(|index| entry.start_s + END_GAP_M + usable_m * share(index))
        .filter(|s| is_wide(model, entry, *s))
        .collect()
}

fn is_wide(model: &Model, entry: &LaneEntry, s: f64) -> bool {
    parts(model, entry).is_some_and(|(_, _, lane)| lane.width.value(s) >= WIDTH_MIN_M)
}

fn pose(model: &Model, entry: &LaneEntry, s: f64) -> Option<Isometry3<f64>> {
    let (road, section, lane) = parts(model, entry)?;
    let mut pose = lane_pose(road, section, lane.id, s).isometry();
    pose.translation.vector += Vector3::z() * HEIGHT_M;
    Some(pose)
}

/// Puts places into the middle of the largest gaps until there are `wanted`, or no gap is left that
/// takes a car. Of equal gaps the first one by lane counts.
fn fill(model: &Model, rows: &mut [Row<'_>], wanted: usize, poses: &mut Vec<Isometry3<f64>>) {
    let mut gaps: Vec<(f64, usize, f64)> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        gaps.extend(row.gaps().map(|(gap_m, s)| (gap_m, index, s)));
    }
    while poses.len() < wanted.min(limits::SPAWN_POINTS_MAX) {
        let largest = (0..gaps.len()).rev().max_by(|a, b| gaps[*a].0.total_cmp(&gaps[*b].0));
        let Some((gap_m, index, s)) = largest.map(|at| gaps.remove(at)) else { return };
        let row = &mut rows[index];
        let found = pose(model, row.entry, s).filter(|_| is_wide(model, row.entry, s));
        let Some(found) = found.filter(|found| !poses.iter().any(|other| meet(found, other)))
        else {
            continue;
        };
        poses.push(found);
        row.taken_s.push(s);
        // Both halves may be filled again.
        let halves =
            [s - gap_m / 4.0, s + gap_m / 4.0].map(|middle_s| (gap_m / 2.0, index, middle_s));
        gaps.extend(halves.into_iter().filter(|half| half.0 >= 2.0 * PLACE_M[0]));
    }
}

impl Row<'_> {
    /// Length and middle of what is free before, between and behind the places taken.
    fn gaps(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        // As if somebody stood just beyond the room that stays free at both ends.
        let beyond_m = PLACE_M[0] - FILLED_GAP_M;
        let ends = [self.entry.start_s - beyond_m, self.entry.end_s + beyond_m];
        let from_s = std::iter::once(ends[0]).chain(self.taken_s.iter().copied());
        let to_s = self.taken_s.iter().copied().chain(std::iter::once(ends[1]));
        from_s
            .zip(to_s)
            .map(|(from_s, to_s)| (to_s - from_s, f64::midpoint(from_s, to_s)))
            .filter(|(gap_m, _)| *gap_m >= 2.0 * PLACE_M[0])
    }
}

/// Whether cars at two places would touch, by the separating axes of their outlines.
fn meet(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    let apart_m = b.translation.vector - a.translation.vector;
    if apart_m.z.abs() > STOREY_M {
        return false;
    }
    let axes = [a, b].map(|pose| {
        let forward = pose.rotation * Vector3::x();
        let forward = forward.xy().normalize();
        [forward, Vector2::new(-forward.y, forward.x)]
    });
    let reach_m = |axes: &[Vector2<f64>; 2], along: &Vector2<f64>| {
        (axes[0].dot(along) * PLACE_M[0]).abs() / 2.0
            + (axes[1].dot(along) * PLACE_M[1]).abs() / 2.0
    };
    axes.as_flattened().iter().all(|along| {
        apart_m.xy().dot(along).abs() < reach_m(&axes[0], along) + reach_m(&axes[1], along)
    })
}
