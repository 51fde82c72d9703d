//! Everything in view onto a target, cluster by cluster.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};

use crate::clip::{Clipped, Homogeneous, REACH_PX, SNAP};
use crate::fill::{LANES, Plane, Point, doubled_area, fill};
use crate::model::{Cluster, Model};
use crate::target::Target;
use crate::vector::{V8, splat};
use crate::view::{Projection, seen_from};

/// Balls that would be smaller than this in the picture, in pixels, are left out.
const RADIUS_PX_MIN: f32 = 0.35;
/// Corners of a cluster.
const CORNERS_MAX: usize = 192;

/// A model in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// What.
    pub model: &'a Model,
    /// Where: the upper three rows of world from model; a turn after a stretch along the axes.
    pub world_from_model: [[f32; 4]; 3],
    /// Four linear colours, 8 bits a channel; alpha is the part that glows.
    pub tints: [[u8; 4]; 4],
    /// What it belongs to; 0 where its corners say it.
    pub label: u32,
}

/// A triangle that some pixel has shown.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    pub(crate) placed: u32,
    pub(crate) triangle: u32,
}

/// What drawing needs while it draws, kept to be used again.
#[derive(Debug, Default)]
pub(crate) struct Work {
    /// Nearness, then the order of arrival; and which cluster of which model.
    order: Vec<(u64, u32, u32)>,
    screen: Screen,
}

/// Corners of a cluster in the picture.
#[derive(Debug)]
struct Screen {
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
    pub(crate) projection: &'a Projection,
    pub(crate) placed: &'a [Placed<'a>],
    /// Whether the thing with this number is hidden.
    pub(crate) is_hidden: Option<&'a (dyn Fn(u32) -> bool + Sync)>,
    /// How much of the steepest change in a pixel everything is put back by.
    pub(crate) slope: f32,
}

/// Draws onto a target and lists the triangles that are seen, in the order of their ids.
pub(crate) fn draw(
    level: Level,
    drawing: &Drawing<'_>,
    work: &mut Work,
    target: &mut Target,
    seen: &mut Vec<Seen>,
) {
    seen.clear();
    let locals: Vec<Projection> = drawing
        .placed
        .iter()
        .map(|placed| drawing.projection.within(&placed.world_from_model))
        .collect();
    choose(drawing, &locals, &mut work.order);
    let Work { order, screen } = work;
    dispatch!(level, simd => draw_all(simd, drawing, (&locals, order), screen, target, seen));
}

/// Lists the clusters that may be seen, near ones first.
fn choose(drawing: &Drawing<'_>, locals: &[Projection], order: &mut Vec<(u64, u32, u32)>) {
    order.clear();
    for (at, (placed, local)) in drawing.placed.iter().zip(locals).enumerate() {
        let model = placed.model;
        let (centre, radius) = model.ball();
        if !local.may_see(centre, radius) {
            continue;
        }
        let size_px = local.focal_px * stretch(placed);
        let eye = seen_from(&placed.world_from_model, drawing.projection.eye_m());
        for (number, cluster) in model.clusters.iter().enumerate() {
            let distance = local.distance(cluster.centre, cluster.radius);
            let is_small = size_px * cluster.radius < RADIUS_PX_MIN * distance;
            let turns_away = !local.is_sun && eye.is_some_and(|eye| cluster.turns_away(eye));
            if is_small || turns_away || !local.may_see(cluster.centre, cluster.radius) {
                continue;
            }
            let key = (u64::from(distance.to_bits()) << 32) | order.len() as u64;
            order.push((key, at as u32, number as u32));
        }
    }
    if !drawing.projection.is_sun {
        order.sort_unstable();
    }
}

/// How much longer than in its own frame a model's longest axis is.
fn stretch(placed: &Placed<'_>) -> f32 {
    let [a, b, c] = placed.world_from_model;
    let square = |at: usize| a[at] * a[at] + b[at] * b[at] + c[at] * c[at];
    square(0).max(square(1)).max(square(2)).sqrt()
}

impl Cluster {
    fn turns_away(&self, eye: crate::vector::V3) -> bool {
        let (axis, sine) = self.cone;
        let to_centre = crate::vector::sub(self.centre, eye);
        let distance = crate::vector::norm(to_centre);
        crate::vector::dot(to_centre, axis) >= sine * distance + self.radius
    }
}

#[inline(always)]
fn draw_all<S: Simd>(
    simd: S,
    drawing: &Drawing<'_>,
    (locals, order): (&[Projection], &[(u64, u32, u32)]),
    screen: &mut Screen,
    target: &mut Target,
    seen: &mut Vec<Seen>,
) {
    for (_, at, number) in order {
        let (Some(placed), Some(local)) =
            (drawing.placed.get(*at as usize), locals.get(*at as usize))
        else {
            continue;
        };
        let Some(cluster) = placed.model.clusters.get(*number as usize) else { continue };
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
    triangles: &[[u8; 3]; LANES],
) -> [f32x8<S>; 3] {
    let mut parts = [[0.0; LANES]; 3];
    for (lane, [a, b, c]) in triangles.iter().enumerate() {
        parts[0][lane] = axis[usize::from(*a)];
        parts[1][lane] = axis[usize::from(*b)];
        parts[2][lane] = axis[usize::from(*c)];
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
        let Some(triangles) = self.model.local.get(first..).and_then(<[_]>::first_chunk) else {
            return;
        };
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
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let [a, b, c] = triangles[lane];
            let points = [self.point(a), self.point(b), self.point(c)];
            let plane = Plane::new(&points, self.drawing.slope);
            self.draw_one(simd, first + lane, (points, plane), target, seen);
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
        let Some(triangles) = self.model.local.get(first..first + LANES) else { return };
        for (lane, triangle) in triangles.iter().enumerate() {
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
                    self.draw_one(simd, first + lane, (points, plane), target, seen);
                }
            }
        }
    }

    #[inline(always)]
    fn draw_one<S: Simd>(
        &self,
        simd: S,
        triangle: usize,
        ([a, b, c], plane): ([Point; 3], Plane),
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
            || fill(simd, target, &points, &plane, id),
        );
        if is_seen {
            seen.push(Seen { placed: self.placed_at, triangle: triangle as u32 });
        }
    }
}
