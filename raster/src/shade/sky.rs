//! The sky with clouds and the sun.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::light::Lit;
use crate::noise::{noise, powers_64_2000};
use crate::quality::Quality;
use crate::vector::{V8, add, scale, smoothstep, splat};

#[inline(always)]
pub(crate) fn sky<S: Simd>(simd: S, lit: &Lit<'_>, direction: V8<S>) -> V8<S> {
    let light = lit.light;
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let up = direction.z.max(zero);
    let mut colour = light.sky(simd, direction.z);
    let rises = smoothstep(simd, 0.01, 0.16, direction.z);
    let mut thick = zero;
    if rises.simd_gt(zero).any_true() {
        // Clouds on a plane overhead, thinning towards the horizon.
        let reach = splat(simd, 1.6) / (up + 0.12);
        let (x, y) = (direction.x * reach, direction.y * reach);
        let mut shape = noise(simd, x, y) * 0.55;
        shape = if lit.quality == Quality::Low {
            // The mean of what the finer ones have.
            shape + 0.225
        } else {
            shape
                + noise(simd, x * 2.3 + 7.1, y * 2.3 + 7.1) * 0.28
                + noise(simd, x * 5.1 + 3.7, y * 5.1 + 3.7) * 0.17
        };
        let cover = 0.72 - 0.55 * light.cloud;
        thick = smoothstep(simd, cover, cover + 0.30, shape) * rises;
        let bright = V8::splat(simd, add(scale(light.horizon, 0.75), scale(light.direct, 0.16)));
        let bright = bright.scaled(splat(simd, 1.08) - thick * shape * 0.30);
        colour = colour.mixed(bright, thick * (0.35 + 0.5 * light.cloud));
    }
    let toward = direction.dot(V8::splat(simd, light.to_light)).max(zero);
    let (wide, narrow) = powers_64_2000(toward);
    let halo = (wide * 0.35 + narrow * 6.0) * (one - thick * 0.8) * light.disc;
    colour = colour.plus(V8::splat(simd, light.direct).scaled(halo));
    // Below the horizon, where no ground is drawn: far haze.
    let haze = V8::splat(simd, scale(light.horizon, 0.72));
    colour.mixed(haze, smoothstep(simd, 0.0, -0.04, direction.z))
}
