//! Which clusters of a scene a view may show: found once for all of its rows.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, mask32x8};

use crate::model::{Block, Model};
use crate::reach::{Reach, Slack};
use crate::scene::{Placed, Scene};
use crate::vector::{LANES, V8, affine, splat};
use crate::view::{Projection, View, seen_from};

/// Balls that would be smaller than this in the picture, in pixels, are left out.
const RADIUS_PX_MIN: f32 = 0.35;
/// Clusters are drawn by their distance in steps of a quarter of an octave, from the nearest one
/// that a view has.
const STEPS: usize = 128;
/// Bits of a distance below its exponent and a quarter of it.
const STEP_BITS: u32 = 21;

/// The clusters that a view may show, near ones first.
///
/// **Determinism:** which clusters there are, and their order, follow from the view and the scene.
#[derive(Debug, Default)]
pub struct Prospect {
    /// Models of which any cluster may be seen.
    pub(crate) locals: Vec<Local>,
    pub(crate) chosen: Vec<Chosen>,
}

/// A placed model as the view sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Local {
    /// Place in the scene.
    pub(crate) placed: u32,
    pub(crate) projection: Projection,
}

/// A cluster that may be seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Chosen {
    /// Place in the list of locals.
    pub(crate) local: u32,
    pub(crate) cluster: u32,
    /// First and last column, first and last row of the picture that it may reach.
    pub(crate) ends: [f32; 4],
    /// Nothing of it is nearer to the viewer than this; unused for the sun.
    pub(crate) nearest_m: f32,
    pub(crate) step: u32,
}

impl Prospect {
    /// What a view may show of a scene, where things of several levels may be off by so
    /// many pixels.
    pub fn of(level: Level, view: &View, scene: &Scene<'_>, error_px: f32) -> Self {
        Self::new(level, &view.projection(), (scene.placed, error_px))
    }

    pub(crate) fn new(
        level: Level,
        projection: &Projection,
        (placed, error_px): (&[Placed<'_>], f32),
    ) -> Self {
        let mut prospect = Self::default();
        let mut found = Vec::with_capacity(4 * placed.len());
        prospect.locals.reserve(placed.len());
        for (at, one) in placed.iter().enumerate() {
            let stretch = stretch(one);
            let (centre, radius) = one.model.ball();
            let centre = one.world_from_model.map(|row| affine(row, centre));
            if !projection.may_see(centre, radius * stretch) {
                continue;
            }
            let local = projection.within(&one.world_from_model);
            let number = prospect.locals.len() as u32;
            prospect.locals.push(Local { placed: at as u32, projection: local });
            let eye =
                if local.is_sun { None } else { seen_from(&one.world_from_model, local.eye_m) };
            let per_error = stretch * local.focal_px[0].max(local.focal_px[1]) / error_px;
            let slack = Slack::of(&local, one.model);
            let looker = Looker { local: &local, slack, stretch, eye, number, per_error };
            dispatch!(level, simd => looker.choose(simd, one.model, &mut found));
        }
        prospect.order(&found);
        prospect
    }

    /// First and last column, first and last row of the boxes around models on the sun's map.
    pub(crate) fn boxes<'a>(
        &'a self,
        placed: &'a [Placed<'_>],
    ) -> impl Iterator<Item = [f32; 4]> + 'a {
        self.locals.iter().filter_map(|Local { placed: at, projection }| {
            let one = placed.get(*at as usize)?;
            let (centre, radius) = one.model.ball();
            let [across, down, _] = projection.norms.map(|norm| norm * radius * stretch(one));
            let x = affine(projection.x, centre) + projection.centre_px[0];
            let y = affine(projection.y, centre) + projection.centre_px[1];
            Some([x - across, x + across, y - down, y + down])
        })
    }

    /// Near ones first; what is equally far, to a quarter of an octave, stays in its order.
    fn order(&mut self, found: &[Chosen]) {
        let mut next = [0usize; STEPS + 1];
        let of = |one: &Chosen| (one.step as usize).min(STEPS - 1);
        found.iter().for_each(|one| next[of(one) + 1] += 1);
        for step in 0..STEPS {
            next[step + 1] += next[step];
        }
        self.chosen.resize(found.len(), Chosen::default());
        for one in found {
            let at = &mut next[of(one)];
            if let Some(slot) = self.chosen.get_mut(*at) {
                *slot = *one;
            }
            *at += 1;
        }
    }
}

/// How much longer than in its own frame a model's longest axis is.
fn stretch(placed: &Placed<'_>) -> f32 {
    let [a, b, c] = placed.world_from_model;
    let square = |at: usize| a[at] * a[at] + b[at] * b[at] + c[at] * c[at];
    square(0).max(square(1)).max(square(2)).sqrt()
}

/// A view in a model's frame.
struct Looker<'a> {
    local: &'a Projection,
    slack: Slack,
    stretch: f32,
    /// `None` if no cluster can be told to turn away.
    eye: Option<[f32; 3]>,
    number: u32,
    /// At which distance something may be off by a metre of the model's own.
    per_error: f32,
}

