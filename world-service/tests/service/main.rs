//! The service over a real bus, and its shards without one. One binary, as each links everything.

mod common;
mod owners;
mod shard;
mod worlds;
