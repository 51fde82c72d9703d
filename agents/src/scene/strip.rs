//! The strip of road that a vehicle needs on its path, and what is in it.

use std::cell::Cell;

use nalgebra::Vector2;
use schemas::Vec3;

use super::{Ahead, Body, Room};
use crate::path::PathPoint;

/// Bodies higher or lower than this are on another storey.
const STOREY_M: f32 = 2.5;
/// How much farther than computed something may be, by rounding.
pub(super) const ROUNDING_M: f32 = 0.1;
/// No vehicle turns more tightly.
pub(super) const CURVATURE_PER_M_MAX: f32 = 0.2;

/// The path of a vehicle with the room that its box needs beside it.
#[derive(Debug)]
pub(super) struct Strip<'a> {
    points: &'a [PathPoint],
    room: &'a Room,
    /// From each point to the next one, seen from above, worked out when it is first asked for:
    /// bodies are near few of them.
    ways: Vec<Cell<Option<Way>>>,
    /// At least what any front corner swings out.
    swing_m_max: f32,
}

impl<'a> Strip<'a> {
    pub(super) fn new(points: &'a [PathPoint], room: &'a Room, swing_m_max: f32) -> Self {
        let ways = vec![Cell::new(None); points.len().saturating_sub(1)];
        Self { points, room, ways, swing_m_max }
    }

    /// The least gap to a body that is met from a segment on.
    pub(super) fn least_gap_m(&self, body: &Body, start: usize) -> f32 {
        let ahead_m = self.points.get(start).map_or(0.0, |from| from.ahead_m);
        ahead_m - radius_m(body) - self.room.front_m - ROUNDING_M
    }

    /// A body as circles along its length, and its corners, each held against the path from a
    /// segment on.
    pub(super) fn ahead(&self, body: &Body, start: usize) -> Option<Ahead> {
        let front_m = self.room.front_m;
        let (radius_m, side_m) = (radius_m(body), side_m(self.room, body));
        let mut nearest: Option<(f32, usize)> = None;
        // What the path meets later than something else need not be found.
        let until_m = |nearest: Option<(f32, usize)>| {
            nearest.map_or(f32::INFINITY, |(least_m, _)| least_m + ROUNDING_M)
        };
        let reach_m = (body.half_m.x - radius_m).max(0.0);
        let count = (reach_m / radius_m.max(0.2)).ceil().min(8.0) as i32;
        for circle in -count..=count {
            let offset_m = if count == 0 { 0.0 } else { reach_m * circle as f32 / count as f32 };
            let centre_m = body.centre_m + body.forward * offset_m;
            let met = self.meet((start, until_m(nearest) + radius_m), &centre_m, side_m + radius_m);
            nearest = sooner(nearest, met.map(|(along_m, segment)| (along_m - radius_m, segment)));
        }
        // People are as round as a circle. Corners beside the own flank have been passed.
        for corner_m in corners_m(body).into_iter().filter(|_| !body.is_walker) {
            let met = self.meet((start, until_m(nearest)), &corner_m, side_m);
            nearest = sooner(nearest, met.filter(|(along_m, _)| *along_m >= front_m));
        }
        let (along_m, segment) = nearest?;
        let along_mps =
            self.points.get(segment).map_or(0.0, |at| at.point.heading().dot(&body.velocity_mps));
        Some(Ahead {
            id: body.id,
            gap_m: along_m - front_m,
            length_m: 2.0 * body.half_m.x,
            along_mps,
            speed_mps: body.velocity_mps.norm(),
            is_walker: body.is_walker,
        })
    }

    /// Where a path that comes within a distance of a point, or farther by the swing of the
    /// corners, is nearest to it, the first time that it comes so near, and on which segment. It
    /// does not on those before `start`, and may not be found from `until_m` along the path on.
    fn meet(
        &self,
        (start, until_m): (usize, f32),
        centre_m: &Vec3,
        within_m: f32,
    ) -> Option<(f32, usize)> {
        let mut index = start;
        let mut met: Option<(f32, f32, usize)> = None;
        while let Some((from, way)) = self.segment(index) {
            if met.is_none() && from.ahead_m > until_m {
                return None;
            }
            let beside = Beside::of(from, &way, centre_m);
            let same_storey = (centre_m.z - from.point.point_m.z).abs() < STOREY_M;
            let behind = index == 0 && beside.along_m < 0.0;
            let along_m = from.ahead_m + beside.along_m.clamp(0.0, beside.length_m);
            let may_be_within = beside.away_m < within_m + self.swing_m_max;
            let within = may_be_within && same_storey && !behind && {
                let swings = along_m >= self.room.front_m;
                let swing_m = if swings { self.swing_m(index + 1, beside.on_left) } else { 0.0 };
                beside.away_m < within_m + swing_m
            };
            if within && met.is_none_or(|(least_m, _, _)| beside.away_m < least_m) {
                met = Some((beside.away_m, along_m, index));
                index += 1;
            } else if met.is_some() {
                break;
            } else {
                index += beside.segments_beyond(within_m + self.swing_m_max);
            }
        }
        met.map(|(_, along_m, segment)| (along_m, segment))
    }

