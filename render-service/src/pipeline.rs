//! The GPU side: device, pipelines, caches, and one submission for many pictures.

pub(crate) mod batch;
pub(crate) mod buffers;
pub(crate) mod device;
pub(crate) mod drawing;
pub(crate) mod pass;
pub(crate) mod pipelines;
pub(crate) mod readback;
pub(crate) mod targets;
pub(crate) mod towns;
pub(crate) mod uniform;
