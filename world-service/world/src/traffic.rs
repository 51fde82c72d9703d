//! Traffic lights and signs: which stand in a town, what the lights show, and which of them a
//! vehicle is at.
//!
//! Where they stand never changes, so it belongs to the town ([`TrafficPlan`]); only what the
//! lights show is part of a world's state ([`Lights`]). In frames and commands they are actors,
//! with the ids from 1 on, before all that is spawned.

mod lights;
mod plan;
mod red;
mod sight;

pub use lights::Lights;
pub(crate) use plan::TrafficPlan;
pub use sight::Broken;
pub(crate) use sight::{Passing, RoadRules};
