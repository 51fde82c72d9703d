//! Drawing by our own rasteriser: no device, no driver.

mod block;
mod drawing;
mod levels;
mod shadows;
mod sight;
mod strips;
mod towns;

pub(crate) use drawing::CpuDrawing;
