//! What can be changed in a world.

mod body;
mod driver;
mod scene;
mod vehicle;
mod walker;

use serde::{Deserialize, Serialize};

pub use self::body::{BodyCommand, BodySwitch, PushKind};
pub use self::driver::{AgentBehaviour, AgentCommand, AgentOptions, TrafficCommand};
pub use self::scene::{SceneryCommand, SensorCommand, TrafficLightCommand};
pub use self::vehicle::{PilotMode, VehicleCommand};
pub use self::walker::{Proximity, WalkerCommand, WalkerStage};
use crate::{ActorId, Pose, Vec3, Weather};

/// One setting of an actor, as CARLA writes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Attribute {
    /// E.g. `role_name`.
    pub id: String,
    /// E.g. `hero`, `0.05`, `true`, `255,0,0`.
    pub value: String,
}

/// How an actor hangs on its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AttachmentKind {
    /// Moves as one with it.
    Rigid,
    /// Follows smoothly and comes closer where something is in between.
    SpringArm,
    /// Follows smoothly through everything.
    SpringArmGhost,
}

/// On whom a new actor hangs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Attachment {
    /// On whom.
    pub parent: ActorId,
    /// How.
    pub kind: AttachmentKind,
}

/// One change of one world. A refused command leaves the world unchanged.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Puts an actor into the world; answered with its id.
    SpawnActor {
        /// CARLA blueprint id, e.g. `vehicle.lincoln.mkz`.
        blueprint: String,
        /// Where its point of reference is: in the parent when attached, else in the world.
        reference_from_actor: Pose,
        /// Speed it starts with, world frame.
        linear_velocity_mps: Vec3,
        /// Those that differ from the blueprint's defaults.
        attributes: Vec<Attribute>,
        /// `None`: stands alone.
        attachment: Option<Attachment>,
        /// The id it is to have: one that nobody alive has, above that of its parent, and at most
        /// [`limits::WANTED_ACTOR_MAX`](crate::limits::WANTED_ACTOR_MAX). `None`: the next one.
        id: Option<ActorId>,
    },
    /// Takes an actor out of the world.
    DestroyActor {
        /// Which.
        actor: ActorId,
    },
    /// Moves a body, or changes what it takes part in.
    Body(BodyCommand),
    /// Drives or changes a vehicle.
    Vehicle(VehicleCommand),
    /// Gives a vehicle a navigation agent, or changes it.
    Agent(AgentCommand),
    /// Changes the world's own traffic.
    Traffic(TrafficCommand),
    /// Steers a walker.
    Walker(WalkerCommand),
    /// Changes traffic lights.
    TrafficLight(TrafficLightCommand),
    /// Shows or hides things of the map.
    Scenery(SceneryCommand),
    /// Tells a sensor something.
    Sensor(SensorCommand),
    /// Changes the weather.
    SetWeather {
        /// To what.
        weather: Weather,
    },
    /// Changes the length of a tick and how it is cut into physics steps; `None` stays.
    SetTimeStep {
        /// Length of a tick in seconds.
        dt_secs: f64,
        /// Longest physics step in seconds.
        substep_secs_max: Option<f64>,
        /// Most physics steps in one tick.
        substeps_max: Option<u32>,
    },
}

impl Command {
    /// A new actor that stands alone, with the blueprint's defaults.
    pub fn spawn(
        blueprint: impl Into<String>,
        world_from_actor: Pose,
        linear_velocity_mps: Vec3,
    ) -> Self {
        Self::SpawnActor {
            blueprint: blueprint.into(),
            reference_from_actor: world_from_actor,
            linear_velocity_mps,
            attributes: Vec::new(),
            attachment: None,
            id: None,
        }
    }
}
