//! Light in the air: sun, sky, haze, the display's curve.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::lamp::{Lamp, lamplight};
use crate::noise::exp_of_negative;
use crate::occluder::Occluder;
use crate::quality::Quality;
use crate::shadow::ShadowMap;
use crate::vector::{V3, V8, clamp, clamp01, mix, smoothstep, splat};

/// Light of one picture. Colours are linear radiance; 1 is a white wall in full sun.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Unit vector to the sun or moon.
    pub to_light: [f32; 3],
    /// Of the sun or moon on a surface that faces it.
    pub direct: [f32; 3],
    /// Of the sky straight up.
    pub zenith: [f32; 3],
    /// Of the sky at the horizon, and of far haze.
    pub horizon: [f32; 3],
    /// Of what the ground throws back upwards.
    pub bounce: [f32; 3],
    /// Brightness of the sun's disc.
    pub disc: f32,
    /// 0 clear to 1 overcast.
    pub cloud: f32,
    /// Haze per metre beyond where it starts.
    pub haze_per_m: f32,
    /// Nearer than this the air is clear.
    pub haze_start_m: f32,
    /// How fast haze thins upwards from the eye: by a factor e in 1 over this; 0: not at all.
    pub haze_fall_per_m: f32,
    /// 0 dry to 1 heavy rain in the air.
    pub rain: f32,
    /// 0 to 1: which drops are seen.
    pub rain_phase: f32,
    /// 0 dry to 1 wet roads.
    pub wet: f32,
    /// 0 by day to 1 by night.
    pub night: f32,
    /// What radiance is multiplied by before the display's curve.
    pub gain: f32,
    /// White balance before that: rows of a matrix; none: colours stay.
    pub white: Option<[[f32; 3]; 3]>,
}

/// Light that arrives at surfaces.
pub(crate) struct Arriving<S: Simd> {
    pub(crate) diffuse: V8<S>,
    pub(crate) sun: V8<S>,
}

/// What every pixel of a picture is lit by.
#[derive(Clone, Copy)]
pub(crate) struct Lit<'a> {
    pub(crate) light: &'a Light,
    pub(crate) shadow: &'a ShadowMap,
    pub(crate) quality: Quality,
    /// That may light what is drawn.
    pub(crate) lamps: &'a [&'a Lamp],
    /// That may keep the sky from the ground that is drawn.
    pub(crate) occluders: &'a [&'a Occluder],
}

impl Light {
    /// Sky without clouds or sun.
    #[inline(always)]
    pub(crate) fn sky<S: Simd>(&self, simd: S, up: f32x8<S>) -> V8<S> {
        let low = splat(simd, 1.0) - up.max(splat(simd, 0.0));
        let low = low * low;
        V8::splat(simd, self.zenith).mixed(V8::splat(simd, self.horizon), low * low)
    }

    /// What is seen through the air at a distance and a height above the eye.
    #[inline(always)]
    pub(crate) fn hazed<S: Simd>(
        &self,
        simd: S,
        colour: V8<S>,
        distance_m: f32x8<S>,
        above_m: f32x8<S>,
    ) -> V8<S> {
        let mut thick_m = (distance_m - self.haze_start_m).max(splat(simd, 0.0));
        if self.haze_fall_per_m > 0.0 {
            thick_m *= mean_density(simd, above_m * self.haze_fall_per_m);
        }
        let part = splat(simd, 1.0) - exp_of_negative(simd, thick_m * -self.haze_per_m);
        colour.mixed(V8::splat(simd, self.horizon), part)
    }

    /// From radiance to the display's range, linear: a curve with a soft shoulder and a short toe.
    #[inline(always)]
    pub(crate) fn displayed<S: Simd>(&self, simd: S, radiance: V8<S>) -> V8<S> {
        let gain = self.gain;
        let mut radiance = radiance;
        if let Some([red, green, blue]) = self.white {
            let zero = splat(simd, 0.0);
            let part = |row: V3| radiance.dot(V8::splat(simd, row)).max(zero);
            radiance = V8 { x: part(red), y: part(green), z: part(blue) };
        }
        V8 {
            x: curve(simd, radiance.x * gain),
            y: curve(simd, radiance.y * gain),
            z: curve(simd, radiance.z * gain),
        }
    }
}

