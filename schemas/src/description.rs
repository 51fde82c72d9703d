//! What does not change from tick to tick.

use crate::{AckermannGains, ActorId, ActorKind, Attachment, Attribute, Vec3};
use crate::{VehiclePhysics, VehicleTelemetry};

/// Everything about an actor that a frame does not repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct ActorDescription {
    /// Who.
    pub id: ActorId,
    /// On whom it hangs.
    pub attachment: Option<Attachment>,
    /// What, coarsely.
    pub kind: ActorKind,
    /// What, exactly.
    pub blueprint: String,
    /// Every attribute of the blueprint with this actor's value.
    pub attributes: Vec<Attribute>,
    /// Centre of the bounding box in the actor's frame.
    pub box_centre_m: Vec3,
    /// Half size of the bounding box.
    pub box_half_extent_m: Vec3,
    /// CARLA's semantic tag.
    pub tag: u8,
    /// Id of the OpenDRIVE signal that a light or sign stands for.
    pub signal: Option<String>,
}

/// Parameters and last measurements of a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleReport {
    /// How it drives.
    pub physics: VehiclePhysics,
    /// What it did in the last tick.
    pub telemetry: VehicleTelemetry,
    /// Of its Ackermann controller.
    pub gains: AckermannGains,
}

/// Something that a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Index of the ray in the request.
    pub ray: u32,
    /// `None` for scenery and ground.
    pub actor: Option<ActorId>,
    /// CARLA's semantic tag.
    pub tag: u8,
    /// Metres, world frame.
    pub position_m: Vec3,
}
