//! Triangles that come too near to the eye, or reach too far out of the picture.

use crate::fill::{Plane, Point, is_too_steep};
use crate::view::Projection;

/// Places further from the picture's corner than this, in pixels, have no fine grid any more.
pub(crate) const REACH_PX: f32 = 16_000.0;
/// Added and taken off, it rounds a place to 1/256 pixel.
pub(crate) const SNAP: f32 = 49_152.0;

/// A corner before the division: pixels times distance, and the distance along the view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Homogeneous {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) w: f32,
}

impl Homogeneous {
    /// Positive on the inner side of a limit.
    fn inside(&self, limit: usize, near_m: f32) -> f32 {
        match limit {
            0 => self.w - near_m,
            1 => REACH_PX * self.w + self.x,
            2 => REACH_PX * self.w - self.x,
            3 => REACH_PX * self.w + self.y,
            _ => REACH_PX * self.w - self.y,
        }
    }

    fn toward(&self, other: &Self, part: f32) -> Self {
        let between = |from: f32, to: f32| from + (to - from) * part;
        Self {
            x: between(self.x, other.x),
            y: between(self.y, other.y),
            w: between(self.w, other.w),
        }
    }

    fn point(&self) -> Point {
        let nearness = 1.0 / self.w;
        let exact = [self.x * nearness, self.y * nearness];
        Point { snapped: exact.map(|part| (part + SNAP) - SNAP), exact, nearness }
    }
}

/// Corners of what is left of a triangle: at most eight.
pub(crate) struct Clipped {
    corners: [Homogeneous; 9],
    count: usize,
}

impl Clipped {
    /// Cuts a triangle at all limits. A side is always cut from its inner end, so that both of its
    /// triangles are cut at the same place.
    pub(crate) fn new(triangle: [Homogeneous; 3], projection: &Projection) -> Self {
        let empty = Homogeneous { x: 0.0, y: 0.0, w: 0.0 };
        let mut clipped = Self { corners: [empty; 9], count: 0 };
        let is_beyond = |limit: usize| {
            triangle.iter().all(|corner| corner.inside(limit, projection.near_m) < 0.0)
        };
        if (0..5).any(is_beyond) {
            return clipped;
        }
        triangle.into_iter().for_each(|corner| clipped.push(corner));
        for limit in 0..5 {
            let corners = clipped.corners.get(..clipped.count).unwrap_or_default();
            if corners.iter().any(|corner| corner.inside(limit, projection.near_m) < 0.0) {
                clipped = clipped.cut(limit, projection.near_m);
            }
        }
        clipped
    }

    fn cut(&self, limit: usize, near_m: f32) -> Self {
        let mut left = Self { corners: self.corners, count: 0 };
        let corners = self.corners.get(..self.count).unwrap_or_default();
        for (at, corner) in corners.iter().enumerate() {
            let Some(next) = corners.get((at + 1) % corners.len()) else { continue };
            let (here, there) = (corner.inside(limit, near_m), next.inside(limit, near_m));
            if here >= 0.0 {
                left.push(*corner);
                if there < 0.0 {
                    left.push(corner.toward(next, here / (here - there)));
                }
            } else if there >= 0.0 {
                left.push(next.toward(corner, there / (there - here)));
            }
        }
        left
    }

    fn push(&mut self, corner: Homogeneous) {
        if let Some(slot) = self.corners.get_mut(self.count) {
            *slot = corner;
            self.count += 1;
        }
    }

    /// Nearness on a triangle that was cut: from its own corners, as places far out of the picture
    /// are too coarse for it.
    pub(crate) fn plane(&self, triangle: &[Homogeneous; 3]) -> Plane {
        let [a, b, c] = triangle.map(|corner| [corner.x, corner.y, corner.w].map(f64::from));
        let cross = |a: [f64; 3], b: [f64; 3], at: usize| {
            let (next, last) = ((at + 1) % 3, (at + 2) % 3);
            a[next] * b[last] - a[last] * b[next]
        };
        let volume: f64 = (0..3).map(|at| a[at] * cross(b, c, at)).sum();
        let part = |at: usize| {
            let part = (cross(b, c, at) + cross(c, a, at) + cross(a, b, at)) / volume;
            let part = part as f32;
            if is_too_steep(part) { 0.0 } else { part }
        };
        let corners = self.corners.get(..self.count).unwrap_or_default();
        let (least, most) = corners
            .iter()
            .map(|corner| 1.0 / corner.w)
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), nearness| {
                (least.min(nearness), most.max(nearness))
            });
        let (across, down, nearness) = (part(0), part(1), part(2));
        Plane { anchor: [0.0; 2], nearness, across, down, least, most }
    }

    /// What is left, as triangles in the picture.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [Point; 3]> {
        let corners = self.corners.get(..self.count).unwrap_or_default();
        let first = corners.first().copied();
        let pairs = corners.windows(2).skip(1).filter_map(|pair| pair.first_chunk::<2>().copied());
        first.into_iter().flat_map(move |first| {
            pairs.clone().map(move |[a, b]| [first.point(), a.point(), b.point()])
        })
    }
}
