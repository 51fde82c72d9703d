//! One triangle onto the pixels: which it covers, and where it is nearest.
//!
//! Whether a triangle covers a pixel, and how near it is there, follows from the triangle and the
//! pixel alone, never from the pixels around: a picture is the same in whatever parts it is drawn.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8, u32x8};

use crate::target::Target;
use crate::vector::{LANES, middles, splat};

/// Triangles wider than this have the ends of each row computed first.
const WIDE_PX: i32 = 24;

/// Changes of nearness in a pixel that are larger count as none: sums of them may be no number.
const CHANGE_MAX: f32 = 1e30;

/// Whether a change of nearness in a pixel cannot be computed with; so if it is no number.
pub(crate) fn is_too_steep(change: f32) -> bool {
    change.is_nan() || change.abs() > CHANGE_MAX
}

/// A corner of a triangle in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// On a grid of 1/256 pixel, for what is covered.
    pub(crate) snapped: [f32; 2],
    /// As it is, for how near it is.
    pub(crate) exact: [f32; 2],
    pub(crate) nearness: f32,
}

/// Positive on the inner side of one of a triangle's sides. Both triangles at a side compute the
/// same number with another sign.
#[derive(Clone, Copy)]
struct Edge {
    anchor: [f32; 2],
    along: [f32; 2],
    /// What the number must exceed: pixels on the line belong to the triangle right of or below it.
    threshold: f32,
}

impl Edge {
    #[inline(always)]
    fn new(from: [f32; 2], to: [f32; 2]) -> Self {
        let along = [to[0] - from[0], to[1] - from[1]];
        let is_first = (from[1], from[0]) <= (to[1], to[0]);
        let owns_line = along[1] < 0.0 || (along[1] == 0.0 && along[0] > 0.0);
        Self {
            anchor: if is_first { from } else { to },
            along,
            threshold: if owns_line { -f32::MIN_POSITIVE } else { 0.0 },
        }
    }

    /// The part that a row of pixels shares.
    #[inline(always)]
    fn of_row(&self, y: f32) -> f32 {
        self.along[0] * (y - self.anchor[1])
    }

    /// The part that a column of pixels shares.
    #[inline(always)]
    fn of_column<S: Simd>(&self, x: f32x8<S>) -> f32x8<S> {
        (x - self.anchor[0]) * self.along[1]
    }

    /// Which pixels of a row are on the inner side.
    #[inline(always)]
    fn holds<S: Simd>(&self, simd: S, of_row: f32, of_column: f32x8<S>) -> mask32x8<S> {
        (splat(simd, of_row) - of_column).simd_gt(splat(simd, self.threshold))
    }

    /// Narrows the ends of a row to what may be covered, generously.
    #[inline(always)]
    fn narrow(&self, of_row: f32, ends: &mut [f32; 2]) {
        let down = self.along[1];
        if down != 0.0 {
            let meets = self.anchor[0] + of_row / down;
            if down > 0.0 {
                ends[1] = ends[1].min(meets + 1.5);
            } else {
                ends[0] = ends[0].max(meets - 1.5);
            }
        }
    }
}

/// Nearness as it changes over the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub(crate) anchor: [f32; 2],
    pub(crate) nearness: f32,
    pub(crate) across: f32,
    pub(crate) down: f32,
    pub(crate) least: f32,
    pub(crate) most: f32,
}

impl Plane {
    /// Through three corners, less what `slope` says of the steepest change in a pixel.
    #[inline(always)]
    pub(crate) fn new([a, b, c]: &[Point; 3], slope: f32) -> Self {
        let [bx, by] = [b.exact[0] - a.exact[0], b.exact[1] - a.exact[1]];
        let [cx, cy] = [c.exact[0] - a.exact[0], c.exact[1] - a.exact[1]];
        let (bn, cn) = (b.nearness - a.nearness, c.nearness - a.nearness);
        let area = bx * cy - by * cx;
        let per_area = 1.0 / area;
        let (mut across, mut down) =
            ((bn * cy - cn * by) * per_area, (cn * bx - bn * cx) * per_area);
        if is_too_steep(across) || is_too_steep(down) {
            (across, down) = (0.0, 0.0);
        }
        let back = slope * across.abs().max(down.abs());
        Self {
            anchor: a.exact,
            nearness: a.nearness - back,
            across,
            down,
            least: a.nearness.min(b.nearness).min(c.nearness) - back,
            most: a.nearness.max(b.nearness).max(c.nearness) - back,
        }
    }
}

