//! A strip as back ends read it: models at their places, light, view.

use bodies::{Instance, Material as SceneMaterial, Placed as Part, Shape};
use raster::{Light, Material, Model, Placed, Quality, SunView, View};
use schemas::{Camera, Vec3};

use crate::scene::exposure::Tone;
use crate::scene::instance::Body;
use crate::scene::material::{Family, table};
use crate::scene::shadow::{REACH_M, ShadowView};
use crate::scene::view::NEAR_M;
use crate::strip::Strip;

use super::levels::{ShapeLevel, level_of, outline_of, radius_m};

/// Corners may be off by so much in the picture, in pixels: in those of high and of low quality.
const ERROR_PX_MAX: f32 = 0.7;
const LOW_ERROR_PX_MAX: f32 = 1.2;
/// What of a town has levels may be off by so much in pictures of high quality.
const TOWN_ERROR_PX_MAX: f32 = 0.5;
/// Corners of what throws a shadow may be off by so much on the map, in its pixels.
const SHADOW_ERROR_PX_MAX: f32 = 1.0;
const LOW_SHADOW_ERROR_PX_MAX: f32 = 3.0;
/// In pictures of low quality, parts that are smaller than this part of the largest one of their
/// body throw no shadow: wheels, heads.
const LOW_SHADOW_PART_MIN: f32 = 0.5;
/// There parts that are smaller than a pixel of the map throw none either, unless they are no
/// smaller than this part of the largest one.
const LOW_SHADOW_PART_LARGE: f32 = 0.9;
/// Bodies that would be smaller than this in the picture, in pixels, are left out.
const BODY_RADIUS_PX_MIN: f32 = 0.6;
/// So are parts of them: the rasteriser would leave their clusters out.
const PART_RADIUS_PX_MIN: f32 = 0.35;

/// A strip's camera.
pub(crate) fn view_of(strip: &Strip<'_>) -> View {
    let turn = strip.view.world_from_camera.rotation;
    let Camera { width_px, height_px, .. } = *strip.camera();
    View {
        eye_m: strip.view.eye_m().into(),
        forward: (turn * Vec3::x()).into(),
        left: (turn * Vec3::y()).into(),
        up: (turn * Vec3::z()).into(),
        half_extent: strip.view.half_extent,
        width_px,
        height_px,
        near_m: NEAR_M,
    }
}

/// What of a town has levels may be off by so much in the picture, in pixels.
pub(crate) fn town_error_px(quality: Quality) -> f32 {
    if quality == Quality::Low { LOW_ERROR_PX_MAX } else { TOWN_ERROR_PX_MAX }
}

/// A town where it is.
pub(crate) fn placed_town(model: &Model) -> Placed<'_> {
    let Instance { world_from_shape, tints, label } = Instance::IN_PLACE;
    Placed { model, world_from_model: world_from_shape, tints, label }
}

