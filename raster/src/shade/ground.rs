//! Roads, sidewalks, lawns, roofs.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::Sight;
use crate::lamp::streaks;
use crate::light::Lit;
use crate::mirrored::standing;
use crate::noise::{hash, noise};
use crate::occluder::open_sky;
use crate::quality::Quality;
use crate::surface::Looks;
use crate::vector::{V8, clamp01, fract, mix, splat};

/// Side of a slab of a sidewalk, and length of a kerb stone.
const SLAB_M: f32 = 1.5;

#[inline(always)]
pub(crate) fn ground<S: Simd>(simd: S, lit: &Lit<'_>, sight: &Sight<S>, looks: &Looks<S>) -> V8<S> {
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    // Width of this pixel on level ground: detail finer than that fades out.
    let slant = sight.direction.z.abs().max(splat(simd, 0.03));
    let footprint = sight.distance_m * sight.pixel / slant;
    let (x, y, normal) = (sight.place_m.x, sight.place_m.y, looks.normal);

    let broad = noise(simd, x * 0.23, y * 0.23);
    let (mut grain, mut middle) = (zero, zero);
    let (grain_fade, middle_fade) =
        (clamp01(simd, one - footprint * 16.0), clamp01(simd, one - footprint * 0.8));
    let is_fine = lit.quality == Quality::High;
    if is_fine && grain_fade.simd_gt(zero).any_true() {
        grain = grit(simd, (x, y), footprint) * grain_fade;
    }
    if is_fine && middle_fade.simd_gt(zero).any_true() {
        middle = (noise(simd, x * 1.7, y * 1.7) - 0.5) * middle_fade;
    }

    let (is_marking, is_kerb, is_paving, is_grass) =
        (is(simd, looks, 1.0), is(simd, looks, 2.0), is(simd, looks, 3.0), is(simd, looks, 4.0));
    let (mut joint, mut slab) = (zero, zero);
    if (is_paving + is_kerb).simd_gt(zero).any_true() {
        let joint_fade = clamp01(simd, one - footprint * 1.2);
        let (u, v) = (x / SLAB_M, y / SLAB_M);
        let blur = (footprint * 0.5).max(splat(simd, 0.004));
        joint =
            line(simd, u, blur).max(line(simd, v, blur)) * joint_fade * (is_paving + is_kerb * 0.6);
        let cell = hash((u + 0.5).floor(), (v + 0.5).floor());
        slab = (cell - 0.5) * is_paving * joint_fade;
    }

    let broad_off = broad - 0.5;
    let mut vary = broad_off * 0.30 + middle * 0.22 + grain * 0.22 + slab * 0.20 + 1.0;
    vary = mix(vary, middle * 0.75 + grain * 0.7 + broad_off * 0.55 + 1.0, is_grass);
    // Worn paint shows the road through.
    vary = mix(vary, one - (middle + grain * 0.6).max(zero) * 0.25, is_marking);
    let mut albedo = looks.colour.scaled(vary * (one - joint * 0.45));
    let yellowed = albedo.times(V8::splat(simd, [1.25, 1.05, 0.7]));
    albedo = albedo.mixed(yellowed, is_grass * broad * 0.5);

    let open = open_sky(simd, lit.occluders, sight.place_m);
    let arriving = lit.arriving(simd, (sight.place_m, normal), open);
    let wetness = lit.light.wet;
    if wetness <= 0.0 {
        return albedo.times(arriving.diffuse);
    }
    let wet = clamp01(simd, broad + 0.35) * (one - is_grass) * wetness;
    albedo = albedo.scaled(one - wet * 0.45);
    let mirrored = sight.direction.mirrored(normal);
    let glance = one + normal.dot(sight.direction).min(zero);
    let glance2 = glance * glance;
    let shine = (glance2 * glance2 * glance * 0.5 + 0.02) * wet;
    let mut around = lit.light.sky(simd, mirrored.z);
    if !lit.occluders.is_empty() {
        let things = (lit.occluders, lit.light);
        let (seen, rest) = standing(simd, things, sight.place_m, mirrored);
        around = around.scaled(rest).plus(seen);
    }
    if !lit.lamps.is_empty() {
        around =
            around.plus(streaks(simd, lit.lamps, sight.place_m, mirrored).scaled(splat(simd, 6.0)));
    }
    albedo.times(arriving.diffuse).plus(around.scaled(shine))
}

/// What is small on the ground, about -0.5 to 0.5: grains of 3 cm, and of 1 cm where a pixel is as
/// small.
#[inline(always)]
fn grit<S: Simd>(simd: S, (x, y): (f32x8<S>, f32x8<S>), footprint: f32x8<S>) -> f32x8<S> {
    let coarse = noise(simd, x * 31.0, y * 31.0) - 0.5;
    let fade = clamp01(simd, splat(simd, 1.0) - footprint * 50.0);
    if !fade.simd_gt(splat(simd, 0.0)).any_true() {
        return coarse * 1.3;
    }
    let fine = (noise(simd, y * 97.0, x * 97.0) - 0.5) * fade;
    (coarse + fine * 0.8) * 1.3
}

/// 1 where the ground has a pattern, else 0.
#[inline(always)]
fn is<S: Simd>(simd: S, looks: &Looks<S>, pattern: f32) -> f32x8<S> {
    looks.pattern.simd_eq(splat(simd, pattern)).select(splat(simd, 1.0), splat(simd, 0.0))
}

/// How much of a joint between slabs is at a place, in slabs.
#[inline(always)]
fn line<S: Simd>(simd: S, at: f32x8<S>, blur: f32x8<S>) -> f32x8<S> {
    let to_joint = (fract(at) - 0.5).abs() * SLAB_M;
    let t = clamp01(simd, (to_joint - (0.5 * SLAB_M - 0.022) + blur) / (blur * 2.0));
    t * t * (splat(simd, 3.0) - t * 2.0)
}
