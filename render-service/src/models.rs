//! What is drawn as both back ends read it: towns and shapes as clusters of triangles, at levels of
//! detail, and which of them a strip shows.

mod block;
pub(crate) mod levels;
pub(crate) mod strips;
pub(crate) mod towns;
