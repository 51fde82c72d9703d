//! What stands on the ground and keeps the light of the sky from it.

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

/// A thing that stands on level ground. The formula is that of `open_sky` in `ground.wgsl`.
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
}

impl Reaching for Occluder {
    fn ball(&self) -> (V3, f32) {
        (self.place_m, self.reach_m())
    }
}

impl Occluder {
    /// Further from its middle it darkens nothing, in metres.
    pub fn reach_m(&self) -> f32 {
        let [length, width] = self.half_m;
        let beside_m = (length * length + width * width).sqrt() + self.height_m * REACH_HEIGHTS;
        (beside_m * beside_m + 4.0 * LEVEL_M * LEVEL_M).sqrt()
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

    const CAR: Occluder = Occluder {
        place_m: [10.0, 5.0, 0.0],
        ahead: [0.0, 1.0],
        half_m: [2.3, 0.9],
        height_m: 1.4,
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

    #[test]
    fn a_road_below_a_bridge_is_not_its_ground() {
        assert_eq!(open([10.0, 5.0, -5.0]), 1.0);
        assert!(open([10.0, 5.0, -0.5]) < 0.1);
    }
}
