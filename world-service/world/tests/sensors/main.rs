//! What sensors measure on a straight road.
#![allow(clippy::unwrap_used, reason = "test code fails loudly")]

#[path = "../common/mod.rs"]
mod common;
mod events;
mod lidar;
mod motion;
mod rays;
mod state;
mod support;
mod v2x;
