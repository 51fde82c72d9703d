//! Three numbers: a place, a direction, a colour; one of them, or eight at once.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

/// Numbers that are computed at once.
pub(crate) const LANES: usize = 8;

/// Three numbers.
pub(crate) type V3 = [f32; 3];

pub(crate) fn add([ax, ay, az]: V3, [bx, by, bz]: V3) -> V3 {
    [ax + bx, ay + by, az + bz]
}

pub(crate) fn sub([ax, ay, az]: V3, [bx, by, bz]: V3) -> V3 {
    [ax - bx, ay - by, az - bz]
}

pub(crate) fn scale([x, y, z]: V3, by: f32) -> V3 {
    [x * by, y * by, z * by]
}

pub(crate) fn dot([ax, ay, az]: V3, [bx, by, bz]: V3) -> f32 {
    ax * bx + ay * by + az * bz
}

pub(crate) fn cross([ax, ay, az]: V3, [bx, by, bz]: V3) -> V3 {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

pub(crate) fn norm(v: V3) -> f32 {
    dot(v, v).sqrt()
}

/// Of length 1; as it is where it has no length.
pub(crate) fn unit(v: V3) -> V3 {
    let length = norm(v);
    if length > 1e-20 { scale(v, 1.0 / length) } else { v }
}

/// `row · (point, 1)`.
pub(crate) fn affine([x, y, z, w]: [f32; 4], point: V3) -> f32 {
    dot([x, y, z], point) + w
}

/// Eight times three numbers.
#[derive(Clone, Copy)]
pub(crate) struct V8<S: Simd> {
    pub(crate) x: f32x8<S>,
    pub(crate) y: f32x8<S>,
    pub(crate) z: f32x8<S>,
}

/// The same number eight times.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, value: f32) -> f32x8<S> {
    f32x8::splat(simd, value)
}

impl<S: Simd> V8<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, [x, y, z]: V3) -> Self {
        Self { x: splat(simd, x), y: splat(simd, y), z: splat(simd, z) }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    /// Part by part.
    #[inline(always)]
    pub(crate) fn times(self, other: Self) -> Self {
        Self { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    #[inline(always)]
    pub(crate) fn scaled(self, by: f32x8<S>) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> f32x8<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn norm(self) -> f32x8<S> {
        self.dot(self).sqrt()
    }

    /// Of length 1; nonsense where it has none.
    #[inline(always)]
    pub(crate) fn unit(self, simd: S) -> Self {
        self.scaled(splat(simd, 1.0) / self.norm())
    }

    /// Mirrored in a surface with this unit normal.
    #[inline(always)]
    pub(crate) fn mirrored(self, normal: Self) -> Self {
        self.minus(normal.scaled(self.dot(normal) * 2.0))
    }

    /// From one to another by a part of the way.
    #[inline(always)]
    pub(crate) fn mixed(self, other: Self, part: f32x8<S>) -> Self {
        self.plus(other.minus(self).scaled(part))
    }

    /// `row · (place, 1)`.
    #[inline(always)]
    pub(crate) fn row(self, [x, y, z, w]: [f32; 4]) -> f32x8<S> {
        self.x * x + self.y * y + self.z * z + w
    }

    /// These where the mask holds, else the others.
    #[inline(always)]
    pub(crate) fn or(self, mask: fearless_simd::mask32x8<S>, other: Self) -> Self {
        Self {
            x: mask.select(self.x, other.x),
            y: mask.select(self.y, other.y),
            z: mask.select(self.z, other.z),
        }
    }
}

/// The middles of eight pixels from a column on.
#[inline(always)]
pub(crate) fn middles<S: Simd>(simd: S, column: usize) -> f32x8<S> {
    f32x8::load_array(simd, [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]) + column as f32
}

/// From one number to another by a part of the way.
#[inline(always)]
pub(crate) fn mix<S: Simd>(a: f32x8<S>, b: f32x8<S>, part: f32x8<S>) -> f32x8<S> {
    a + (b - a) * part
}

/// Within 0 and 1.
#[inline(always)]
pub(crate) fn clamp01<S: Simd>(simd: S, value: f32x8<S>) -> f32x8<S> {
    clamp(simd, value, 0.0, 1.0)
}

#[inline(always)]
pub(crate) fn clamp<S: Simd>(simd: S, value: f32x8<S>, low: f32, high: f32) -> f32x8<S> {
    value.max(splat(simd, low)).min(splat(simd, high))
}

/// What is behind the point.
#[inline(always)]
pub(crate) fn fract<S: Simd>(value: f32x8<S>) -> f32x8<S> {
    value - value.floor()
}

/// 0 below one number, 1 above another, smooth in between; the first may be the larger one.
#[inline(always)]
pub(crate) fn smoothstep<S: Simd>(simd: S, low: f32, high: f32, value: f32x8<S>) -> f32x8<S> {
    let t = clamp01(simd, (value - low) * (1.0 / (high - low)));
    t * t * (splat(simd, 3.0) - t * 2.0)
}

/// 1 where the value is at least the edge, else 0.
#[inline(always)]
pub(crate) fn step<S: Simd>(simd: S, edge: f32x8<S>, value: f32x8<S>) -> f32x8<S> {
    value.simd_ge(edge).select(splat(simd, 1.0), splat(simd, 0.0))
}

/// One lane after the other.
#[inline(always)]
pub(crate) fn to_lanes<S: Simd>(v: V8<S>) -> [V3; LANES] {
    let (x, y, z) = (v.x.to_array(), v.y.to_array(), v.z.to_array());
    std::array::from_fn(|lane| [x[lane], y[lane], z[lane]])
}

/// From one lane after the other.
#[inline(always)]
pub(crate) fn from_lanes<S: Simd>(simd: S, lanes: &[V3; LANES]) -> V8<S> {
    let axis = |at: usize| f32x8::load_array(simd, lanes.map(|lane| lane[at]));
    V8 { x: axis(0), y: axis(1), z: axis(2) }
}
