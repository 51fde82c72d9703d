//! The render service: a stateless worker that turns a frame and its cameras into pictures.
//!
//! A [`RenderJob`](schemas::RenderJob) holds all that is to be seen but the town, which is named by
//! the digest of its map. [`Renderer`] draws jobs without a bus; [`run`] is the process around it,
//! which takes jobs from the bus, shares its time among their tenants, and answers each.
//!
//! Equal jobs give equal bytes on one adapter. Without a GPU processors draw, by the `raster`
//! crate; Mesa's software Vulkan is an adapter like any other and is chosen by its name alone.
//! Nothing is kept between jobs but caches, each with a bound.
//!
//! ```no_run
//! use std::sync::Arc;
//! use render_service::{AdapterChoice, Renderer, TownScene};
//!
//! # fn example(map: roads::Map, job: schemas::RenderJob) -> Result<(), Box<dyn std::error::Error>> {
//! let town = Arc::new(TownScene::of_map(&map));
//! let mut renderer = Renderer::new(AdapterChoice::Best)?;
//! println!("drawn by {}", renderer.adapter_name());
//! for images in renderer.render(&[(town, &job)]) {
//!     println!("{} pictures", images?.images.len());
//! }
//! # Ok(())
//! # }
//! ```
//!
//! It never sees physics. Besides colour it draws depth, tags, ids and normals; flow is not there.

mod app;
mod config;
mod cpu;
mod encode;
mod error;
mod gpu;
mod lamps;
mod models;
mod occluders;
mod parallel;
mod renderer;
mod scene;
mod service;
mod sliced;
mod strip;

pub use bodies::Material;

pub use app::{RenderService, ServiceError, run, start};
pub use config::{Args, Config, Quality};
pub use error::RenderError;
pub use gpu::adapter::{AdapterChoice, NO_DISPLAY};
pub use renderer::{Renderer, TownJob};
pub use scene::coat::Textures;
pub use scene::town::{Surface, TownScene, WallKind};
