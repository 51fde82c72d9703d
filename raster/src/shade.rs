//! The colours of families of materials, of the sky and of falling rain.

mod body;
mod cabin;
mod coated;
mod facade;
mod ground;
mod rain;
mod sky;

pub(crate) use body::body;
pub(crate) use cabin::Inside;
pub(crate) use coated::Coated;
pub(crate) use facade::facade;
pub(crate) use ground::ground;
pub(crate) use rain::Rain;
pub(crate) use sky::sky;

use fearless_simd::{Simd, f32x8};

use crate::vector::V8;

/// How eight pixels see what is there.
#[derive(Clone, Copy)]
pub(crate) struct Sight<S: Simd> {
    pub(crate) place_m: V8<S>,
    pub(crate) distance_m: f32x8<S>,
    /// Unit vector from the eye.
    pub(crate) direction: V8<S>,
    /// Width of a pixel at a distance of 1.
    pub(crate) pixel: f32,
}
