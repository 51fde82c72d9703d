//! What a sensor is told about itself and the world around it.

use roads::Map;
use schemas::{ActorId, Collision, Pose, Vec3};

use crate::rays::RayScene;

/// Where a sensor is and how it moves; world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mount {
    pub world_from_sensor: Pose,
    /// Of the sensor's own place, not of its carrier's centre.
    pub velocity_mps: Vec3,
    pub angular_radps: Vec3,
    /// The body it hangs on.
    pub carrier: Option<Carrier>,
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

/// The world at the end of a tick.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub roads: &'a Map,
    /// Everything rays meet; built by the first sensor that asks.
    pub rays: &'a dyn Fn() -> RayScene<'a>,
    /// Velocity of an actor's body at a point, world frame.
    pub velocity_mps: &'a dyn Fn(ActorId, Vec3) -> Vec3,
    /// CARLA's semantic tag of an actor.
    pub tag: &'a dyn Fn(ActorId) -> u8,
    /// Of the last tick.
    pub collisions: &'a [Collision],
    /// Length of the last tick.
    pub dt_secs: f64,
}
