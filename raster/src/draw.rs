//! Everything in view onto a target, cluster by cluster.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};

use crate::choose::{Chosen, Local, Prospect};
use crate::clip::{Clipped, Homogeneous, REACH_PX, SNAP};
use crate::fill::{Plane, Point, covers_an_end, doubled_area, ends_of, fill};
use crate::model::{Cluster, Model};
use crate::scene::Placed;
use crate::target::Target;
use crate::vector::{LANES, V8, splat};
use crate::view::Projection;

/// Room for the corners of a cluster: as many as a byte numbers, so that none is out of it.
const CORNERS_MAX: usize = 256;

/// How much nearer than it is something counts as before it is left out as hidden: more than
/// numbers are rounded by.
const NEARER: f32 = 0.999;
const NEARER_M: f32 = 1e-3;

/// A triangle with fewer columns and rows is small.
const SMALL_PX: f32 = 3.0;

/// A triangle that some pixel has shown.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    pub(crate) placed: u32,
    pub(crate) triangle: u32,
    /// Whether it may show some pixels at most.
    pub(crate) is_small: bool,
}

/// Corners of a cluster in the picture.
#[derive(Debug)]
pub(crate) struct Screen {
    snapped: [[f32; CORNERS_MAX]; 2],
    exact: [[f32; CORNERS_MAX]; 2],
    nearness: [f32; CORNERS_MAX],
    /// Before the division.
    homogeneous: [[f32; CORNERS_MAX]; 3],
}

impl Default for Screen {
    fn default() -> Self {
        let zeros = [0.0; CORNERS_MAX];
        Self { snapped: [zeros; 2], exact: [zeros; 2], nearness: zeros, homogeneous: [zeros; 3] }
    }
}

/// What is drawn how.
pub(crate) struct Drawing<'a> {
    pub(crate) placed: &'a [Placed<'a>],
    pub(crate) prospect: &'a Prospect,
    /// Whether the thing with this number is hidden.
    pub(crate) is_hidden: Option<&'a (dyn Fn(u32) -> bool + Sync)>,
    /// How much of the steepest change in a pixel everything is put back by.
    pub(crate) slope: f32,
}

/// Draws onto a target and lists the triangles that are seen, in the order of their ids.
pub(crate) fn draw(
    level: Level,
    drawing: &Drawing<'_>,
    screen: &mut Screen,
    target: &mut Target,
    seen: &mut Vec<Seen>,
) {
    seen.clear();
    dispatch!(level, simd => draw_all(simd, drawing, screen, target, seen));
}

#[inline(always)]
fn draw_all<S: Simd>(
    simd: S,
    drawing: &Drawing<'_>,
    screen: &mut Screen,
    target: &mut Target,
    seen: &mut Vec<Seen>,
) {
    let Prospect { locals, chosen } = drawing.prospect;
    let first_row = target.first_row as f32;
    let end_row = first_row + target.row_count as f32;
    for Chosen { local, cluster, ends, nearest_m, .. } in chosen {
        let [_, _, top, bottom] = ends;
        if *bottom < first_row || *top > end_row {
            continue;
        }
        let least_m = nearest_m * NEARER - NEARER_M;
        if least_m > 0.0 && target.hides(simd, *ends, 1.0 / least_m) {
            continue;
        }
        let Some(Local { placed: at, projection: local }) = locals.get(*local as usize) else {
            continue;
        };
        let Some(placed) = drawing.placed.get(*at as usize) else { continue };
        let Some(cluster) = placed.model.clusters.get(*cluster as usize) else { continue };
        let needs_clip = transform(simd, local, placed.model, cluster, screen);
        let one = OneCluster { drawing, local, placed_at: *at, model: placed.model, screen };
        for first in cluster.triangles.clone().step_by(LANES) {
            one.draw_eight(simd, first, target, seen);
            if needs_clip && !local.is_sun {
                one.draw_clipped(simd, first, target, seen);
            }
        }
    }
}

