//! scenario-service: episodes and the OpenEnv face.
//!
//! An episode is a pure state machine over frames: a `scenario` says who stands where and what a
//! choice is worth, an `episode` turns actions into commands and frames into observations. A
//! `session` runs one episode at a time, each in a world of its own, through the `world_port`; the
//! `ticker` lets many sessions share a round trip. `openenv` translates all of it to HTTP,
//! WebSocket and JSON.
//!
//! The service integrates no physics and keeps no truth: when it ends, its worlds end with their
//! lease.

mod action;
mod app;
mod config;
mod episode;
mod figures;
mod limits;
mod listener;
mod maps;
mod openenv;
mod scenario;
mod scenario_files;
mod session;
mod ticker;
mod world_port;

#[cfg(test)]
mod simulation;
#[cfg(test)]
mod testing;

pub use app::{RunError, run};
pub use config::{Args, ConfigError, Unguarded, http_address, is_guarded};
