//! Drivers that find their way inside the tick: navigation agents and traffic.

use serde::{Deserialize, Serialize};

use crate::{ActorId, Vec3};

/// One change of a navigation agent.
#[derive(Clone, Debug, PartialEq)]
pub enum AgentCommand {
    /// Gives a vehicle a navigation agent that can drive inside the tick. It does not drive until
    /// [`Drive`](Self::Drive).
    Set {
        /// Which vehicle.
        actor: ActorId,
        /// How it drives.
        options: AgentOptions,
        /// The route of the vehicle's agent before stays.
        keep_route: bool,
    },
    /// Where a vehicle's agent drives.
    SetRoute {
        /// Which vehicle.
        actor: ActorId,
        /// To pass in order, the last one to stop at; none: any way. World frame.
        places_m: Vec<Vec3>,
    },
    /// Lets a vehicle's agent drive, or leaves the vehicle with its last control.
    Drive {
        /// Which vehicle.
        actor: ActorId,
        /// Drive or leave.
        on: bool,
    },
}

/// One change of the world's own traffic.
#[derive(Clone, Debug, PartialEq)]
pub enum TrafficCommand {
    /// Hands a vehicle to a driver of the world's own traffic.
    Join {
        /// Which vehicle.
        actor: ActorId,
        /// How it drives.
        behaviour: AgentBehaviour,
    },
    /// Spawns cars on free places of the lanes and hands them to drivers of traffic; all or none.
    Spawn {
        /// How many.
        count: u32,
        /// `None`: a mixture of cautious and normal drivers.
        behaviour: Option<AgentBehaviour>,
    },
    /// Lets traffic far from all other vehicles move along its way without dynamics.
    SetHybrid {
        /// From where on, in metres; `None`: all traffic has dynamics.
        radius_m: Option<f32>,
    },
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
