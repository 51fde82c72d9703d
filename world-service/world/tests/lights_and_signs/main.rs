//! Traffic lights and signs of a world.
#![allow(clippy::unwrap_used, reason = "a test fails loudly")]

mod broken;
mod destroyed;
mod ids;
mod knows;
mod posts;
mod shared;
mod state;
mod support;
mod turns;