/// Mean density along a way that ends so many heights above its beginning, each of which thins the
/// air by a factor e, over the density where it begins.
#[inline(always)]
fn mean_density<S: Simd>(simd: S, heights: f32x8<S>) -> f32x8<S> {
    let size = clamp(simd, heights.abs(), 1e-2, 8.0);
    let left = exp_of_negative(simd, splat(simd, 0.0) - size);
    let upwards = (splat(simd, 1.0) - left) / size;
    heights.simd_ge(splat(simd, 0.0)).select(upwards, upwards / left.max(splat(simd, 0.1)))
}

#[inline(always)]
fn curve<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    clamp01(simd, (x * (x * 2.43 + 0.05)) / (x * (x * 2.36 + 0.62) + 0.15))
}

impl Lit<'_> {
    /// Light that arrives at surfaces with these unit normals, which see this part of the sky and
    /// the ground around them.
    #[inline(always)]
    pub(crate) fn arriving<S: Simd>(
        &self,
        simd: S,
        (place_m, normal): (V8<S>, V8<S>),
        open: f32x8<S>,
    ) -> Arriving<S> {
        let light = self.light;
        let zero = splat(simd, 0.0);
        let facing = normal.dot(V8::splat(simd, light.to_light)).max(zero);
        let mut direct = facing;
        if facing.simd_gt(zero).any_true() {
            direct = facing * self.sunlit(simd, place_m, normal);
        }
        let sun = V8::splat(simd, light.direct).scaled(direct);
        let up = normal.z * 0.5 + 0.5;
        // At night street lamps throw from above what the ground throws back by day.
        let above = |at: usize| {
            let sky = light.horizon[at] + (light.zenith[at] - light.horizon[at]) * 0.55;
            sky * 0.62 + light.bounce[at] * light.night
        };
        let above = V8::splat(simd, [above(0), above(1), above(2)]);
        let around = V8::splat(simd, light.bounce).mixed(above, up);
        let mut diffuse = sun.plus(around.scaled(open));
        if !self.lamps.is_empty() {
            diffuse = diffuse.plus(lamplight(simd, self.lamps, place_m, normal));
        }
        Arriving { diffuse, sun }
    }

    /// Part of the sun that reaches a place, 0 to 1.
    #[inline(always)]
    fn sunlit<S: Simd>(&self, simd: S, place_m: V8<S>, normal: V8<S>) -> f32x8<S> {
        let view = &self.shadow.view;
        // Off the surface by a little more than a shadow pixel, else it shadows itself.
        let toward = V8::splat(simd, self.light.to_light).scaled(splat(simd, 0.5));
        let off = normal.plus(toward).scaled(splat(simd, self.shadow.pixel_m * 1.3));
        let place = place_m.plus(off);
        let (right, up) = (place.row(view.right), place.row(view.up));
        let edge = right.abs().max(up.abs());
        let outside = smoothstep(simd, 0.85, 0.98, edge);
        let one = splat(simd, 1.0);
        if outside.simd_ge(one).all_true() {
            return one;
        }
        let nearness = one - place.row(view.depth);
        let side = view.side_px as f32;
        let across = clamp(simd, (right * 0.5 + 0.5) * side - 0.5, 0.0, side - 1.001);
        let down = clamp(simd, (up * -0.5 + 0.5) * side - 0.5, 0.0, side - 1.001);
        if self.quality == Quality::Low {
            let nearest = self.shadow.tap(simd, (across + 0.5).floor(), (down + 0.5).floor());
            return mix(passes(simd, nearest, nearness), one, outside);
        }
        let (column, line) = (across.floor(), down.floor());
        let [a, b, c, d] = self.shadow.taps(simd, column, line);
        let (a, b) = (passes(simd, a, nearness), passes(simd, b, nearness));
        let (c, d) = (passes(simd, c, nearness), passes(simd, d, nearness));
        let upper = mix(a, b, across - column);
        let lower = mix(c, d, across - column);
        mix(mix(upper, lower, down - line), one, outside)
    }
}

/// 1 where nothing is nearer to the sun than this, else 0.
#[inline(always)]
fn passes<S: Simd>(simd: S, tap: f32x8<S>, nearness: f32x8<S>) -> f32x8<S> {
    let is_free = tap.simd_eq(splat(simd, 0.0)) | nearness.simd_ge(tap);
    is_free.select(splat(simd, 1.0), splat(simd, 0.0))
}
