//! Lamps that light what is around them: head lamps, street lamps, brake lights.
//!
//! A lamp throws no shadows. It lights nothing nearer than [`MOUNT_M`], so that what carries it
//! stays as it is.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::rows::Reaching;
use crate::vector::{V3, V8, clamp, clamp01, cross, splat};

/// Lamps of one picture at most.
pub const LAMPS_MAX: usize = 64;

/// Nearer than this a lamp lights nothing, in metres.
const MOUNT_M: f32 = 0.5;
/// How rough surfaces are: light from aside reaches a little round their edge, as it does on
/// asphalt, which throws much of a grazing beam back.
const ROUGH: f32 = 0.25;
/// How sharply a beam ends at its upper edge, and what is left above.
const CUT_SHARP: f32 = 25.0;
const CUT_REST: f32 = 0.03;

/// One lamp in the world. The formula is that of `sent` in `arriving.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Where it is.
    pub place_m: [f32; 3],
    /// No light gets further.
    pub reach_m: f32,
    /// Radiance of a white wall that faces it, 1 m before it in the middle of the beam.
    pub colour: [f32; 3],
    /// Unit vector along the middle of the beam.
    pub ahead: [f32; 3],
    /// Unit vector to the left of it.
    pub left: [f32; 3],
    /// Inverse tangents of the angles to the side and upwards at which half of the light is left;
    /// 0 for a lamp that shines everywhere alike.
    pub narrow: [f32; 2],
    /// Tangent of the angle above which there is hardly any light.
    pub cut: f32,
    /// Whether it also shines behind itself.
    pub is_round: bool,
}

impl Lamp {
    /// Light that arrives at places with unit normals.
    #[inline(always)]
    fn light<S: Simd>(&self, simd: S, place_m: V8<S>, normal: V8<S>) -> V8<S> {
        let from_lamp = place_m.minus(V8::splat(simd, self.place_m));
        let square = from_lamp.dot(from_lamp);
        let reach = splat(simd, self.reach_m * self.reach_m);
        if !square.simd_lt(reach).any_true() {
            return V8::splat(simd, [0.0; 3]);
        }
        let direction = from_lamp.scaled(splat(simd, 1.0) / square.sqrt().max(splat(simd, 1e-3)));
        let facing = (splat(simd, ROUGH) - normal.dot(direction)) * (1.0 / (1.0 + ROUGH));
        let part = facing.max(splat(simd, 0.0)) * self.sent(simd, direction, square);
        V8::splat(simd, self.colour).scaled(part)
    }

    /// Part of its light that goes in a direction and arrives at the square of a distance.
    #[inline(always)]
    fn sent<S: Simd>(&self, simd: S, direction: V8<S>, square: f32x8<S>) -> f32x8<S> {
        let one = splat(simd, 1.0);
        let along = direction.dot(V8::splat(simd, self.ahead));
        let inverse = one / along.max(splat(simd, 0.05));
        let side = direction.dot(V8::splat(simd, self.left)) * inverse;
        let upward = direction.dot(V8::splat(simd, cross(self.ahead, self.left))) * inverse;
        let (wide, tall) = (side * self.narrow[0], upward * self.narrow[1]);
        let beam = one / (wide * wide + tall * tall + 1.0);
        let below = clamp01(simd, (splat(simd, self.cut) - upward) * CUT_SHARP + 0.5);
        let before = if self.is_round { one } else { clamp(simd, along * 4.0, 0.0, 1.0) };
        let fades = clamp01(simd, one - square * (1.0 / (self.reach_m * self.reach_m)));
        let leaves = clamp01(simd, (square.sqrt() - MOUNT_M) * 0.8);
        let weakens = fades * fades * leaves / square.max(splat(simd, 1e-3));
        beam * (below * (1.0 - CUT_REST) + CUT_REST) * before * weakens
    }
}

impl Reaching for Lamp {
    fn ball(&self) -> (V3, f32) {
        (self.place_m, self.reach_m)
    }
}

/// Light of all lamps that arrives at places with unit normals.
#[inline(always)]
pub(crate) fn lamplight<S: Simd>(simd: S, lamps: &[&Lamp], place_m: V8<S>, normal: V8<S>) -> V8<S> {
    let mut sum = V8::splat(simd, [0.0; 3]);
    for lamp in lamps {
        sum = sum.plus(lamp.light(simd, place_m, normal));
    }
    sum
}