/// Twice the area of three places, positive if they run clockwise as rows grow downwards.
pub(crate) fn doubled_area([a, b, c]: [[f32; 2]; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// First and last column, first and last row of the pixels whose middles are in a triangle's box.
pub(crate) fn ends_of([a, b, c]: [[f32; 2]; 3]) -> [f32; 4] {
    let first = |axis: usize| (a[axis].min(b[axis]).min(c[axis]) - 0.5).ceil();
    let last = |axis: usize| (a[axis].max(b[axis]).max(c[axis]) - 0.5).floor();
    [first(0), last(0), first(1), last(1)]
}

/// One corner of eight triangles each.
type Corners<S> = [f32x8<S>; 2];

/// Of eight triangles, in pictures as [`Edge`] has them, whether they cover the middle of any pixel
/// at the ends of their boxes. `is_clockwise` is how their corners run.
#[inline(always)]
pub(crate) fn covers_an_end<S: Simd>(
    simd: S,
    (a, b, c): (Corners<S>, Corners<S>, Corners<S>),
    is_clockwise: mask32x8<S>,
    [left, right, top, bottom]: [f32x8<S>; 4],
) -> mask32x8<S> {
    let second = [is_clockwise.select(b[0], c[0]), is_clockwise.select(b[1], c[1])];
    let third = [is_clockwise.select(c[0], b[0]), is_clockwise.select(c[1], b[1])];
    let edges = [
        EightEdges::new(simd, a, second),
        EightEdges::new(simd, second, third),
        EightEdges::new(simd, third, a),
    ];
    let (x, y) = ([left + 0.5, right + 0.5], [top + 0.5, bottom + 0.5]);
    let [first, second, third] = &edges;
    let of_first = first.holds_ends(x, y);
    let of_second = second.holds_ends(x, y);
    let of_third = third.holds_ends(x, y);
    (of_first[0] & of_second[0] & of_third[0])
        | (of_first[1] & of_second[1] & of_third[1])
        | (of_first[2] & of_second[2] & of_third[2])
        | (of_first[3] & of_second[3] & of_third[3])
}

/// An [`Edge`] of eight triangles each: the same numbers.
struct EightEdges<S: Simd> {
    anchor: [f32x8<S>; 2],
    along: [f32x8<S>; 2],
    threshold: f32x8<S>,
}

impl<S: Simd> EightEdges<S> {
    #[inline(always)]
    fn new(simd: S, from: [f32x8<S>; 2], to: [f32x8<S>; 2]) -> Self {
        let zero = splat(simd, 0.0);
        let along = [to[0] - from[0], to[1] - from[1]];
        let is_first = from[1].simd_lt(to[1]) | (from[1].simd_eq(to[1]) & from[0].simd_le(to[0]));
        let owns_line = along[1].simd_lt(zero) | (along[1].simd_eq(zero) & along[0].simd_gt(zero));
        Self {
            anchor: [is_first.select(from[0], to[0]), is_first.select(from[1], to[1])],
            along,
            threshold: owns_line.select(splat(simd, -f32::MIN_POSITIVE), zero),
        }
    }

    /// Whether places are on the inner side: in two columns, of two rows each.
    #[inline(always)]
    fn holds_ends(&self, x: [f32x8<S>; 2], y: [f32x8<S>; 2]) -> [mask32x8<S>; 4] {
        let upper = self.along[0] * (y[0] - self.anchor[1]);
        let lower = self.along[0] * (y[1] - self.anchor[1]);
        let left = (x[0] - self.anchor[0]) * self.along[1];
        let right = (x[1] - self.anchor[0]) * self.along[1];
        [
            (upper - left).simd_gt(self.threshold),
            (lower - left).simd_gt(self.threshold),
            (upper - right).simd_gt(self.threshold),
            (lower - right).simd_gt(self.threshold),
        ]
    }
}

/// Draws a triangle whose corners run clockwise, with the ends of its box; whether any pixel shows
/// it.
#[inline(always)]
pub(crate) fn fill<S: Simd>(
    simd: S,
    target: &mut Target,
    (points, ends): (&[Point; 3], [f32; 4]),
    plane: &Plane,
    id: u32,
) -> bool {
    let [Point { snapped: a, .. }, Point { snapped: b, .. }, Point { snapped: c, .. }] = *points;
    let [left, right, top, bottom] = ends;
    let last_row = (target.first_row + target.row_count) as f32 - 1.0;
    let (left, right) = (left.max(0.0), right.min(target.width_px as f32 - 1.0));
    let (top, bottom) = (top.max(target.first_row as f32), bottom.min(last_row));
    if left > right || top > bottom {
        return false;
    }
    let edges = [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)];
    let columns = [left as usize & !(LANES - 1), right as usize];
    if columns[1] - columns[0] < 2 * LANES {
        return fill_narrow(simd, target, (columns, [top, bottom]), (&edges, plane), id);
    }
    let is_wide = right - left > WIDE_PX as f32;
    let mut is_seen = false;
    for row in top as u32..=bottom as u32 {
        let y = row as f32 + 0.5;
        let of_row = [edges[0].of_row(y), edges[1].of_row(y), edges[2].of_row(y)];
        let mut ends = [left, right];
        if is_wide {
            for (edge, of_row) in edges.iter().zip(of_row) {
                edge.narrow(of_row, &mut ends);
            }
            if ends[0] > ends[1] {
                continue;
            }
        }
        let first = (ends[0] as usize) & !(LANES - 1);
        let line = (row - target.first_row) as usize;
        is_seen |= fill_row(
            simd,
            target,
            (line, first, ends[1] as usize),
            (&edges, of_row),
            (plane, y),
            id,
        );
    }
    is_seen
}

/// As [`fill`], of a triangle that reaches over a few columns: what rows share is computed once.
#[inline(always)]
fn fill_narrow<S: Simd>(
    simd: S,
    target: &mut Target,
    ([first, last], [top, bottom]): ([usize; 2], [f32; 2]),
    (edges, plane): (&[Edge; 3], &Plane),
    id: u32,
) -> bool {
    let mut is_seen = false;
    for at in (first..=last).step_by(LANES) {
        let eight = Eight::new(simd, at, edges, plane);
        for row in top as u32..=bottom as u32 {
            let y = row as f32 + 0.5;
            let of_row = [edges[0].of_row(y), edges[1].of_row(y), edges[2].of_row(y)];
            let line = (row - target.first_row) as usize;
            is_seen |= eight.fill(simd, target, line, (edges, of_row), (plane, y), id);
        }
    }
    is_seen
}

#[inline(always)]
fn fill_row<S: Simd>(
    simd: S,
    target: &mut Target,
    (line, first, last): (usize, usize, usize),
    (edges, of_row): (&[Edge; 3], [f32; 3]),
    (plane, y): (&Plane, f32),
    id: u32,
) -> bool {
    let mut is_seen = false;
    for at in (first..=last).step_by(LANES) {
        let eight = Eight::new(simd, at, edges, plane);
        is_seen |= eight.fill(simd, target, line, (edges, of_row), (plane, y), id);
    }
    is_seen
}

/// Eight columns of pixels: what their rows share.
struct Eight<S: Simd> {
    at: usize,
    of_columns: [f32x8<S>; 3],
    nearness: f32x8<S>,
}

impl<S: Simd> Eight<S> {
    #[inline(always)]
    fn new(simd: S, at: usize, [a, b, c]: &[Edge; 3], plane: &Plane) -> Self {
        let x = middles(simd, at);
        let of_columns = [a.of_column(x), b.of_column(x), c.of_column(x)];
        Self { at, of_columns, nearness: (x - plane.anchor[0]) * plane.across }
    }

    /// Puts a triangle on a line of them; whether any pixel shows it.
    #[inline(always)]
    fn fill(
        &self,
        simd: S,
        target: &mut Target,
        line: usize,
        ([a, b, c], of_row): (&[Edge; 3], [f32; 3]),
        (plane, y): (&Plane, f32),
        id: u32,
    ) -> bool {
        let inside = a.holds(simd, of_row[0], self.of_columns[0])
            & b.holds(simd, of_row[1], self.of_columns[1])
            & c.holds(simd, of_row[2], self.of_columns[2]);
        let of_line = plane.nearness + plane.down * (y - plane.anchor[1]);
        let near = splat(simd, of_line) + self.nearness;
        let near = near.max(splat(simd, plane.least)).min(splat(simd, plane.most));
        let first = line * target.stride + self.at;
        let Some(slot) = target.nearness.get_mut(first..first + LANES) else { return false };
        let old = f32x8::from_slice(simd, slot);
        let wins = inside & near.simd_gt(old);
        if !wins.any_true() {
            return false;
        }
        wins.select(near, old).store_slice(slot);
        if let Some(slot) = target.ids.get_mut(first..first + LANES) {
            let old = u32x8::from_slice(simd, slot);
            wins.select(u32x8::splat(simd, id), old).store_slice(slot);
            target.touch(line, self.at);
        }
        true
    }
}

#[cfg(test)]
mod tests;
