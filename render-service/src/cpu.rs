//! Drawing by our own rasteriser: no device, no driver.

mod drawing;
mod shadows;
mod sight;

pub(crate) use drawing::CpuDrawing;