impl Looker<'_> {
    /// Adds the clusters of a model that may be seen, eight at a time.
    #[inline(always)]
    fn choose<S: Simd>(&self, simd: S, model: &Model, found: &mut Vec<Chosen>) {
        let least_step = if self.local.is_sun { 1.0f32 } else { self.local.near_m }.to_bits();
        for (block, clusters) in model.blocks.iter().enumerate() {
            let [x, y, z, radius] =
                clusters.balls.each_ref().map(|part| f32x8::from_slice(simd, part));
            let centre = V8 { x, y, z };
            let reach = radius * self.stretch;
            let w = centre.row(self.local.w);
            let distance = self.distance(simd, w, reach);
            let is_large = (reach * self.local.focal_px[0]).simd_ge(distance * RADIUS_PX_MIN);
            let mut may_show = is_large & self.is_in_view(simd, centre, w, reach);
            if let Some(eye) = self.eye {
                let [ax, ay, az, sine] =
                    clusters.cones.each_ref().map(|part| f32x8::from_slice(simd, part));
                let to_centre = centre.minus(V8::splat(simd, eye));
                let along = to_centre.dot(V8 { x: ax, y: ay, z: az });
                may_show &= along.simd_lt(sine * to_centre.norm() + radius);
            }
            if clusters.has_levels {
                may_show &= self.is_of_level(simd, clusters);
            }
            if !may_show.any_true() {
                continue;
            }
            let boxes = Reach::of(simd, self.local, &self.slack, &clusters.boxes);
            let mut rest = (may_show & (boxes.may_show | !boxes.is_known)).to_bitmask();
            if rest == 0 {
                continue;
            }
            let ends = self.ends(simd, centre, w, reach);
            let ends = [0, 1, 2, 3].map(
                #[inline(always)]
                |at| boxes.is_known.select(boxes.ends[at], ends[at]).to_array(),
            );
            let nearest_m = boxes.is_known.select(boxes.nearest_m.max(distance), distance);
            let nearest_m = nearest_m.to_array();
            let distance = distance.to_array();
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                found.push(Chosen {
                    local: self.number,
                    cluster: (block * LANES + lane) as u32,
                    ends: ends.map(|end| end[lane]),
                    nearest_m: nearest_m[lane],
                    step: distance[lane].to_bits().saturating_sub(least_step) >> STEP_BITS,
                });
            }
        }
    }

    /// Which clusters are of the level of their things that is drawn: the coarsest one that is off
    /// by little enough.
    #[inline(always)]
    fn is_of_level<S: Simd>(&self, simd: S, clusters: &Block) -> mask32x8<S> {
        let [x, y, z, radius] =
            clusters.level_balls.each_ref().map(|part| f32x8::from_slice(simd, part));
        let [from_m, to_m] = &clusters.errors_m;
        let from_m = f32x8::from_slice(simd, from_m) * self.per_error;
        let to_m = f32x8::from_slice(simd, to_m) * self.per_error;
        let w = V8 { x, y, z }.row(self.local.w);
        let distance = self.distance(simd, w, radius * self.stretch);
        distance.simd_ge(from_m) & distance.simd_lt(to_m)
    }

    /// How near balls come; for the sun, 1.
    #[inline(always)]
    fn distance<S: Simd>(&self, simd: S, w: f32x8<S>, reach: f32x8<S>) -> f32x8<S> {
        if self.local.is_sun {
            return splat(simd, 1.0);
        }
        (w - reach).max(splat(simd, self.local.near_m))
    }

    /// Whether any of some balls may be in the picture.
    #[inline(always)]
    fn is_in_view<S: Simd>(
        &self,
        simd: S,
        centre: V8<S>,
        w: f32x8<S>,
        reach: f32x8<S>,
    ) -> mask32x8<S> {
        let Projection { limits, norms, .. } = *self.local;
        let zero = splat(simd, 0.0);
        let ahead =
            if self.local.is_sun { centre.row(self.local.nearness) } else { w - self.local.near_m };
        let (x, y) = (centre.row(self.local.x), centre.row(self.local.y));
        let (half_width, half_height) = (w * limits[0], w * limits[1]);
        (ahead + reach * norms[2]).simd_ge(zero)
            & (half_width + x + reach * norms[0]).simd_ge(zero)
            & (half_width - x + reach * norms[0]).simd_ge(zero)
            & (half_height + y + reach * norms[1]).simd_ge(zero)
            & (half_height - y + reach * norms[1]).simd_ge(zero)
    }

    /// First and last column, first and last row that balls may reach, generously.
    #[inline(always)]
    fn ends<S: Simd>(&self, simd: S, centre: V8<S>, w: f32x8<S>, reach: f32x8<S>) -> [f32x8<S>; 4] {
        if self.local.is_sun {
            let (first, last) = (splat(simd, f32::NEG_INFINITY), splat(simd, f32::INFINITY));
            return [first, last, first, last];
        }
        let [left, right] = self.ends_along(simd, (0, centre.row(self.local.x)), w, reach);
        let [top, bottom] = self.ends_along(simd, (1, centre.row(self.local.y)), w, reach);
        [left, right, top, bottom]
    }

    /// As [`Self::ends`], along one axis.
    #[inline(always)]
    fn ends_along<S: Simd>(
        &self,
        simd: S,
        (axis, middle): (usize, f32x8<S>),
        w: f32x8<S>,
        reach: f32x8<S>,
    ) -> [f32x8<S>; 2] {
        let (near, far) = (w - reach, w + reach);
        let is_ahead = near.simd_gt(splat(simd, self.local.near_m));
        let spread = reach * self.local.focal_px[axis];
        let (low, high) = (middle - spread, middle + spread);
        let zero = splat(simd, 0.0);
        let begins = low / low.simd_ge(zero).select(far, near);
        let ends = high / high.simd_ge(zero).select(near, far);
        let from = self.local.centre_px[axis];
        [
            is_ahead.select(begins + (from - 1.5), splat(simd, f32::NEG_INFINITY)),
            is_ahead.select(ends + (from + 1.5), splat(simd, f32::INFINITY)),
        ]
    }
}
