//! What can be changed in a world.

use serde::{Deserialize, Serialize};

use crate::{AckermannControl, AckermannGains, ActorId, Pose, TrafficLightColour, Vec3};
use crate::{VehicleControl, VehiclePhysics, WalkerControl, Weather};

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
        /// Where; see [`ActorState::world_from_actor`](crate::ActorState::world_from_actor). In the
        /// parent's frame when attached.
        world_from_actor: Pose,
        /// Speed it starts with, world frame.
        linear_velocity_mps: Vec3,
        /// Those that differ from the blueprint's defaults.
        attributes: Vec<Attribute>,
        /// `None`: stands alone.
        attachment: Option<Attachment>,
    },
    /// Takes an actor out of the world.
    DestroyActor {
        /// Which.
        actor: ActorId,
    },
    /// Manual driving, until replaced; ends any pilot.
    SetControl {
        /// Which vehicle.
        actor: ActorId,
        /// How.
        control: VehicleControl,
    },
    /// Drives towards a speed and a wheel angle, until replaced; ends any pilot.
    SetAckermann {
        /// Which vehicle.
        actor: ActorId,
        /// To what.
        control: AckermannControl,
    },
    /// Changes how the Ackermann controller reacts.
    SetAckermannGains {
        /// Which vehicle.
        actor: ActorId,
        /// To what.
        gains: AckermannGains,
    },
    /// Hands a vehicle to a driver that runs inside the tick.
    SetPilot {
        /// Which vehicle.
        actor: ActorId,
        /// What the driver does.
        mode: PilotMode,
        /// `None`: the speed at the moment of the command.
        target_speed_mps: Option<f32>,
    },
    /// Gives a vehicle a navigation agent that can drive inside the tick. It does not drive until
    /// [`DriveAgent`](Self::DriveAgent).
    SetAgent {
        /// Which vehicle.
        actor: ActorId,
        /// How it drives.
        options: AgentOptions,
        /// The route of the vehicle's agent before stays.
        keep_route: bool,
    },
    /// Where a vehicle's agent drives.
    SetAgentRoute {
        /// Which vehicle.
        actor: ActorId,
        /// To pass in order, the last one to stop at; none: any way. World frame.
        places_m: Vec<Vec3>,
    },
    /// Lets a vehicle's agent drive, or leaves the vehicle with its last control.
    DriveAgent {
        /// Which vehicle.
        actor: ActorId,
        /// Drive or leave.
        on: bool,
    },
    /// Hands a vehicle to a driver of the world's own traffic.
    SetTraffic {
        /// Which vehicle.
        actor: ActorId,
        /// How it drives.
        behaviour: AgentBehaviour,
    },
    /// Spawns cars on free places of the lanes and hands them to drivers of traffic; all or none.
    SpawnTraffic {
        /// How many.
        count: u32,
        /// `None`: a mixture of cautious and normal drivers.
        behaviour: Option<AgentBehaviour>,
    },
    /// Lets traffic far from all other vehicles move along its way without dynamics.
    SetHybridTraffic {
        /// From where on, in metres; `None`: all traffic has dynamics.
        radius_m: Option<f32>,
    },
    /// How a walker moves, until replaced.
    SetWalkerControl {
        /// Which walker.
        actor: ActorId,
        /// How.
        control: WalkerControl,
    },
    /// Lets a walker find its own way on the navigation mesh, until it is steered otherwise.
    SetWalkerAgent {
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
    SetWalkerState {
        /// Which walker.
        actor: ActorId,
        /// Where.
        world_from_actor: Pose,
        /// How fast its legs go.
        speed_mps: f32,
    },
    /// Overrides velocities; `None` stays.
    SetVelocity {
        /// Which actor.
        actor: ActorId,
        /// Metres per second, world frame.
        linear_mps: Option<Vec3>,
        /// Radians per second, world frame.
        angular_radps: Option<Vec3>,
    },
    /// Holds a velocity against all forces; `None` lets go.
    SetConstantVelocity {
        /// Which actor.
        actor: ActorId,
        /// Metres per second, actor frame.
        velocity_mps: Option<Vec3>,
    },
    /// Pushes a body.
    Push {
        /// Which actor.
        actor: ActorId,
        /// How.
        kind: PushKind,
        /// How much and where to, world frame; the unit follows the kind.
        amount: Vec3,
    },
    /// Moves an actor at once, keeping its velocity.
    SetPose {
        /// Which actor.
        actor: ActorId,
        /// Where.
        world_from_actor: Pose,
    },
    /// Turns a property of a body on or off.
    SetSwitch {
        /// Which actor.
        actor: ActorId,
        /// What.
        switch: BodySwitch,
        /// On or off.
        on: bool,
    },
    /// Changes how a vehicle drives.
    SetVehiclePhysics {
        /// Which vehicle.
        actor: ActorId,
        /// To what.
        physics: Box<VehiclePhysics>,
    },
    /// Switches lamps.
    SetVehicleLights {
        /// Which vehicle.
        actor: ActorId,
        /// CARLA's `VehicleLightState` flags.
        lights: u32,
    },
    /// Opens or closes doors.
    SetDoors {
        /// Which vehicle.
        actor: ActorId,
        /// Bits as in [`ActorState::doors`](crate::ActorState::doors).
        doors: u8,
        /// Open or close.
        open: bool,
    },
    /// Changes what a traffic light shows and how long; `None` stays.
    SetTrafficLight {
        /// Which light.
        actor: ActorId,
        /// What it shows now.
        colour: Option<TrafficLightColour>,
        /// How long it shows green.
        green_secs: Option<f32>,
        /// How long it shows yellow.
        yellow_secs: Option<f32>,
        /// How long everything stays red after it.
        red_secs: Option<f32>,
    },
    /// Stops or resumes all traffic lights.
    FreezeTrafficLights {
        /// Stop or resume.
        frozen: bool,
    },
    /// Starts a cycle anew.
    ResetTrafficLights {
        /// That of this light's group; `None`: of all groups.
        actor: Option<ActorId>,
    },
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
    /// Loads or unloads layers of the map: all things of a layer that have a place in the scenery
    /// appear or go. Things that were hidden one by one are shown when their layer is loaded anew.
    SetMapLayers {
        /// CARLA's `MapLayer` flags.
        layers: u16,
        /// Load or unload.
        loaded: bool,
    },
    /// Shows or hides single things of the map. Those of layers that are not loaded stay hidden,
    /// those without a place in the scenery stay shown.
    SetEnvironmentObjects {
        /// Ids of environment objects of the map.
        objects: Vec<u64>,
        /// Show or hide.
        enabled: bool,
    },
    /// A sensor measures only while somebody listens.
    Listen {
        /// Which sensor.
        sensor: ActorId,
        /// Begin or end.
        on: bool,
    },
    /// A sensor sees through these vehicles from now on, and through no others.
    IgnoreVehicles {
        /// Which sensor.
        sensor: ActorId,
        /// At most [`IGNORED_VEHICLES_MAX`](crate::limits::IGNORED_VEHICLES_MAX).
        vehicles: Vec<ActorId>,
    },
    /// Gives a V2X sensor a text that it sends in the next tick.
    SendV2x {
        /// Which sensor; a `sensor.other.v2x_custom`.
        sensor: ActorId,
        /// At most [`V2X_TEXT_BYTES_MAX`](crate::limits::V2X_TEXT_BYTES_MAX).
        text: String,
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
            world_from_actor,
            linear_velocity_mps,
            attributes: Vec::new(),
            attachment: None,
        }
    }
}

