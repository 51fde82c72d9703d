//! Falling drops over a finished picture.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::light::Light;
use crate::noise::hash;
use crate::vector::{V8, add, clamp, fract, scale, splat, step, sub};

/// Width and length of a layer's streaks in picture heights, its number, how much it covers.
const LAYERS: [([f32; 2], f32, f32); 3] =
    [([0.008, 0.30], 3.0, 0.30), ([0.005, 0.16], 11.0, 0.25), ([0.003, 0.08], 23.0, 0.20)];

/// Drops in the air.
pub(crate) struct Rain<'a> {
    light: &'a Light,
    colour: [f32; 3],
}

impl<'a> Rain<'a> {
    /// `None` when it does not rain.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(simd: S, light: &'a Light) -> Option<Self> {
        let air = add(light.horizon, scale(sub(light.zenith, light.horizon), 0.3));
        let shown = light.displayed(simd, V8::splat(simd, air));
        let colour = [shown.x.to_array()[0], shown.y.to_array()[0], shown.z.to_array()[0]];
        (light.rain > 0.0).then_some(Self { light, colour })
    }

    /// Colours with drops over them; places across and down from the middle, in picture heights.
    #[inline(always)]
    pub(crate) fn over<S: Simd>(
        &self,
        simd: S,
        colour: V8<S>,
        across: f32x8<S>,
        down: f32x8<S>,
    ) -> V8<S> {
        let mut covers = splat(simd, 0.0);
        for (size, seed, weight) in LAYERS {
            covers += self.streaks(simd, (across, down), size, seed) * weight;
        }
        let covers = clamp(simd, covers, 0.0, 0.5);
        colour.mixed(V8::splat(simd, self.colour), covers)
    }

    /// Part that drops of a layer cover.
    #[inline(always)]
    fn streaks<S: Simd>(
        &self,
        simd: S,
        (across, down): (f32x8<S>, f32x8<S>),
        [width, length]: [f32; 2],
        seed: f32,
    ) -> f32x8<S> {
        let one = splat(simd, 1.0);
        // A little aslant.
        let leaning = (across + down * 0.06) / width;
        let column = leaning.floor();
        let starts = hash(column, splat(simd, seed)) * 17.0;
        let fall = starts + (down / length + 29.0 * self.light.rain_phase);
        let chance = hash(column, fall.floor() + seed);
        let is_drop = step(simd, chance, splat(simd, 0.30 * self.light.rain));
        let off_middle = (fract(leaning) - 0.5).abs() * 2.0;
        let along = fract(fall);
        is_drop * (one - off_middle) * along * (one - along) * 4.0
    }
}
