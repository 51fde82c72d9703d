//! Patterns without a period, and what is needed of a library of functions: the same bits
//! everywhere.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8};

use crate::vector::{clamp, fract, mix, splat};

/// From 0 to 1, another one for every cell.
#[inline(always)]
pub(crate) fn hash<S: Simd>(x: f32x8<S>, y: f32x8<S>) -> f32x8<S> {
    let (px, py) = (fract(x * 0.1031), fract(y * 0.1130));
    let mixed = px * (py + 33.33) + py * (px + 33.33);
    let (px, py) = (px + mixed, py + mixed);
    fract((px + py) * px)
}

/// Smooth, from 0 to 1, with features of one unit.
#[inline(always)]
pub(crate) fn noise<S: Simd>(simd: S, x: f32x8<S>, y: f32x8<S>) -> f32x8<S> {
    let (left, below) = (x.floor(), y.floor());
    let (fx, fy) = (x - left, y - below);
    let three = splat(simd, 3.0);
    let (sx, sy) = (fx * fx * (three - fx * 2.0), fy * fy * (three - fy * 2.0));
    let (right, above) = (left + 1.0, below + 1.0);
    let low = mix(hash(left, below), hash(right, below), sx);
    let high = mix(hash(left, above), hash(right, above), sx);
    mix(low, high, sy)
}

/// e to the power of a number that is not positive; within 2 × 10⁻⁶ of it.
#[inline(always)]
pub(crate) fn exp_of_negative<S: Simd>(simd: S, value: f32x8<S>) -> f32x8<S> {
    let power = clamp(simd, value * std::f32::consts::LOG2_E, -126.0, 0.0);
    let whole = (power + 0.5).floor();
    let rest = power - whole;
    // Taylor's series of 2 to the power of -0.5 to 0.5.
    let mut sum = splat(simd, 1.540_353e-4);
    for term in
        [1.333_355_8e-3, 9.618_129e-3, 5.550_411e-2, 0.240_226_5, std::f32::consts::LN_2, 1.0]
    {
        sum = sum * rest + term;
    }
    let exponent: i32x8<S> = (whole + 127.0).to_int();
    sum * f32x8::from_bits((exponent << 23).bitcast())
}

/// A number to the power of 64, and to the power of 2000.
#[inline(always)]
pub(crate) fn powers_64_2000<S: Simd>(value: f32x8<S>) -> (f32x8<S>, f32x8<S>) {
    let p2 = value * value;
    let p4 = p2 * p2;
    let p8 = p4 * p4;
    let p16 = p8 * p8;
    let p32 = p16 * p16;
    let p64 = p32 * p32;
    let p128 = p64 * p64;
    let p256 = p128 * p128;
    let p512 = p256 * p256;
    (p64, p512 * p512 * p512 * p256 * p128 * p64 * p16)
}
