//! What a sensor is told about itself and the world around it.

use roads::Map;
use schemas::{ActorId, Collision, Pose, StationKind, Vec3};

use super::radio::Transmission;
use crate::rays::Sight;

/// Where a sensor is and how it moves; world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mount {
    pub world_from_sensor: Pose,
    /// Of the sensor's own place, not of its carrier's centre.
    pub velocity_mps: Vec3,
    pub angular_radps: Vec3,
    /// The body it hangs on.
    pub carrier: Option<Carrier>,
    /// The actor it is attached to, with or without a body.
    pub host: Option<ActorId>,
}

/// The actor a sensor hangs on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carrier {
    pub id: ActorId,
    pub world_from_actor: Pose,
    /// Of its bounding box, in its frame.
    pub box_centre_m: Vec3,
    pub box_half_m: Vec3,
}

impl Carrier {
    /// The middle of the roof of its box and `above_m`, world frame.
    pub(super) fn top_m(&self, above_m: f32) -> Vec3 {
        let roof_m = self.box_centre_m + Vec3::z() * (self.box_half_m.z + above_m);
        self.world_from_actor * nalgebra::Point3::from(roof_m) - nalgebra::Point3::origin()
    }
}

/// An actor as others hear of it by radio.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Station {
    pub carrier: Carrier,
    pub kind: StationKind,
    /// Whether it is a vehicle.
    pub has_wheels: bool,
    /// CARLA's `VehicleLightState` flags.
    pub lights: u32,
    /// World frame.
    pub velocity_mps: Vec3,
    /// World frame.
    pub angular_radps: Vec3,
}

impl Station {
    /// Speed along its own x axis.
    pub(super) fn along_mps(&self) -> f32 {
        let forward = self.carrier.world_from_actor.rotation * Vec3::x();
        self.velocity_mps.dot(&forward)
    }
}

/// The world at the end of a tick.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub roads: &'a Map,
    /// Everything rays meet.
    pub sight: &'a Sight<'a>,
    /// Velocity of an actor's body at a point, world frame.
    pub velocity_mps: &'a dyn Fn(ActorId, Vec3) -> Vec3,
    /// CARLA's semantic tag of an actor.
    pub tag: &'a dyn Fn(ActorId) -> u8,
    /// Of the last tick.
    pub collisions: &'a [Collision],
    /// How an actor is heard of.
    pub station: &'a dyn Fn(ActorId) -> Option<Station>,
    /// What was sent by radio in this tick; ordered by sensor.
    pub air: &'a [Transmission],
    /// Length of the last tick.
    pub dt_secs: f64,
}
