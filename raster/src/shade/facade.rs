//! Walls with windows and storeys.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::Sight;
use crate::light::Lit;
use crate::noise::{hash, noise};
use crate::quality::Quality;
use crate::surface::Looks;
use crate::vector::{V8, clamp, fract, splat, step};

const BAY_M: f32 = 3.0;
const STOREY_M: f32 = 3.3;
/// What lintels shade of the panes below them and cornices of the wall, in storeys.
const RECESS: f32 = 0.045;
const EAVES: f32 = 0.05;
/// Height in metres up to which the corner at its foot keeps light from a wall.
const FOOT_M: f32 = 1.6;

/// Part of a pixel of some width that lies from one number to another in a pattern with period 1.
#[inline(always)]
fn covered<S: Simd>(
    simd: S,
    (middle, width): (f32x8<S>, f32x8<S>),
    low: f32x8<S>,
    high: f32x8<S>,
) -> f32x8<S> {
    let half = width * 0.5;
    let span = high - low;
    (up_to(simd, middle + half, low, span) - up_to(simd, middle - half, low, span)) / width
}

#[inline(always)]
fn up_to<S: Simd>(simd: S, at: f32x8<S>, low: f32x8<S>, span: f32x8<S>) -> f32x8<S> {
    at.floor() * span + (fract(at) - low).max(splat(simd, 0.0)).min(span)
}

/// How much of eight pixels is what.
struct Parts<S: Simd> {
    pane: f32x8<S>,
    frame: f32x8<S>,
    cross_bar: f32x8<S>,
    cornice: f32x8<S>,
    /// In the shade of a lintel or a cornice.
    shaded: f32x8<S>,
    is_ground_floor: f32x8<S>,
}

#[inline(always)]
fn parts<S: Simd>(simd: S, quality: Quality, sight: &Sight<S>, looks: &Looks<S>) -> Parts<S> {
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let footprint = sight.distance_m * sight.pixel;
    let slant = looks.normal.dot(sight.direction).abs().max(splat(simd, 0.08));
    let (bay, storey) = (looks.facade_m[0] / BAY_M, looks.facade_m[1] / STOREY_M);
    let least = splat(simd, 0.004);
    let across = (bay, (footprint / (slant * BAY_M)).max(least));
    let upward = (storey, (footprint / STOREY_M).max(least));
    let has_windows = step(simd, zero, storey);
    let is_ground_floor = has_windows * storey.simd_lt(one).select(one, zero);
    let opening = covered(
        simd,
        across,
        by_floor(simd, 0.26, 0.10, is_ground_floor),
        by_floor(simd, 0.74, 0.90, is_ground_floor),
    );
    let lintel = by_floor(simd, 0.80, 0.78, is_ground_floor);
    let pane = opening * covered(simd, upward, by_floor(simd, 0.28, 0.12, is_ground_floor), lintel);
    let frame = covered(
        simd,
        across,
        by_floor(simd, 0.22, 0.06, is_ground_floor),
        by_floor(simd, 0.78, 0.94, is_ground_floor),
    ) * covered(
        simd,
        upward,
        by_floor(simd, 0.23, 0.06, is_ground_floor),
        by_floor(simd, 0.84, 0.82, is_ground_floor),
    );
    let bar = covered(simd, across, splat(simd, 0.485), splat(simd, 0.515));
    let cornice = covered(simd, upward, splat(simd, 0.94), one);
    let mut shaded = zero;
    if quality == Quality::High {
        shaded = opening * covered(simd, upward, lintel - RECESS, lintel) * 0.55
            + covered(simd, upward, splat(simd, 0.94 - EAVES), splat(simd, 0.94)) * 0.3;
    }
    Parts {
        shaded: has_windows * shaded,
        pane: has_windows * pane,
        frame: has_windows * frame,
        cross_bar: bar * (one - is_ground_floor),
        cornice: has_windows * cornice,
        is_ground_floor,
    }
}

/// One number for upper storeys, another for the ground floor.
#[inline(always)]
fn by_floor<S: Simd>(simd: S, upper: f32, ground: f32, is_ground_floor: f32x8<S>) -> f32x8<S> {
    is_ground_floor * (ground - upper) + splat(simd, upper)
}

