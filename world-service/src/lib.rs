//! The world service: many independent worlds in one process, on the bus.
//!
//! [`run`] is the process, [`start`] the same inside another one. Worlds live on shard threads; a
//! request goes from the bus straight to the shard of its world and is answered from there. Batches
//! are split over the shards and joined; requests of many ticks let others in between. What is rare
//! or slow (maps, new worlds) has a thread of its own.
//!
//! - [`service`] is the state machine: worlds, leases, quarantine, batches; no bus, no threads, no
//!   clock.
//! - [`journal`] writes down what was done to a world, and replays it.
//! - `app` wires it to the bus and owns all threads.
//! - The simulation itself is the crate `world`.
//!
//! It never sees a GPU or HTTP: pictures are jobs for render services.

mod app;
mod args;
pub mod journal;
mod map_files;
mod maps;
pub mod service;
mod simulation;

pub use app::{ServiceError, WorldService, run, start};
pub use args::{Args, Config, ConfigError, Journals, thread_count};
pub use map_files::{map_files, read_map_file};
pub use world::texture;
