//! Things with textures on them.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::{Sight, body, facade, ground};
use crate::coat::{Coat, Patch, step_on};
use crate::light::Lit;
use crate::scene::Family;
use crate::surface::{Looks, Surface};
use crate::vector::{LANES, V3, V8, from_lanes, scale, splat, to_lanes};
use crate::view::View;

/// Light of a white texture: about as bright as a wall in the sun.
const EMISSIVE: f32 = 0.4;

/// Eight pixels of things with a coat.
pub(crate) struct Coated<'a, S: Simd> {
    pub(crate) surfaces: [Option<&'a Surface>; LANES],
    pub(crate) coats: [Option<&'a Coat>; LANES],
    pub(crate) view: &'a View,
    pub(crate) depth_m: f32x8<S>,
}

impl<S: Simd> Coated<'_, S> {
    /// Colours of the texture, or what they would be without it, and the light that it gives.
    #[inline(always)]
    pub(crate) fn colour(
        &self,
        simd: S,
        lit: &Lit<'_>,
        sight: &Sight<S>,
        looks: &Looks<S>,
    ) -> V8<S> {
        let patches = self.patches(simd, sight, looks.normal);
        let mut own = [1.0; LANES];
        let (mut diffuse, mut emissive) = ([[0.0; 3]; LANES], [[0.0; 3]; LANES]);
        for (lane, patch) in patches.iter().enumerate() {
            let Some(coat) = self.coats[lane] else { continue };
            let colour;
            (colour, emissive[lane]) = coat.on(patch);
            if let Some(colour) = colour {
                (own[lane], diffuse[lane]) = (0.0, colour);
            }
        }
        let zero = splat(simd, 0.0);
        let is_own = f32x8::load_array(simd, own).simd_gt(zero);
        let plain = Looks {
            colour: looks.colour.or(is_own, from_lanes(simd, &diffuse)),
            glow: is_own.select(looks.glow, zero),
            gloss: is_own.select(looks.gloss, zero),
            pattern: is_own.select(looks.pattern, zero),
            ..*looks
        };
        let mut colour = body(simd, lit, (sight, &plain), None);
        if is_own.any_true() {
            let of = |family: Family| {
                let numbers = self.surfaces.map(|surface| {
                    let is_it = surface.is_some_and(|surface| surface.family == family);
                    if is_it { 1.0 } else { 0.0 }
                });
                f32x8::load_array(simd, numbers).simd_gt(zero) & is_own
            };
            colour = facade(simd, lit, sight, looks).or(of(Family::Facade), colour);
            colour = ground(simd, lit, sight, looks).or(of(Family::Ground), colour);
        }
        colour.plus(from_lanes(simd, &emissive).scaled(splat(simd, EMISSIVE)))
    }

    #[inline(always)]
    fn patches(&self, simd: S, sight: &Sight<S>, normal: V8<S>) -> [Patch; LANES] {
        let (place_m, normal) = (to_lanes(sight.place_m), to_lanes(normal));
        let direction = to_lanes(sight.direction);
        let pixel_m = (self.depth_m * splat(simd, sight.pixel)).to_array();
        std::array::from_fn(|lane| {
            let step =
                |axis: V3| step_on(scale(axis, pixel_m[lane]), normal[lane], direction[lane]);
            let steps_m = [step(self.view.left), step(self.view.up)];
            Patch { place_m: place_m[lane], normal: normal[lane], steps_m }
        })
    }
}