/// Kind of wall, and one of a few tones per house.
#[inline(always)]
fn wall<S: Simd>(simd: S, quality: Quality, looks: &Looks<S>, is_ground_floor: f32x8<S>) -> V8<S> {
    let kind = (looks.variant / 32.0).floor();
    let tone = fract(looks.variant * 0.619);
    let warm = fract(looks.variant * 0.271);
    let plaster =
        V8::splat(simd, [0.58, 0.51, 0.39]).mixed(V8::splat(simd, [0.56, 0.57, 0.57]), warm);
    let ochre =
        V8::splat(simd, [0.56, 0.37, 0.19]).mixed(V8::splat(simd, [0.47, 0.25, 0.18]), warm);
    let brick = V8::splat(simd, [0.30, 0.135, 0.085]).scaled(warm * 0.5 + 0.80);
    let concrete = V8::splat(simd, [0.34, 0.335, 0.32]).scaled(tone * 0.35 + 0.85);
    let mut wall = plaster.mixed(ochre, step(simd, splat(simd, 0.60), tone));
    wall = brick.or(kind.simd_eq(splat(simd, 1.0)), wall);
    wall = concrete.or(kind.simd_eq(splat(simd, 2.0)), wall);
    wall = if quality == Quality::Low {
        wall.scaled(splat(simd, 0.98))
    } else {
        let stains = noise(simd, looks.facade_m[0] * 0.6, looks.facade_m[1] * 0.25);
        wall.scaled(stains * 0.24 + 0.86)
    };
    let soiled = wall.scaled(splat(simd, 0.62)).plus(V8::splat(simd, [0.06; 3]));
    wall.mixed(soiled, is_ground_floor * 0.7)
}

#[inline(always)]
pub(crate) fn facade<S: Simd>(simd: S, lit: &Lit<'_>, sight: &Sight<S>, looks: &Looks<S>) -> V8<S> {
    let one = splat(simd, 1.0);
    let parts = parts(simd, lit.quality, sight, looks);
    let wall = wall(simd, lit.quality, looks, parts.is_ground_floor);
    let trim = wall.mixed(V8::splat(simd, [0.62, 0.60, 0.56]), splat(simd, 0.65));
    let albedo = wall.mixed(trim, parts.frame.max(parts.cornice * 0.8));
    let arriving = lit.arriving(simd, (sight.place_m, looks.normal), open_at(simd, looks));
    let unshaded = one - parts.shaded;
    let seen = albedo.times(arriving.diffuse).scaled(unshaded);
    let glass = parts.pane * (one - parts.cross_bar * 0.8);
    if !glass.simd_gt(splat(simd, 0.0)).any_true() {
        return seen;
    }
    let column = (looks.facade_m[0] / BAY_M).floor() + looks.variant * 7.0;
    let line = (looks.facade_m[1] / STOREY_M).floor();
    let is_bright = step(simd, splat(simd, 0.72), hash(column + 3.0, line + 3.0)) * 0.7;
    let dark = V8::splat(simd, [0.022, 0.028, 0.036]);
    let room = dark.mixed(V8::splat(simd, [0.16, 0.15, 0.13]), is_bright);
    let mirrored = sight.direction.mirrored(looks.normal);
    let facing = looks.normal.dot(sight.direction);
    let glance = clamp(simd, one + facing, 0.0, 1.0);
    let shine = glance * glance * glance * 0.60 + 0.16;
    let lamp = step(simd, splat(simd, 0.55), hash(column, line)) * (0.55 * lit.light.night);
    let in_glass = room
        .times(arriving.diffuse)
        .plus(lit.light.sky(simd, mirrored.z).scaled(shine))
        .plus(V8::splat(simd, [1.0, 0.72, 0.38]).scaled(lamp));
    seen.mixed(in_glass.scaled(unshaded), glass)
}

/// Part of the light of the sky and the ground that the corner at its foot leaves a wall.
#[inline(always)]
fn open_at<S: Simd>(simd: S, looks: &Looks<S>) -> f32x8<S> {
    let near = clamp(simd, splat(simd, 1.0) - looks.facade_m[1] * (1.0 / FOOT_M), 0.0, 1.0);
    splat(simd, 1.0) - near * near * 0.4
}