    fn segment(&self, index: usize) -> Option<(&'a PathPoint, Way)> {
        let (known, from) = (self.ways.get(index)?, self.points.get(index)?);
        if let Some(way) = known.get() {
            return Some((from, way));
        }
        let way = Way::of(from, self.points.get(index + 1)?);
        known.set(Some(way));
        Some((from, way))
    }

    /// How far the front corner on one side swings out of the strip while the nose comes to a
    /// point.
    ///
    /// In a bend the nose is tangent ahead of the middle, and points outwards besides, because only
    /// the rear axle goes along its own course: each is curvature · half length² / 2, if the rear
    /// axle is half of half the length behind the middle.
    fn swing_m(&self, nose: usize, on_left: bool) -> f32 {
        if self.swing_m_max == 0.0 {
            return 0.0;
        }
        let front_m = self.room.front_m;
        let until = self.points.get(..=nose).unwrap_or_default();
        let nose_m = until.last().map_or(0.0, |nose| nose.ahead_m);
        let under = until.iter().rev().take_while(|at| nose_m - at.ahead_m <= front_m);
        let outwards = if on_left { -1.0 } else { 1.0 };
        let bends = under.map(|at| outwards * at.point.curvature_per_m);
        bends.fold(0.0, f32::max).min(CURVATURE_PER_M_MAX) * front_m * front_m
    }
}

/// Of two places that a path meets the one that it meets first; the known one if it is both.
fn sooner(known: Option<(f32, usize)>, met: Option<(f32, usize)>) -> Option<(f32, usize)> {
    match (known, met) {
        (Some(known), Some(met)) if met.0 < known.0 => Some(met),
        (known, met) => known.or(met),
    }
}

/// Of the circles that stand for a body.
fn radius_m(body: &Body) -> f32 {
    body.half_m.y.min(body.half_m.x)
}

/// Half the width that a vehicle needs beside a body.
pub(super) fn side_m(room: &Room, body: &Body) -> f32 {
    room.half_width_m + if body.is_walker { room.beside_walkers_m } else { room.beside_m }
}

fn corners_m(body: &Body) -> [Vec3; 4] {
    let length_m = body.forward * body.half_m.x;
    let width_m = Vec3::new(-body.forward.y, body.forward.x, 0.0) * body.half_m.y;
    [length_m + width_m, length_m - width_m, width_m - length_m, -length_m - width_m]
        .map(|offset_m| body.centre_m + offset_m)
}

/// From one point of a path to the next.
#[derive(Clone, Copy, Debug)]
struct Way {
    by_m: Vector2<f32>,
    length_m: f32,
}

impl Way {
    fn of(from: &PathPoint, to: &PathPoint) -> Self {
        let by_m = (to.point.point_m - from.point.point_m).xy();
        Self { by_m, length_m: by_m.norm().max(1.0e-3) }
    }
}

/// A point beside one segment of a path, seen from above.
struct Beside {
    /// Along the segment's direction from its start; the segment's own length.
    along_m: f32,
    length_m: f32,
    /// From the nearest point of the segment.
    away_m: f32,
    on_left: bool,
}

impl Beside {
    fn of(from: &PathPoint, way: &Way, centre_m: &Vec3) -> Self {
        let Way { by_m, length_m } = *way;
        let beside = (centre_m - from.point.point_m).xy();
        let along_m = beside.dot(&by_m) / length_m;
        let away_m = (beside - by_m * (along_m / length_m).clamp(0.0, 1.0)).norm();
        Self { along_m, length_m, away_m, on_left: by_m.perp(&beside) > 0.0 }
    }

    /// Segments of this length on which no point of the path is nearer than the distance left.
    fn segments_beyond(&self, within_m: f32) -> usize {
        (((self.away_m - within_m).max(0.0) / self.length_m) as usize).max(1)
    }
}
