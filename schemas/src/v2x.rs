//! What stations tell each other by radio: cooperative awareness messages after ETSI EN 302 637-2,
//! and texts.

use crate::{ActorId, Vec3};

/// What sends; numbers of ETSI TS 102 894-2, DE_StationType.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum StationKind {
    /// A thing.
    #[default]
    Unknown = 0,
    /// Somebody who walks.
    Pedestrian = 1,
    /// A bicycle.
    Cyclist = 2,
    /// Two wheels and an engine.
    Motorcycle = 4,
    /// A car.
    PassengerCar = 5,
    /// A bus.
    Bus = 6,
    /// A truck.
    LightTruck = 7,
    /// An ambulance, a fire engine, police.
    SpecialVehicle = 10,
    /// Something on rails.
    Tram = 11,
    /// A traffic light or sign.
    RoadSideUnit = 15,
}

/// How a station on wheels moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StationMotion {
    /// Clockwise from north.
    pub heading_deg: f32,
    /// Along the vehicle; at least 0.
    pub speed_mps: f32,
    /// Or backward.
    pub forward: bool,
    /// Of the vehicle.
    pub length_m: f32,
    /// Of the vehicle.
    pub width_m: f32,
    /// Vehicle frame (ISO 8855), with gravity: +g upwards at rest.
    pub acceleration_mps2: Vec3,
    /// Positive to the left.
    pub yaw_rate_radps: f32,
}

/// A cooperative awareness message (CAM).
#[derive(Clone, Debug, PartialEq)]
pub struct AwarenessMessage {
    /// Who sends: the actor that the sensor hangs on.
    pub station: ActorId,
    /// What it is.
    pub kind: StationKind,
    /// Simulated seconds at which it was made.
    pub sim_secs: f64,
    /// Positive north.
    pub latitude_deg: f64,
    /// Positive east.
    pub longitude_deg: f64,
    /// Above the map's zero.
    pub altitude_m: f64,
    /// `None` of stations without wheels.
    pub motion: Option<StationMotion>,
    /// CARLA's `VehicleLightState` flags; only in the messages that tell them.
    pub lights: Option<u32>,
}

/// A text between V2X sensors of one channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CustomMessage {
    /// Who sends: the actor that the sensor hangs on, or the sensor itself.
    pub station: ActorId,
    /// At most [`V2X_TEXT_BYTES_MAX`](crate::limits::V2X_TEXT_BYTES_MAX).
    pub text: String,
}

/// A message as it arrives.
#[derive(Clone, Debug, PartialEq)]
pub struct Received<Message> {
    /// What is left of the sender's power.
    pub power_dbm: f32,
    /// What it says.
    pub message: Message,
}
