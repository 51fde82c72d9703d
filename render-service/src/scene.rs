//! What is to be drawn, without a GPU: towns, bodies, light and views as plain values.

pub(crate) mod buildings;
pub(crate) mod coat;
pub(crate) mod exposure;
pub(crate) mod facade;
pub(crate) mod foliage;
pub(crate) mod import;
pub(crate) mod instance;
pub(crate) mod light;
pub(crate) mod material;
pub(crate) mod shadow;
pub(crate) mod town;
pub(crate) mod view;
