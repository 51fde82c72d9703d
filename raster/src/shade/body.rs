//! Vehicles, people, things, trees.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::Sight;
use crate::light::Lit;
use crate::surface::Looks;
use crate::vector::{V8, scale, smoothstep, splat};

#[inline(always)]
pub(crate) fn body<S: Simd>(simd: S, lit: &Lit<'_>, sight: &Sight<S>, looks: &Looks<S>) -> V8<S> {
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let normal = looks.normal;
    let arriving = lit.arriving(simd, sight.place_m, normal);
    let glowing = looks.colour.scaled(looks.glow * 1.6);
    let gloss = looks.gloss;
    if !gloss.simd_gt(zero).any_true() {
        return looks.colour.times(arriving.diffuse).plus(glowing);
    }
    // Clear coat or glass over the colour: sky above, dark ground below the horizon.
    let mirrored = sight.direction.mirrored(normal);
    let below = V8::splat(simd, scale(lit.light.bounce, 0.6));
    let is_above = smoothstep(simd, -0.12, 0.10, mirrored.z);
    let around = below.mixed(lit.light.sky(simd, mirrored.z), is_above);
    let glance = one + normal.dot(sight.direction).min(zero);
    let glance2 = glance * glance;
    let shine = gloss * (glance2 * glance2 * glance * 0.65 + 0.05);
    let toward_sun = mirrored.dot(V8::splat(simd, lit.light.to_light)).max(zero);
    let spark2 = toward_sun * toward_sun;
    let spark8 = spark2 * spark2 * spark2 * spark2;
    let spark = gloss * spark8 * spark8 * spark8 * 0.9;
    looks
        .colour
        .times(arriving.diffuse)
        .scaled(one - shine * 0.5)
        .plus(around.scaled(shine))
        .plus(arriving.sun.scaled(spark))
        .plus(glowing)
}
