//! What stands on the ground: it keeps the light of the sky from it, and wet ground mirrors it.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::rows::Reaching;
use crate::vector::{V3, V8, clamp01, splat};

/// Occluders of one picture at most.
pub const OCCLUDERS_MAX: usize = 64;

/// Further than this many times its height beside an occluder the sky is whole.
const REACH_HEIGHTS: f32 = 3.0;
/// How high its underside is above the ground, as a part of its height.
const GAP: f32 = 0.15;
/// Ground this much higher or lower is another's.
const LEVEL_M: f32 = 1.0;
/// Mirrored, it fades from this part of its height on, which is where most taper off.
const TAPERS: f32 = 0.65;
/// So it does where the way through it is shorter than this part of its width.
const CORNER: f32 = 0.3;

/// A thing that stands on level ground. The formulas are those of `open_sky` and `standing` in
/// `ground.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occluder {
    /// Middle of its footprint, on the ground.
    pub place_m: [f32; 3],
    /// Unit vector along its length.
    pub ahead: [f32; 2],
    /// Half of its length and width.
    pub half_m: [f32; 2],
    /// Of its sides; no more than it is wide, or it would hide more than its width does.
    pub height_m: f32,
    /// As which it is mirrored.
    pub tall_m: f32,
    /// Mean linear reflectance of its sides.
    pub colour: [f32; 3],
}

impl Reaching for Occluder {
    fn ball(&self) -> (V3, f32) {
        (self.place_m, self.reach_m())
    }
}

impl Occluder {
    /// Further from its middle it darkens nothing, in metres. What wet ground mirrors of it is seen
    /// within the same ball, as it is seen below the ground.
    pub fn reach_m(&self) -> f32 {
        let [length, width] = self.half_m;
        let corner_m = (length * length + width * width).sqrt();
        let beside_m = corner_m + self.height_m * REACH_HEIGHTS;
        let darkens_m = (beside_m * beside_m + 4.0 * LEVEL_M * LEVEL_M).sqrt();
        darkens_m.max((corner_m * corner_m + self.tall_m * self.tall_m).sqrt())
    }

    /// Part of the sky that it hides from level places.
    ///
    /// Beside a wall that is `h` high, at `s` from it, it is `(1 − s / √(s² + h²)) / 2`, which is
    /// the form factor of an endless wall; below an underside the same holds for what is seen of
    /// the sky through the gap.
    #[inline(always)]
    fn hides<S: Simd>(&self, simd: S, place_m: V8<S>) -> f32x8<S> {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let (x, y) = (place_m.x - self.place_m[0], place_m.y - self.place_m[1]);
        let [ahead_x, ahead_y] = self.ahead;
        let along = (x * ahead_x + y * ahead_y).abs() - self.half_m[0];
        let across = (y * ahead_x - x * ahead_y).abs() - self.half_m[1];
        let (beyond, aside) = (along.max(zero), across.max(zero));
        let outside = (beyond * beyond + aside * aside).sqrt();
        let inside = along.max(across).min(zero);
        let away_m = outside + inside;
        let height = inside
            .simd_lt(zero)
            .select(splat(simd, self.height_m * GAP), splat(simd, self.height_m));
        let part = one - away_m / (away_m * away_m + height * height).sqrt();
        let fades = clamp01(simd, one - outside * (1.0 / (self.height_m * REACH_HEIGHTS)));
        let uneven_m = (place_m.z - self.place_m[2]).abs();
        let level = clamp01(simd, splat(simd, 2.0) - uneven_m * (1.0 / LEVEL_M));
        part * 0.5 * fades * level
    }
}

impl Occluder {
    /// What of it is met in a direction from places, 0 to 1, and how high, as a part of its height.
    ///
    /// A box whose upper end and upright edges are soft.
    #[inline(always)]
    pub(crate) fn met<S: Simd>(
        &self,
        simd: S,
        place_m: V8<S>,
        direction: V8<S>,
    ) -> (f32x8<S>, f32x8<S>) {
        let zero = splat(simd, 0.0);
        let [ahead_x, ahead_y] = self.ahead;
        let (x, y) = (place_m.x - self.place_m[0], place_m.y - self.place_m[1]);
        let (dx, dy) = (direction.x, direction.y);
        let along = (x * ahead_x + y * ahead_y, dx * ahead_x + dy * ahead_y);
        let across = (y * ahead_x - x * ahead_y, dy * ahead_x - dx * ahead_y);
        let [length, width] = self.half_m;
        let along = through(simd, along, length);
        let across = through(simd, across, width);
        let enters = along[0].max(across[0]).max(zero);
        let leaves = along[1].min(across[1]);
        let level = (dx * dx + dy * dy).sqrt();
        let way = (leaves - enters) * level * (1.0 / (2.0 * CORNER * length.min(width)));
        let high = (place_m.z - self.place_m[2] + direction.z * enters) * (1.0 / self.tall_m);
        let below = (splat(simd, 1.0) - high) * (1.0 / (1.0 - TAPERS));
        let uneven_m = (place_m.z - self.place_m[2]).abs();
        let is_level = clamp01(simd, splat(simd, 2.0) - uneven_m * (1.0 / LEVEL_M));
        (clamp01(simd, way) * clamp01(simd, below) * is_level, high)
    }
}

