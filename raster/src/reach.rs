//! Which pixels boxes around clusters may cover.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8};

use crate::clip::REACH_PX;
use crate::model::Model;
use crate::vector::{LANES, V8, splat};
use crate::view::Projection;

/// Corners are on a grid of 1/256 pixel: by this much they may be beside their place, and more.
const SNAP_PX: f32 = 1.0 / 128.0;
/// What sums of three products are rounded by, at most, as a part of their largest part.
const ROUNDED: f32 = 1e-6;

/// How far numbers that are computed for places of a model in a picture may be off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slack {
    /// Columns and rows, at a distance of 1.
    place_px: [f32; 2],
    distance_m: f32,
}

impl Slack {
    /// Of a model in its own frame.
    pub(crate) fn of(local: &Projection, model: &Model) -> Self {
        let (centre, radius) = model.ball();
        let largest = |[x, y, z, w]: [f32; 4]| {
            let far = centre.map(|part| part.abs() + radius);
            x.abs() * far[0] + y.abs() * far[1] + z.abs() * far[2] + w.abs()
        };
        let distance_m = largest(local.w) * ROUNDED;
        // What is in the picture is no further from its corner than twice its middle.
        let place_px = |row: [f32; 4], centre_px: f32| {
            largest(row) * ROUNDED + 3.0 * centre_px.abs() * distance_m
        };
        let [across, down] = local.centre_px;
        Self { place_px: [place_px(local.x, across), place_px(local.y, down)], distance_m }
    }
}

/// What eight boxes may cover.
pub(crate) struct Reach<S: Simd> {
    /// Which ones are known: those all of whose corners are ahead and not far out of the picture.
    pub(crate) is_known: mask32x8<S>,
    /// Whether there is the middle of a pixel of the picture among what they may cover.
    pub(crate) may_show: mask32x8<S>,
    /// First and last column, first and last row of the pixels whose middles they may cover.
    pub(crate) ends: [f32x8<S>; 4],
    /// Nothing of them is nearer.
    pub(crate) nearest_m: f32x8<S>,
}

impl<S: Simd> Reach<S> {
    /// Of boxes in a frame.
    #[inline(always)]
    pub(crate) fn of(
        simd: S,
        local: &Projection,
        slack: &Slack,
        [low, high]: &[[[f32; LANES]; 3]; 2],
    ) -> Self {
        let load = |[x, y, z]: &[[f32; LANES]; 3]| {
            let [x, y, z] = [x, y, z].map(|part| f32x8::from_slice(simd, part));
            V8 { x, y, z }
        };
        let low = load(low);
        let size = load(high).minus(low);
        let ws = corners(local.w, low, size);
        let (xs, ys) = (corners(local.x, low, size), corners(local.y, low, size));
        let mut nearest_m = ws[0];
        let first = splat(simd, f32::INFINITY);
        let last = splat(simd, f32::NEG_INFINITY);
        let mut ends = [first, last, first, last];
        for ((x, y), w) in xs.into_iter().zip(ys).zip(ws) {
            nearest_m = nearest_m.min(w);
            let inverse = splat(simd, 1.0) / w;
            let (x, y) = (x * inverse, y * inverse);
            ends = [ends[0].min(x), ends[1].max(x), ends[2].min(y), ends[3].max(y)];
        }
        let nearest_m = nearest_m - slack.distance_m;
        let near_m = if local.is_sun { 0.5 } else { local.near_m };
        let mut is_known = nearest_m.simd_ge(splat(simd, near_m));
        let inverse = splat(simd, 1.0) / nearest_m;
        let mut may_show = is_known;
        for (axis, centre_px) in local.centre_px.into_iter().enumerate() {
            let off_px = inverse * slack.place_px[axis] + SNAP_PX;
            let (from, to) = (ends[2 * axis] + centre_px, ends[2 * axis + 1] + centre_px);
            let most = splat(simd, REACH_PX) - off_px;
            is_known &= (from + most).simd_ge(splat(simd, 0.0)) & to.simd_le(most);
            let first = (from - 0.5 - off_px).ceil().max(splat(simd, 0.0));
            let last = (to - 0.5 + off_px).floor().min(splat(simd, 2.0 * centre_px - 1.0));
            may_show &= first.simd_le(last);
            (ends[2 * axis], ends[2 * axis + 1]) = (first, last);
        }
        Self { is_known, may_show, ends, nearest_m }
    }
}

