//! Vehicles, people, things, trees.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::{Inside, Sight};
use crate::light::Lit;
use crate::noise::noise;
use crate::quality::Quality;
use crate::surface::Looks;
use crate::vector::{V8, clamp01, scale, smoothstep, splat};

/// Of what leaves and bark are drawn as: the numbers of the shaders'.
const LEAVES: f32 = 5.0;
const BARK: f32 = 6.0;

#[inline(always)]
pub(crate) fn body<S: Simd>(
    simd: S,
    lit: &Lit<'_>,
    (sight, looks): (&Sight<S>, &Looks<S>),
    inside: Option<Inside<S>>,
) -> V8<S> {
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let looks = grown(simd, lit, sight, looks);
    let normal = looks.normal;
    let arriving = lit.arriving(simd, (sight.place_m, normal), splat(simd, 1.0));
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
    let mut own = looks.colour.times(arriving.diffuse);
    if let Some(inside) = inside {
        own = inside.seen(simd, lit.light, (sight, &looks), (arriving.diffuse, own));
    }
    own.scaled(one - shine * 0.5)
        .plus(around.scaled(shine))
        .plus(arriving.sun.scaled(spark))
        .plus(glowing)
}

/// What is seen, with leaves and bark where plants are.
#[inline(always)]
fn grown<S: Simd>(simd: S, lit: &Lit<'_>, sight: &Sight<S>, looks: &Looks<S>) -> Looks<S> {
    let mut grown = *looks;
    let is_leaf = looks.pattern.simd_eq(splat(simd, LEAVES));
    if is_leaf.any_true() {
        let leaves = leaves(simd, lit, sight, looks);
        grown.normal = leaves.normal.or(is_leaf, looks.normal);
        grown.colour = leaves.colour.or(is_leaf, looks.colour);
    }
    let is_bark = looks.pattern.simd_eq(splat(simd, BARK));
    if lit.quality == Quality::High && is_bark.any_true() {
        let footprint = sight.distance_m * sight.pixel;
        let V8 { x, y, z } = sight.place_m;
        let fade = clamp01(simd, splat(simd, 1.0) - footprint * 12.0);
        let ridge = (noise(simd, (x + y) * 17.0, z * 2.6 + y * 3.0) - 0.5) * fade;
        let bark = looks.colour.scaled(ridge * 1.1 + 1.0);
        grown.colour = bark.or(is_bark, grown.colour);
    }
    grown
}

/// Clumps of leaves, lighter and darker, that face all ways. Two sections through the air, so that
/// neither shows its grain on all sides of a crown. The variant says which green a tree has, and
/// how much light gets to the leaves.
#[inline(always)]
fn leaves<S: Simd>(simd: S, lit: &Lit<'_>, sight: &Sight<S>, looks: &Looks<S>) -> Looks<S> {
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let footprint = sight.distance_m * sight.pixel;
    let V8 { x, y, z } = sight.place_m;
    let [(a, b), (c, d)] = [(x + z * 0.5, y + z * 0.3), (z + y * 0.4, x - y * 0.6)];
    let clump_fade = clamp01(simd, one - footprint * 1.2);
    let clump = (noise(simd, a * 1.9, b * 1.9) + noise(simd, c * 2.3, d * 2.3) - 1.0) * clump_fade;
    let leaf_fade = clamp01(simd, one - footprint * 6.0);
    let (mut leaf, mut other) = (zero, zero);
    if lit.quality == Quality::High && leaf_fade.simd_gt(zero).any_true() {
        leaf = (noise(simd, a * 9.0, b * 9.0) - 0.5) * leaf_fade;
        other = (noise(simd, c * 10.0, d * 10.0) - 0.5) * leaf_fade;
    }
    let vary = (clump * 0.8 + (leaf + other) * 0.9 + 1.0).max(splat(simd, 0.25));
    let green = (looks.variant * 0.25).floor();
    let shade = looks.variant - green * 4.0;
    let dark = shade.simd_lt(splat(simd, 0.5)).select(splat(simd, 0.55), shade * 0.17 + 0.8);
    let tint = V8 { x: green * 0.15 + 0.8, y: green * 0.06 + 0.9, z: one - green * 0.05 };
    let colour = looks.colour.times(tint).scaled(vary * dark);
    let yellowed = colour.times(V8::splat(simd, [1.35, 1.1, 0.8]));
    let bend =
        V8 { x: leaf + clump * 0.5, y: other - clump * 0.4, z: (leaf - other) * 0.6 + clump * 0.4 };
    Looks {
        normal: looks.normal.plus(bend.scaled(splat(simd, 0.9))).unit(simd),
        colour: colour.mixed(yellowed, clamp01(simd, clump + 0.3)),
        ..*looks
    }
}