/// Where a way enters a slab around 0 and where it leaves it, in steps of the way.
#[inline(always)]
fn through<S: Simd>(simd: S, (at, step): (f32x8<S>, f32x8<S>), half_m: f32) -> [f32x8<S>; 2] {
    let tiny = splat(simd, 1e-5);
    let inverse = splat(simd, 1.0) / step.abs().simd_lt(tiny).select(tiny, step);
    let (one, other) = ((at + half_m) * inverse, (at - half_m) * inverse);
    let zero = splat(simd, 0.0);
    [zero - one.max(other), zero - one.min(other)]
}

/// Part of the sky that is seen from level places among occluders.
#[inline(always)]
pub(crate) fn open_sky<S: Simd>(simd: S, occluders: &[&Occluder], place_m: V8<S>) -> f32x8<S> {
    let mut open = splat(simd, 1.0);
    for occluder in occluders {
        let (middle, reach_m) = occluder.ball();
        let from = place_m.minus(V8::splat(simd, middle));
        if from.dot(from).simd_lt(splat(simd, reach_m * reach_m)).any_true() {
            open *= splat(simd, 1.0) - occluder.hides(simd, place_m);
        }
    }
    open
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::vector::unit;

    const CAR: Occluder = Occluder {
        place_m: [10.0, 5.0, 0.0],
        ahead: [0.0, 1.0],
        half_m: [2.3, 0.9],
        height_m: 1.4,
        tall_m: 1.5,
        colour: [0.5, 0.1, 0.1],
    };

    fn open(place_m: V3) -> f32 {
        dispatch!(Level::new(), simd => {
            open_sky(simd, &[&CAR], V8::splat(simd, place_m)).to_array()[0]
        })
    }

    #[test]
    fn the_ground_is_darkest_below_a_car_and_open_some_metres_beside_it() {
        let across = [0.0, 0.7, 0.9, 1.0, 1.5, 2.5, 4.0, 5.2].map(|x| open([10.0 + x, 5.0, 0.0]));
        assert!(across.is_sorted(), "{across:?}");
        assert!(across[0] < 0.05, "{across:?}");
        // Half of the sky is behind a wall that one stands at.
        assert!((across[2] - 0.5).abs() < 0.01, "{across:?}");
        assert_eq!(across[7], 1.0);
        assert!(
            open([10.0, 7.2, 0.0]) < 0.5 && open([12.2, 5.0, 0.0]) > 0.7,
            "its length is along y"
        );
    }

    /// How much of the car is met from a place on the ground in a direction.
    fn met([x, y]: [f32; 2], direction: V3) -> f32 {
        dispatch!(Level::new(), simd => {
            let place_m = V8::splat(simd, [x, y, 0.0]);
            CAR.met(simd, place_m, V8::splat(simd, unit(direction))).0.to_array()[0]
        })
    }

    #[test]
    fn a_car_is_met_by_ways_through_it_and_by_no_other() {
        assert_eq!(met([0.0, 5.0], [1.0, 0.0, 0.05]), 1.0, "from aside");
        assert_eq!(met([10.0, -10.0], [0.0, 1.0, 0.05]), 1.0, "from behind");
        assert_eq!(met([10.2, 5.0], [1.0, 0.0, 0.1]), 1.0, "from below");
        assert_eq!(met([0.0, 5.0], [-1.0, 0.0, 0.05]), 0.0, "away from it");
        assert_eq!(met([0.0, 8.0], [1.0, 0.0, 0.05]), 0.0, "past its end");
        assert_eq!(met([0.0, 5.0], [1.0, 0.0, 0.17]), 0.0, "over it");
        let upper = met([0.0, 5.0], [1.0, 0.0, 0.14]);
        assert!(upper > 0.0 && upper < 1.0, "its upper end is soft: {upper}");
        assert_eq!(met([0.0, 5.0], [1.0, 0.01, 0.05]), met([0.0, 5.0], [1.0, -0.01, 0.05]));
    }

    #[test]
    fn a_road_below_a_bridge_is_not_its_ground() {
        assert_eq!(open([10.0, 5.0, -5.0]), 1.0);
        assert!(open([10.0, 5.0, -0.5]) < 0.1);
    }
}
