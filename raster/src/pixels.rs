//! From pixels to rays, and from numbers to the bytes of pixels.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use crate::vector::{LANES, V8, clamp, middles, splat};
use crate::view::{RayParts, View};

/// Bytes of a pixel, of every kind of picture.
pub const PIXEL_BYTES: usize = 4;

/// Rays to pixels, of length 1 along the view.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'a> {
    pub(crate) view: &'a View,
    pub(crate) parts: RayParts,
}

impl<'a> Rays<'a> {
    pub(crate) fn of(view: &'a View) -> Self {
        Self { view, parts: view.ray_parts() }
    }

    /// To the right of the middle, at distance 1, of places in the picture.
    #[inline(always)]
    pub(crate) fn across_at<S: Simd>(&self, column: f32x8<S>) -> f32x8<S> {
        column * self.parts.across - self.parts.half_width
    }

    /// Above the middle, at distance 1.
    #[inline(always)]
    pub(crate) fn up_at<S: Simd>(&self, simd: S, row: f32x8<S>) -> f32x8<S> {
        splat(simd, self.parts.half_height) - row * self.parts.down
    }

    /// Through places so far from the middle at distance 1.
    #[inline(always)]
    pub(crate) fn through<S: Simd>(&self, simd: S, across: f32x8<S>, up: f32x8<S>) -> V8<S> {
        let (left, above) = (V8::splat(simd, self.view.left), V8::splat(simd, self.view.up));
        let ahead = V8::splat(simd, self.view.forward);
        ahead.plus(above.scaled(up)).plus(left.scaled(splat(simd, 0.0) - across))
    }

    /// To eight neighbours from a column on.
    #[inline(always)]
    pub(crate) fn of_eight<S: Simd>(&self, simd: S, (row, at): (u32, usize)) -> V8<S> {
        let up = self.up_at(simd, splat(simd, row as f32 + 0.5));
        self.through(simd, self.across_at(middles(simd, at)), up)
    }
}

/// From -1 to 1 as -127 to 127.
#[inline(always)]
pub(crate) fn signed<S: Simd>(simd: S, part: f32x8<S>) -> [f32; LANES] {
    (clamp(simd, part, -1.0, 1.0) * 127.0 + 0.5).floor().to_array()
}

/// As [`signed`], of one.
pub(crate) fn signed_of(part: f32) -> f32 {
    (part.clamp(-1.0, 1.0) * 127.0 + 0.5).floor()
}

/// Linear colours as sRGB: red, green, blue, 255 from the lowest byte on.
#[inline(always)]
pub(crate) fn packed<S: Simd>(simd: S, colour: V8<S>) -> [u32; LANES] {
    let red: u32x8<S> = (encoded(simd, colour.x) * 255.0 + 0.5).to_int();
    let green: u32x8<S> = (encoded(simd, colour.y) * 255.0 + 0.5).to_int();
    let blue: u32x8<S> = (encoded(simd, colour.z) * 255.0 + 0.5).to_int();
    let opaque = u32x8::splat(simd, 0xff00_0000);
    (red | (green << 8) | (blue << 16) | opaque).to_array()
}

/// sRGB's curve within 0.0015 of it, by roots, which are the same on all processors.
#[inline(always)]
fn encoded<S: Simd>(simd: S, linear: f32x8<S>) -> f32x8<S> {
    let x = clamp(simd, linear, 0.0, 1.0);
    let root2 = x.sqrt();
    let root4 = root2.sqrt();
    let root8 = root4.sqrt();
    let curve = root2 * 0.662_002_7 + root4 * 0.684_122_1 - root8 * 0.323_583_6 - x * 0.022_541_147;
    let dark = x.simd_le(splat(simd, 0.003_130_8));
    clamp(simd, dark.select(x * 12.92, curve), 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn the_curve_of_the_display_is_right_within_half_a_step() {
        for at in 0..=1_000 {
            let linear = at as f32 / 1_000.0;
            let exact = if linear <= 0.003_130_8 {
                12.92 * linear
            } else {
                1.055 * linear.powf(1.0 / 2.4) - 0.055
            };
            let ours =
                dispatch!(Level::new(), simd => encoded(simd, splat(simd, linear)).to_array()[0]);
            assert!((ours - exact).abs() < 0.5 / 255.0, "{linear}: {ours}, not {exact}");
        }
    }
}
