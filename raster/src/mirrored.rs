//! What wet ground mirrors of those that stand on it.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::light::Light;
use crate::occluder::Occluder;
use crate::vector::{V8, clamp01, mix, splat};

/// What is mirrored of its wheels or feet and the gap below it, and from which part of its height
/// on it has all of its colour.
const FOOT: f32 = 0.3;
const FOOT_HEIGHT: f32 = 0.35;

/// What is seen of those that stand on the ground in directions from places on it, and the part
/// that is seen beside and above them.
#[inline(always)]
pub(crate) fn standing<S: Simd>(
    simd: S,
    (occluders, light): (&[&Occluder], &Light),
    place_m: V8<S>,
    direction: V8<S>,
) -> (V8<S>, f32x8<S>) {
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let [to_x, to_y, _] = light.to_light;
    let level = (direction.x * direction.x + direction.y * direction.y).max(splat(simd, 1e-6));
    // Their sides face back along the way; half of what they see is sky.
    let facing = (zero - (direction.x * to_x + direction.y * to_y) / level.sqrt()).max(zero);
    let around = |at: usize| {
        let sky = light.horizon[at] + (light.zenith[at] - light.horizon[at]) * 0.55;
        (sky * 0.62 + light.bounce[at] * light.night + light.bounce[at]) * 0.5
    };
    let around = V8::splat(simd, [around(0), around(1), around(2)]);
    let lit = around.plus(V8::splat(simd, light.direct).scaled(facing * 0.6));
    let mut seen = V8::splat(simd, [0.0; 3]);
    let mut rest = one;
    for occluder in occluders {
        let (part, high) = occluder.met(simd, place_m, direction);
        if !part.simd_gt(zero).any_true() {
            continue;
        }
        let bright = mix(splat(simd, FOOT), one, clamp01(simd, high * (1.0 / FOOT_HEIGHT)));
        let colour = lit.times(V8::splat(simd, occluder.colour));
        seen = seen.plus(colour.scaled(bright * part * rest));
        rest *= one - part;
    }
    (seen, rest)
}