/// `row · (corner, 1)` of all corners of boxes.
#[inline(always)]
fn corners<S: Simd>(row: [f32; 4], low: V8<S>, size: V8<S>) -> [f32x8<S>; 8] {
    let (along, aside, upward) = (size.x * row[0], size.y * row[1], size.z * row[2]);
    let a = low.row(row);
    let b = a + along;
    let (c, d) = (a + aside, b + aside);
    [a, b, c, d, a + upward, b + upward, c + upward, d + upward]
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::choose::{Chosen, Local, Prospect};
    use crate::draw::{Drawing, Screen, draw};
    use crate::model::Corner;
    use crate::scene::Placed;
    use crate::target::Target;
    use crate::view::View;

    /// How far from the world's origin.
    const FAR_M: f32 = 900.0;

    /// Numbers from 0 to 1 by chance.
    struct Chance(u32);

    impl Chance {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.0 >> 8) as f32 / 16_777_216.0
        }
    }

    fn view() -> View {
        View {
            eye_m: [FAR_M, -FAR_M, 1.5],
            forward: [1.0, 0.0, 0.0],
            left: [0.0, 1.0, 0.0],
            up: [0.0, 0.0, 1.0],
            half_extent: [1.0, 0.5],
            width_px: 320,
            height_px: 160,
            near_m: 0.1,
        }
    }

    /// A triangle of a pixel or two somewhere before the view, and some beside it.
    fn model(chance: &mut Chance) -> Model {
        let ahead_m = 0.3 + 60.0 * chance.next() * chance.next();
        let aside_m = (chance.next() - 0.5) * 2.1 * ahead_m;
        let above_m = (chance.next() - 0.5) * 1.05 * ahead_m;
        let size_m = 0.015 * ahead_m;
        let mut corner = || {
            let mut off_m = || (chance.next() - 0.5) * size_m;
            let [x, y, z] = [ahead_m + off_m(), aside_m + off_m(), above_m + off_m()];
            Corner { position: [FAR_M + x, y - FAR_M, 1.5 + z], ..Corner::default() }
        };
        let corners = vec![corner(), corner(), corner()];
        // Both sides: one of them faces the view.
        Model::new(corners, &[[0, 1, 2], [0, 2, 1]], &[])
    }

    /// Goal: what is left out as it covers no pixel's middle would have shown none, however numbers
    /// are rounded far from the origin. Method: small triangles by chance; all are drawn.
    #[test]
    fn what_covers_no_middle_of_a_pixel_would_have_shown_none() {
        let (level, view, mut chance) = (Level::new(), view(), Chance(7));
        let projection = view.projection();
        let mut target = Target::default();
        let mut counts = [0; 2];
        for _ in 0..4_000 {
            let model = model(&mut chance);
            let Some(block) = model.blocks.first() else { continue };
            let slack = Slack::of(&projection, &model);
            let (is_known, may_show) = dispatch!(level, simd => {
                let reach = Reach::of(simd, &projection, &slack, &block.boxes);
                (reach.is_known.to_bitmask() & 1 == 1, reach.may_show.to_bitmask() & 1 == 1)
            });
            assert!(is_known, "it is ahead");
            let ends = [f32::NEG_INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY];
            let prospect = Prospect {
                locals: vec![Local { placed: 0, projection }],
                chosen: vec![Chosen { ends, ..Chosen::default() }],
            };
            let in_place = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
            let placed = [Placed {
                model: &model,
                world_from_model: in_place,
                tints: [[0; 4]; 4],
                label: 0,
            }];
            let drawing =
                Drawing { placed: &placed, prospect: &prospect, is_hidden: None, slope: 0.0 };
            let mut seen = Vec::new();
            target.clear(view.width_px, 0..view.height_px, true);
            draw(level, &drawing, &mut Screen::default(), &mut target, &mut seen);
            assert!(may_show || seen.is_empty(), "{:?}", model.blocks);
            counts[usize::from(may_show)] += 1;
        }
        assert!(counts[0] > 400 && counts[1] > 400, "{counts:?}");
    }
}
