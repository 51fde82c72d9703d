//! The service over a real bus, and its shards without one. One binary, as each links everything.
#![allow(clippy::unwrap_used, reason = "the helpers of tests are tests")]

#[path = "../../world/tests/any_command/mod.rs"]
mod any_command;
mod common;
mod journals;
mod lending;
mod noisy;
mod owners;
mod seeking;
mod shard;
mod sharing;
mod turns;
mod worlds;
