//! What sensors measure on a straight road.

#[path = "../common/mod.rs"]
mod common;
mod events;
mod lidar;
mod motion;
mod rays;
mod state;
mod support;