/// Puts a cluster's corners into the picture; whether one of them cannot be.
#[inline(always)]
fn transform<S: Simd>(
    simd: S,
    local: &Projection,
    model: &Model,
    cluster: &Cluster,
    screen: &mut Screen,
) -> bool {
    let [xs, ys, zs] = model.xyz.each_ref().map(|axis| axis.get(cluster.corners.clone()));
    let (Some(xs), Some(ys), Some(zs)) = (xs, ys, zs) else { return false };
    let mut needs_clip = false;
    let near_m = if local.is_sun { 0.5 } else { local.near_m };
    for at in (0..xs.len().min(CORNERS_MAX)).step_by(LANES) {
        let place = V8 {
            x: f32x8::from_slice(simd, &xs[at..at + LANES]),
            y: f32x8::from_slice(simd, &ys[at..at + LANES]),
            z: f32x8::from_slice(simd, &zs[at..at + LANES]),
        };
        let w = place.row(local.w);
        // Measured from the picture's corner, so that limits are the same for all pictures.
        let across = place.row(local.x) + w * local.centre_px[0];
        let down = place.row(local.y) + w * local.centre_px[1];
        let inverse = splat(simd, 1.0) / w;
        let exact = [across * inverse, down * inverse];
        let nearness = if local.is_sun { place.row(local.nearness) } else { inverse };
        let reach = splat(simd, REACH_PX);
        let is_good = w.simd_ge(splat(simd, near_m))
            & exact[0].abs().simd_le(reach)
            & exact[1].abs().simd_le(reach);
        needs_clip |= !is_good.all_true();
        let none = splat(simd, f32::NAN);
        for ((exact, snapped), exact_slot) in
            exact.into_iter().zip(&mut screen.snapped).zip(&mut screen.exact)
        {
            is_good.select((exact + SNAP) - SNAP, none).store_slice(&mut snapped[at..at + LANES]);
            exact.store_slice(&mut exact_slot[at..at + LANES]);
        }
        nearness.store_slice(&mut screen.nearness[at..at + LANES]);
        for (slot, value) in screen.homogeneous.iter_mut().zip([across, down, w]) {
            value.store_slice(&mut slot[at..at + LANES]);
        }
    }
    needs_clip
}

/// One coordinate of the three corners of eight triangles.
#[inline(always)]
fn corners<S: Simd>(
    simd: S,
    axis: &[f32; CORNERS_MAX],
    triangles: &[[u8; LANES]; 3],
) -> [f32x8<S>; 3] {
    let mut parts = [[0.0; LANES]; 3];
    for (parts, numbers) in parts.iter_mut().zip(triangles) {
        for (part, number) in parts.iter_mut().zip(numbers) {
            *part = axis[usize::from(*number)];
        }
    }
    let [a, b, c] = parts;
    [f32x8::load_array(simd, a), f32x8::load_array(simd, b), f32x8::load_array(simd, c)]
}

/// First and last pixel whose middle is between three numbers.
#[inline(always)]
fn ends<S: Simd>(simd: S, a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> (f32x8<S>, f32x8<S>) {
    let half = splat(simd, 0.5);
    ((a.min(b).min(c) - half).ceil(), (a.max(b).max(c) - half).floor())
}

/// A cluster whose corners are in the picture.
struct OneCluster<'a> {
    drawing: &'a Drawing<'a>,
    local: &'a Projection,
    placed_at: u32,
    model: &'a Model,
    screen: &'a Screen,
}

