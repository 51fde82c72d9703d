//! Pictures of worlds.

mod encode;
mod error;
mod pipeline;
mod renderer;
mod scene;
mod shaders;

pub use error::RenderError;
pub use pipeline::device::AdapterChoice;
pub use renderer::{Renderer, TownJob};
pub use scene::material::Material;
pub use scene::town::{Surface, TownScene};
