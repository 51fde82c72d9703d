//! The CARLA gateway: lets the official client of CARLA 0.9.16 drive worlds on the bus.
//!
//! - `rpc` and `stream` are the two channels of CARLA's protocol, without meaning.
//! - `dialect` is its messages as types; `snapshot`, `sensors` and `pictures` are the payloads of
//!   its streams.
//! - `endpoint` is one CARLA server: its clients, episode and clock; `calls` is what each call
//!   does.
//! - `skeleton` is where the limbs of pedestrians are.
//! - `site` is the world service behind the bus.
//!
//! The client does not check what it receives, so every payload has one encoder and golden bytes.

mod app;
mod calls;
mod catalogue;
mod config;
mod dialect;
mod endpoint;
mod episode;
mod launcher;
mod maps;
mod navigation;
mod pictures;
mod rpc;
mod sensors;
mod site;
mod skeleton;
mod snapshot;
mod stream;

pub use app::{RunError, run};
pub use config::{Args, Config, ConfigError, Tyres};
pub use launcher::{Flags, Translated, translate};