impl OneCluster<'_> {
    /// Draws those of eight triangles that face the viewer and have a pixel's middle in their box.
    #[inline(always)]
    fn draw_eight<S: Simd>(
        &self,
        simd: S,
        first: usize,
        target: &mut Target,
        seen: &mut Vec<Seen>,
    ) {
        let Some(triangles) = self.model.local.get(first / LANES) else { return };
        let [xs, ys] = &self.screen.snapped;
        let [ax, bx, cx] = corners(simd, xs, triangles);
        let [ay, by, cy] = corners(simd, ys, triangles);
        let area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
        let zero = splat(simd, 0.0);
        let faces = if self.local.is_sun {
            area.simd_gt(zero) | area.simd_lt(zero)
        } else {
            area.simd_lt(zero)
        };
        let (left, right) = ends(simd, ax, bx, cx);
        let (top, bottom) = ends(simd, ay, by, cy);
        let last_row = (target.first_row + target.row_count) as f32 - 1.0;
        let may_show = faces
            & left.simd_le(right)
            & top.simd_le(bottom)
            & right.simd_ge(zero)
            & left.simd_le(splat(simd, target.width_px as f32 - 1.0))
            & bottom.simd_ge(splat(simd, target.first_row as f32))
            & top.simd_le(splat(simd, last_row));
        let mut rest = may_show.to_bitmask();
        if rest == 0 {
            return;
        }
        // Most that are small lie between the middles of pixels.
        let one = splat(simd, 1.0);
        let is_small = (right - left).simd_le(one) & (bottom - top).simd_le(one);
        if (is_small & may_show).any_true() {
            let corners = ([ax, ay], [bx, by], [cx, cy]);
            let ends = [left, right, top, bottom];
            let covers = covers_an_end(simd, corners, area.simd_gt(zero), ends);
            rest &= (covers | !is_small).to_bitmask();
        }
        let ends = [left, right, top, bottom].map(|end| end.to_array());
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let [a, b, c] = triangles;
            let points = [self.point(a[lane]), self.point(b[lane]), self.point(c[lane])];
            let plane = Plane::new(&points, self.drawing.slope);
            let ends = [ends[0][lane], ends[1][lane], ends[2][lane], ends[3][lane]];
            self.draw_one(simd, first + lane, (points, plane, ends), target, seen);
        }
    }

    #[inline(always)]
    fn point(&self, at: u8) -> Point {
        let at = usize::from(at);
        let Screen { snapped: [xs, ys], exact: [exact_xs, exact_ys], nearness, .. } = self.screen;
        Point {
            snapped: [xs[at], ys[at]],
            exact: [exact_xs[at], exact_ys[at]],
            nearness: nearness[at],
        }
    }

    /// Draws those of eight triangles that have a corner which is not in the picture.
    #[inline(always)]
    fn draw_clipped<S: Simd>(
        &self,
        simd: S,
        first: usize,
        target: &mut Target,
        seen: &mut Vec<Seen>,
    ) {
        let Some(triangles) = self.model.local.get(first / LANES) else { return };
        for lane in 0..LANES {
            let triangle = triangles.map(|numbers| numbers[lane]);
            let is_whole =
                triangle.iter().all(|at| !self.screen.snapped[0][usize::from(*at)].is_nan());
            if is_whole || triangle[0] == triangle[1] {
                continue;
            }
            let [xs, ys, ws] = &self.screen.homogeneous;
            let corners = triangle.map(|at| {
                let at = usize::from(at);
                Homogeneous { x: xs[at], y: ys[at], w: ws[at] }
            });
            let clipped = Clipped::new(corners, self.local);
            for points in clipped.triangles() {
                if doubled_area(points.map(|point| point.snapped)) < 0.0 {
                    let plane = clipped.plane(&corners);
                    let ends = ends_of(points.map(|point| point.snapped));
                    self.draw_one(simd, first + lane, (points, plane, ends), target, seen);
                }
            }
        }
    }

    #[inline(always)]
    fn draw_one<S: Simd>(
        &self,
        simd: S,
        triangle: usize,
        ([a, b, c], plane, ends): ([Point; 3], Plane, [f32; 4]),
        target: &mut Target,
        seen: &mut Vec<Seen>,
    ) {
        if let Some(is_hidden) = self.drawing.is_hidden
            && self.model.thing(triangle).is_some_and(is_hidden)
        {
            return;
        }
        let is_clockwise = doubled_area([a.snapped, b.snapped, c.snapped]) > 0.0;
        let points = if is_clockwise { [a, b, c] } else { [a, c, b] };
        let id = seen.len() as u32 + 1;
        let is_seen = simd.vectorize(
            #[inline(always)]
            || fill(simd, target, (&points, ends), &plane, id),
        );
        if is_seen {
            let [left, right, top, bottom] = ends;
            let is_small = right - left < SMALL_PX && bottom - top < SMALL_PX;
            seen.push(Seen { placed: self.placed_at, triangle: triangle as u32, is_small });
        }
    }
}