/// A shape where it is.
pub(crate) fn placed(level: &'static ShapeLevel, at: &Instance) -> Placed<'static> {
    let Instance { world_from_shape, tints, label } = *at;
    Placed { model: &level.model, world_from_model: world_from_shape, tints, label }
}

/// The sun's view as the rasteriser reads it.
pub(crate) fn sun_view(shadow: &ShadowView, side_px: u32) -> SunView {
    let row = |at: usize| {
        let row = shadow.clip_from_world.row(at);
        [row[0], row[1], row[2], row[3]]
    };
    SunView { right: row(0), up: row(1), depth: row(2), side_px }
}

/// The parts of bodies in a strip's picture, far ones coarsely; the same for all rows of it.
pub(crate) fn seen_bodies(
    strip: &Strip<'_>,
    quality: Quality,
    mut put: impl FnMut(&'static ShapeLevel, &Instance),
) {
    let error_px = if quality == Quality::Low { LOW_ERROR_PX_MAX } else { ERROR_PX_MAX };
    let pixel = 2.0 * strip.view.half_extent[0] / strip.camera().width_px as f32;
    let eye_m = strip.view.eye_m();
    let forward = strip.view.world_from_camera.rotation * Vec3::x();
    let height_px = strip.camera().height_px;
    let shown = strip.view.rows(&(0..height_px), height_px);
    for body in strip.bodies() {
        let distance_m = (body.centre_m - eye_m).norm();
        let reach = Vec3::repeat(body.radius_m);
        if body.radius_m < BODY_RADIUS_PX_MIN * pixel * distance_m
            || !shown.may_see(&(body.centre_m - reach), &(body.centre_m + reach))
        {
            continue;
        }
        let nearest_m = (distance_m - body.radius_m).max(NEAR_M);
        let ahead_m = (forward.dot(&(body.centre_m - eye_m)) - body.radius_m).max(NEAR_M);
        let least_m = PART_RADIUS_PX_MIN * pixel * ahead_m;
        for part in &body.parts {
            put_part(part, level_of, [error_px * pixel * nearest_m, least_m], &mut put);
        }
    }
}

/// The parts of bodies that throw shadows into a strip's picture.
pub(crate) fn shading_bodies(
    strip: &Strip<'_>,
    shadow: &ShadowView,
    (side_px, quality): (u32, Quality),
    mut put: impl FnMut(&'static ShapeLevel, &Instance),
) {
    let pixel_m = 2.0 * REACH_M / side_px as f32;
    let is_low = quality == Quality::Low;
    let error_px = if is_low { LOW_SHADOW_ERROR_PX_MAX } else { SHADOW_ERROR_PX_MAX };
    let [error_m, least_m] = [error_px, PART_RADIUS_PX_MIN].map(|px| px * pixel_m);
    let find: FindLevel = if is_low { outline_of } else { level_of };
    for body in strip.bodies() {
        let reach = Vec3::repeat(body.radius_m);
        if !shadow.may_see(&(body.centre_m - reach), &(body.centre_m + reach)) {
            continue;
        }
        let least_m = match quality {
            Quality::High => least_m,
            Quality::Low => {
                let largest_m = largest_m(body);
                let fine_m = pixel_m.min(LOW_SHADOW_PART_LARGE * largest_m);
                least_m.max(LOW_SHADOW_PART_MIN * largest_m).max(fine_m)
            }
        };
        // Arches lie flat on their bodies.
        let parts = body.parts.iter().filter(|part| part.shape != Shape::WheelArch);
        parts.for_each(|part| put_part(part, find, [error_m, least_m], &mut put));
    }
}

/// Radius of a ball around the largest part of a body.
fn largest_m(body: &Body) -> f32 {
    let radii_m = body.parts.iter().map(|part| radius_m(part.shape, stretch(part)));
    radii_m.fold(0.0, f32::max)
}

/// Finds the level of a shape that is stretched like this within limits.
type FindLevel = fn(Shape, Vec3, [f32; 2]) -> Option<&'static ShapeLevel>;

/// Puts a part whose corners are off by no more than the first length, unless it is within a ball
/// of the second.
fn put_part(
    part: &Part,
    find: FindLevel,
    limits_m: [f32; 2],
    put: &mut impl FnMut(&'static ShapeLevel, &Instance),
) {
    if let Some(level) = find(part.shape, stretch(part), limits_m) {
        put(level, &part.instance);
    }
}

/// How much longer than in its own frame a shape is along each of its axes.
pub(crate) fn stretch_of([a, b, c]: &[[f32; 4]; 3]) -> Vec3 {
    let length = |at: usize| Vec3::new(a[at], b[at], c[at]).norm();
    Vec3::new(length(0), length(1), length(2))
}

fn stretch(part: &Part) -> Vec3 {
    stretch_of(&part.instance.world_from_shape)
}

/// Light as the rasteriser reads it.
pub(crate) fn light_of(strip: &Strip<'_>) -> Light {
    let light = strip.light;
    let tone = Tone::of(&strip.camera().exposure, light.dim);
    Light {
        to_light: light.to_light.into(),
        direct: light.direct.into(),
        zenith: light.zenith.into(),
        horizon: light.horizon.into(),
        bounce: light.bounce.into(),
        disc: light.disc,
        cloud: light.cloud,
        haze_per_m: light.haze_per_m,
        haze_start_m: light.haze_start_m,
        haze_fall_per_m: light.haze_fall_per_m,
        rain: light.rain,
        rain_phase: light.rain_phase,
        wet: light.wet,
        night: light.night,
        gain: tone.gain,
        white: tone.white,
    }
}

/// All materials, at the places of their numbers.
pub(crate) fn materials() -> Vec<Material> {
    let rows = SceneMaterial::ALL.into_iter().zip(table());
    rows.map(|(material, row)| {
        let [r, g, b, gloss] = row.colour_gloss;
        let [pattern, tint, ..] = row.pattern_tint;
        Material {
            colour: [r, g, b],
            gloss,
            family: match Family::of(material) {
                Family::Ground => raster::Family::Ground,
                Family::Facade => raster::Family::Facade,
                Family::Body => raster::Family::Body,
            },
            pattern: pattern as u8,
            tint: tint as u8,
        }
    })
    .collect()
}
