//! Driving as pure functions: a road network and the state of a vehicle in, its control out.
//!
//! [`Pilot`] keeps a lane or changes to a neighbouring one at a target speed. Its state is plain
//! data, so that a world carries it through snapshots and forks. No clock, no randomness, no I/O.
//!
//! **Frames:** world x east, y north, z up; positive steer and angles to the left.

mod lane_change;
mod pilot;
mod speed;
mod steering;
mod track;

pub use pilot::{Pilot, VehicleView};
