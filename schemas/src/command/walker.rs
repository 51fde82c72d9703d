//! Changes of walkers.

use crate::{ActorId, Pose, Vec3, WalkerControl};

/// One change of a walker.
#[derive(Clone, Debug, PartialEq)]
pub enum WalkerCommand {
    /// How a walker moves, until replaced.
    Control {
        /// Which walker.
        actor: ActorId,
        /// How.
        control: WalkerControl,
    },
    /// Lets a walker find its own way on the navigation mesh, until it is steered otherwise.
    Agent {
        /// Which walker.
        actor: ActorId,
        /// Where to; `None`: from place to place for ever. World frame.
        goal_m: Option<Vec3>,
        /// How fast; `None`: 1.4 m/s.
        speed_mps: Option<f32>,
        /// Share of ways, 0 to 1, that may lead over roads beside crossings.
        crossing_share: f32,
    },
    /// Places a walker that is steered from outside.
    State {
        /// Which walker.
        actor: ActorId,
        /// Where.
        world_from_actor: Pose,
        /// How fast its legs go.
        speed_mps: f32,
    },
}
