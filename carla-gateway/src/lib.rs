//! The CARLA gateway: lets the official clients of CARLA 0.9.16 and 0.10.0 drive worlds on the bus.
//!
//! - `rpc` and `stream` are the two channels of CARLA's protocol, without meaning.
//! - `dialect` is its messages as types; `snapshot`, `sensors` and `pictures` are the payloads of
//!   its streams.
//! - `server` is one CARLA server: its `lobby`, where clients wait for their turn, and its
//!   `endpoint`, the episode and its streams; `calls` is what each call does with that.
//! - `skeleton` is what clients say of bones of pedestrians, and how their limbs moved.
//! - `recorder` and `replayer` write and replay CARLA's recordings; `archive` opens them.
//! - `allowance` is how much of a site its tenant may use.
//! - `site` is the world service behind the bus; `collecting_site` has worlds freed that nobody
//!   uses; `visited` is what is heard of the world of a session into which clients came.
//!
//! The client does not check what it receives, so every payload has one encoder.

mod allowance;
mod app;
mod archive;
mod calls;
mod catalogue;
mod collecting_site;
mod config;
mod dialect;
mod endpoint;
mod episode;
mod figures;
mod guests;
mod latitudes;
mod launcher;
mod lobby;
mod maps;
mod navigation;
mod pictures;
mod recorder;
mod replayer;
mod rpc;
mod sensors;
mod server;
mod site;
mod skeleton;
mod snapshot;
mod stream;
mod visited;
mod wheels;
mod whereabouts;

pub use app::{RunError, run};
pub use config::{Args, Cars, Config, ConfigError, PortOfTenant, lease_secs, ticks_per_second};
pub use dialect::ClientVersion;
pub use guests::Allowed;
pub use latitudes::Latitudes;
pub use launcher::{Flags, Translated, translate};
pub use maps::is_among;
pub use recorder::local_date;
