//! Pictures on processors: clusters of triangles, a buffer of what is seen, and shading of what is
//! seen alone. It knows no files, no threads and no other crates of ours.
//!
//! Drawing has two halves. [`Canvas::look`] finds the triangle that every pixel shows: clusters
//! that are out of view, turned away or too small are skipped, the rest is put on the picture near
//! ones first. Then the pixels' colours, depths, labels or normals are computed from the triangles,
//! eight pixels at a time.
//!
//! **Determinism:** equal scenes give equal bytes, at every level of vectors and in whatever parts
//! a picture is drawn: nothing is fused or approximated, and a pixel depends on no other.

mod choose;
mod clip;
mod coat;
mod draw;
mod edges;
mod fill;
mod lamp;
mod light;
mod mirrored;
mod model;
mod noise;
mod occluder;
mod paint;
mod picture;
mod pixels;
mod quality;
mod reach;
mod rows;
mod scene;
mod shade;
mod shadow;
mod surface;
mod target;
mod vector;
mod view;

pub use choose::Prospect;
pub use coat::{Coat, Texture};
pub use fearless_simd::Level;
pub use lamp::{LAMPS_MAX, Lamp};
pub use light::Light;
pub use model::{ClusterFacts, Corner, Model, ThingLevel};
pub use occluder::{OCCLUDERS_MAX, Occluder};
pub use picture::Canvas;
pub use pixels::PIXEL_BYTES;
pub use quality::Quality;
pub use scene::{Family, Material, Placed, Scene};
pub use shadow::{SHADOW_ERROR_PX_MAX, SHADOW_SLOPE, ShadowMap};
pub use view::{Projection, SunView, View};

/// Name of the instructions that a level uses.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
pub fn level_name(level: Level) -> &'static str {
    match level {
        Level::Avx512(_) => "AVX-512",
        Level::Avx2(_) => "AVX2",
        Level::Sse4_2(_) => "SSE4.2",
        _ => "SSE2",
    }
}

/// Name of the instructions that a level uses.
#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
pub fn level_name(level: Level) -> &'static str {
    if level.is_fallback() { "scalar" } else { "vectors" }
}
