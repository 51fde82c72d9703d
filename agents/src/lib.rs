//! Driving as pure functions: a road network and the state of a vehicle in, its control out.
//!
//! - [`Pilot`] keeps a lane or changes to a neighbouring one at a target speed.
//! - [`Agent`] drives to a destination or along given places, or wanders: CARLA's basic agent and
//!   its behaviour agents, with their controllers and options. A world gives a vehicle an agent
//!   with [`AgentCommand::Set`](schemas::AgentCommand::Set), a route with
//!   [`AgentCommand::SetRoute`](schemas::AgentCommand::SetRoute), and the wheel with
//!   [`AgentCommand::Drive`](schemas::AgentCommand::Drive); every frame tells of it in
//!   [`Frame::agents`](schemas::Frame::agents). Any other command that drives the vehicle takes
//!   the wheel from the agent, which keeps its route.
//! - [`Driver`] drives a vehicle of the world's own traffic, which a world gets with
//!   [`TrafficCommand::Spawn`](schemas::TrafficCommand::Spawn) and
//!   [`TrafficCommand::Join`](schemas::TrafficCommand::Join). Drivers look one after the other,
//!   then decide one after the other; [`Claims`] is what they, and agents, agree on in between.
//! - [`Stroller`] walks on the navigation mesh:
//!   [`WalkerCommand::Agent`](schemas::WalkerCommand::Agent).
//! - [`Trajectory`] walks straight from place to place:
//!   [`WalkerCommand::Trajectory`](schemas::WalkerCommand::Trajectory).
//! - [`Network`] is the map as agents use it, [`Scene`] what they see of others.
//!
//! The state of each is plain data, so that a world carries it through snapshots and forks. No
//! clock, no I/O; random choices are made with numbers that the caller draws.
//!
//! **Frames:** world x east, y north, z up; positive steer and angles to the left.

mod agent;
mod beside;
mod crossing;
mod junction;
mod lane_change;
mod network;
mod path;
mod pid;
mod pilot;
mod route;
mod scene;
mod senses;
mod speed;
mod steering;
mod stroller;
#[cfg(test)]
mod testing;
mod track;
mod traffic;
mod trajectory;
mod wander;
mod way;

pub use agent::{Agent, Unreachable};
pub use crossing::Owed;
pub use junction::{Claims, Entering, Held};
pub use network::{LaneId, Network, RedLights};
pub use pilot::{Pilot, VehicleView};
pub use scene::{Body, Scene};
pub use senses::Senses;
pub use stroller::{Obstacle, Outlook, Stroller};
pub use traffic::{Driver, Glide};
pub use trajectory::Trajectory;
pub use way::{Spot, Way, WayPoint, Ways};