/// What a wet road at places mirrors of all lamps: streaks towards the eye, as ripples turn the
/// surface more along the view than across it.
#[inline(always)]
pub(crate) fn streaks<S: Simd>(simd: S, lamps: &[&Lamp], place_m: V8<S>, mirrored: V8<S>) -> V8<S> {
    let mut sum = V8::splat(simd, [0.0; 3]);
    let level = (mirrored.x * mirrored.x + mirrored.y * mirrored.y).max(splat(simd, 1e-6));
    for lamp in lamps {
        let from_lamp = place_m.minus(V8::splat(simd, lamp.place_m));
        let square = from_lamp.dot(from_lamp);
        if !square.simd_lt(splat(simd, lamp.reach_m * lamp.reach_m)).any_true() {
            continue;
        }
        let direction = from_lamp.scaled(splat(simd, 1.0) / square.sqrt().max(splat(simd, 1e-3)));
        let flat = (direction.x * direction.x + direction.y * direction.y).max(splat(simd, 1e-6));
        let across = (mirrored.x * direction.y - mirrored.y * direction.x) * 20.0;
        let toward = (mirrored.x * direction.x + mirrored.y * direction.y).min(splat(simd, 0.0));
        let steep = (mirrored.z + direction.z) * 2.5;
        let thin = splat(simd, 1.0) / (across * across / (level * flat) + 1.0);
        let along = splat(simd, 1.0) / (steep * steep + 1.0);
        let is_before = toward.simd_lt(splat(simd, 0.0)).select(splat(simd, 1.0), splat(simd, 0.0));
        let part = thin * thin * along * is_before * lamp.sent(simd, direction, square);
        sum = sum.plus(V8::splat(simd, lamp.colour).scaled(part));
    }
    sum
}

/// A unit vector to the left of another one, level where there is such.
pub(crate) fn left_of(ahead: V3) -> V3 {
    let [x, y, _] = ahead;
    let length = (x * x + y * y).sqrt();
    if length > 1e-4 { [-y / length, x / length, 0.0] } else { [0.0, 1.0, 0.0] }
}

impl Lamp {
    /// A lamp that shines in all directions alike.
    pub fn round(place_m: [f32; 3], colour: [f32; 3], reach_m: f32) -> Self {
        let ahead = [1.0, 0.0, 0.0];
        let (narrow, cut) = ([0.0; 2], 1e3);
        Self { place_m, reach_m, colour, ahead, left: left_of(ahead), narrow, cut, is_round: true }
    }

    /// A lamp whose light leaves in a direction.
    pub fn beam(place_m: [f32; 3], ahead: [f32; 3], colour: [f32; 3], reach_m: f32) -> Self {
        let (narrow, cut) = ([1.0; 2], 1e3);
        Self { place_m, reach_m, colour, ahead, left: left_of(ahead), narrow, cut, is_round: false }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    const UP: V3 = [0.0, 0.0, 1.0];

    fn light(lamp: &Lamp, place_m: V3, normal: V3) -> f32 {
        dispatch!(Level::new(), simd => {
            lamp.light(simd, V8::splat(simd, place_m), V8::splat(simd, normal)).x.to_array()[0]
        })
    }

    fn low_beam() -> Lamp {
        let beam = Lamp::beam([0.0, 0.0, 0.65], [1.0, 0.0, 0.0], [800.0; 3], 60.0);
        Lamp { narrow: [2.5, 30.0], cut: -0.01, ..beam }
    }

    #[test]
    fn a_beam_lights_the_road_ahead_and_neither_the_one_behind_nor_what_is_out_of_reach() {
        let on_road = |x: f32, y: f32| light(&low_beam(), [x, y, 0.0], UP);
        assert!(on_road(10.0, 0.0) > 0.2 && on_road(20.0, 0.0) > 0.1, "{}", on_road(10.0, 0.0));
        assert!(on_road(10.0, 12.0) < 0.3 * on_road(10.0, 0.0));
        assert_eq!([on_road(-5.0, 0.0), on_road(61.0, 0.0)], [0.0; 2]);
    }

    #[test]
    fn a_low_beam_ends_at_its_upper_edge() {
        let on_wall = |z: f32| light(&low_beam(), [20.0, 0.0, z], [-1.0, 0.0, 0.0]);
        assert!(on_wall(0.2) > 10.0 * on_wall(1.7), "{} {}", on_wall(0.2), on_wall(1.7));
        assert!(on_wall(1.7) > 0.0);
    }

    #[test]
    fn what_faces_away_and_what_carries_the_lamp_stay_dark() {
        let lamp = Lamp::round([0.0, 0.0, 1.0], [5.0; 3], 10.0);
        assert_eq!(light(&lamp, [2.0, 0.0, 1.0], [1.0, 0.0, 0.0]), 0.0);
        assert_eq!(light(&lamp, [0.4, 0.0, 1.0], [-1.0, 0.0, 0.0]), 0.0);
        assert!(light(&lamp, [2.0, 0.0, 1.0], [-1.0, 0.0, 0.0]) > 1.0);
    }
}
