//! Changes of what surrounds the actors that move: lights, things of the map, sensors.

use std::sync::Arc;

use crate::{ActorId, MaterialParameter, Texture, TrafficLightColour};

/// One change of traffic lights.
#[derive(Clone, Debug, PartialEq)]
pub enum TrafficLightCommand {
    /// Changes what a traffic light shows and how long; `None` stays.
    Set {
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
    Freeze {
        /// Stop or resume.
        frozen: bool,
    },
    /// Starts a cycle anew.
    Reset {
        /// That of this light's group; `None`: of all groups.
        actor: Option<ActorId>,
    },
}

/// One change of what is shown of the map.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneryCommand {
    /// Loads or unloads layers of the map: all things of a layer that have a place in the scenery
    /// appear or go. Things that were hidden one by one are shown when their layer is loaded anew,
    /// and have no paint then.
    Layers {
        /// CARLA's `MapLayer` flags.
        layers: u16,
        /// Load or unload.
        loaded: bool,
    },
    /// Shows or hides single things of the map. Those of layers that are not loaded stay hidden,
    /// those without a place in the scenery stay shown.
    Objects {
        /// Ids of environment objects of the map.
        objects: Vec<u64>,
        /// Show or hide.
        enabled: bool,
    },
    /// Puts a texture on things of the map, in place of the one that they had there. Things without
    /// a place in the scenery stay as they are.
    Paint {
        /// Ids of environment objects of the map.
        objects: Vec<u64>,
        /// What it replaces.
        parameter: MaterialParameter,
        /// On each side of each of them once, over all of its extent.
        texture: Arc<Texture>,
    },
}

/// One change of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorCommand {
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
