//! Which bodies may be in the strip of a path: what most of those about are not, found cheaply.

use nalgebra::Vector2;
use schemas::Vec3;

use super::strip::{CURVATURE_PER_M_MAX, ROUNDING_M, side_m};
use super::{Body, Room, cell};
use crate::path::PathPoint;

/// Segments of one part.
const PART: usize = 8;

/// Where a path is, seen from above, and how far beside it bodies count.
pub(super) struct Extent<'a> {
    points: &'a [PathPoint],
    whole: Bounds,
    /// Of the segments of each part of the path.
    parts: Vec<Bounds>,
    room: &'a Room,
    /// At least what any corner of the vehicle swings out.
    pub(super) swing_m: f32,
}

/// A box along the axes.
#[derive(Clone, Copy)]
struct Bounds {
    low_m: Vector2<f32>,
    high_m: Vector2<f32>,
}

impl<'a> Extent<'a> {
    pub(super) fn of(points: &'a [PathPoint], room: &'a Room) -> Self {
        let segments = points.len().saturating_sub(1).max(1);
        let mut parts = Vec::with_capacity(segments.div_ceil(PART));
        let mut bend_per_m = 0.0_f32;
        for first in (0..segments).step_by(PART) {
            let end = (first + PART + 1).min(points.len());
            let part = points.get(first..end).unwrap_or_default();
            let mut bounds = Bounds::NOWHERE;
            for PathPoint { point, .. } in part {
                bounds.hold(&point.point_m);
                bend_per_m = most(bend_per_m, point.curvature_per_m.abs());
            }
            parts.push(bounds);
        }
        let whole = parts.iter().fold(Bounds::NOWHERE, |whole, part| whole.with(part));
        let bend_per_m = bend_per_m.min(CURVATURE_PER_M_MAX);
        Self { points, whole, parts, room, swing_m: bend_per_m * room.front_m * room.front_m }
    }

    /// The lowest and the highest cell in which bodies of this size at most may be in the strip.
    pub(super) fn cells(&self, around_m_max: f32) -> [[i32; 2]; 2] {
        let Room { half_width_m, beside_m, beside_walkers_m, .. } = *self.room;
        let side_m = half_width_m + beside_m.max(beside_walkers_m);
        let reach = Vector2::repeat(side_m + around_m_max + self.swing_m + ROUNDING_M);
        let corner = |at_m: Vector2<f32>| cell(&Vec3::new(at_m.x, at_m.y, 0.0));
        [corner(self.whole.low_m - reach), corner(self.whole.high_m + reach)]
    }

    /// The first segment on which the box of a body may reach into the strip: no circle and no
    /// corner of it meets the path before. From its middle to its corners are `around_m`.
    pub(super) fn met_from(&self, body: &Body, around_m: f32) -> Option<usize> {
        let side_m = side_m(self.room, body) + self.swing_m + ROUNDING_M;
        let centre_m = body.centre_m.xy();
        let within_m = side_m + around_m;
        if !self.whole.is_within(&centre_m, within_m) {
            return None;
        }
        let beside = BesideBody {
            centre_m,
            forward: body.forward.xy(),
            reach_m: body.half_m.xy().add_scalar(side_m),
        };
        let near = self.parts.iter().zip((0..).step_by(PART));
        let mut near = near.filter(|(part, _)| part.is_within(&centre_m, within_m));
        near.find_map(|(_, first)| {
            let end = (first + PART + 1).min(self.points.len());
            let part = self.points.get(first..end).unwrap_or_default();
            Some(first + beside.met_from(part)?)
        })
    }
}

impl Bounds {
    const NOWHERE: Self = Self {
        low_m: Vector2::new(f32::INFINITY, f32::INFINITY),
        high_m: Vector2::new(f32::NEG_INFINITY, f32::NEG_INFINITY),
    };

    fn hold(&mut self, point_m: &Vec3) {
        self.low_m.x = least(self.low_m.x, point_m.x);
        self.low_m.y = least(self.low_m.y, point_m.y);
        self.high_m.x = most(self.high_m.x, point_m.x);
        self.high_m.y = most(self.high_m.y, point_m.y);
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            low_m: self.low_m.zip_map(&other.low_m, least),
            high_m: self.high_m.zip_map(&other.high_m, most),
        }
    }

    fn is_within(&self, point_m: &Vector2<f32>, within_m: f32) -> bool {
        let away_m = point_m - point_m.sup(&self.low_m).inf(&self.high_m);
        away_m.norm_squared() < within_m * within_m
    }
}

/// The box of a body with the room that counts around it.
struct BesideBody {
    centre_m: Vector2<f32>,
    forward: Vector2<f32>,
    reach_m: Vector2<f32>,
}

impl BesideBody {
    /// The first segment between these points that neither axis of the box keeps out of it.
    fn met_from(&self, points: &[PathPoint]) -> Option<usize> {
        let outside = |at: &PathPoint| self.outside(&at.point.point_m);
        let (first, others) = points.split_first()?;
        let mut before = outside(first);
        others.iter().position(|at| {
            let outside = outside(at);
            outside & std::mem::replace(&mut before, outside) == 0
        })
    }

    /// Beyond which sides of the box a point lies, as bits.
    fn outside(&self, point_m: &Vec3) -> u8 {
        let away_m = point_m.xy() - self.centre_m;
        let along_m = self.forward.dot(&away_m);
        let left_m = self.forward.perp(&away_m);
        u8::from(along_m > self.reach_m.x)
            | u8::from(along_m < -self.reach_m.x) << 1
            | u8::from(left_m > self.reach_m.y) << 2
            | u8::from(left_m < -self.reach_m.y) << 3
    }
}

// `f32::min` and `f32::max` also ask which of both is no number.
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
