//! Changes of walkers.

use serde::{Deserialize, Serialize};

use crate::{ActorId, BonesChange, Pose, Vec3, WalkerControl};

/// A place that a walker goes straight to, and how long it stays there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkerStage {
    /// World frame; its height counts nothing.
    pub to_m: Vec3,
    /// How fast.
    pub speed_mps: f32,
    /// Before it goes on.
    pub wait_secs: f32,
}

/// Somebody is near.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proximity {
    /// Who.
    pub actor: ActorId,
    /// Nearer than this, from middle to middle in the plane.
    pub within_m: f32,
}

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
    /// Lets a walker go straight from place to place, whatever comes, and stand at the last one,
    /// until it is steered otherwise.
    Trajectory {
        /// Which walker.
        actor: ActorId,
        /// Where to, in turn: 1 to [`WALKER_STAGES_MAX`](crate::limits::WALKER_STAGES_MAX).
        stages: Vec<WalkerStage>,
        /// When it begins; `None`: at once.
        trigger: Option<Proximity>,
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
    /// Poses bones of a walker, to be shown and met with or instead of its walk.
    Bones {
        /// Which walker.
        actor: ActorId,
        /// How.
        change: BonesChange,
    },
}
