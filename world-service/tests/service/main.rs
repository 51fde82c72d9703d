//! The service over a real bus, and its shards without one. One binary, as each links everything.
#![allow(clippy::unwrap_used, reason = "the helpers of tests are tests")]

mod common;
mod owners;
mod shard;
mod worlds;
