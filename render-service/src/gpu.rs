//! Drawing on a GPU, by kernels alone: which clusters of triangles a view may show, which triangle
//! each of its samples shows, and the pixels of that. Views of many worlds go in one submission.

pub(crate) mod adapter;
mod batch;
mod buffers;
pub(crate) mod drawing;
mod kernels;
mod models;
mod plan;
mod readback;
pub(crate) mod room;
mod rows;
mod shaders;
mod shadow_maps;
mod timer;