/// What an in-tick driver does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum PilotMode {
    /// Keep the lane at a target speed.
    KeepLane,
    /// Move to the left neighbouring lane of the same direction, then keep it.
    ChangeLaneLeft,
    /// Move to the right neighbouring lane of the same direction, then keep it.
    ChangeLaneRight,
}

/// Character of a navigation agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AgentBehaviour {
    /// Keeps a target speed and brakes for what is near.
    #[default]
    Basic,
    /// At most 40 km/h, and much distance.
    Cautious,
    /// At most 50 km/h.
    Normal,
    /// At most 70 km/h, and little distance.
    Aggressive,
}

/// How a navigation agent drives: CARLA's options of its agents.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AgentOptions {
    /// Its character.
    pub behaviour: AgentBehaviour,
    /// `None`: 20 km/h for the basic agent, the highest of the behaviour for others.
    pub target_speed_mps: Option<f32>,
    /// The basic agent drives as fast as is allowed instead of its target speed.
    pub follow_speed_limits: bool,
    /// Red lights do not count.
    pub ignore_lights: bool,
    /// Stop signs do not count.
    pub ignore_stop_signs: bool,
    /// Vehicles and walkers do not count.
    pub ignore_vehicles: bool,
    /// How near to a light it brakes at standstill; `None`: 5 m.
    pub light_distance_m: Option<f32>,
    /// How near to a vehicle it brakes at standstill; `None`: 5 m for the basic agent, the
    /// emergency distance of the behaviour for others.
    pub vehicle_distance_m: Option<f32>,
}

/// What a push is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PushKind {
    /// Newton seconds.
    Impulse,
    /// Newtons, during the next tick.
    Force,
    /// Newton metre seconds.
    AngularImpulse,
    /// Newton metres, during the next tick.
    Torque,
}

/// What of a body can be turned off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BodySwitch {
    /// Off: it stays where it is put.
    Physics,
    /// Off: it does not fall.
    Gravity,
    /// Off: nothing touches it.
    Collisions,
}
