//! Small values shared by all messages.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, Vector, WIPOffset};
use nalgebra::{Quaternion, Translation3};

use super::check_count;
use crate::generated as fb;
use crate::limits::{ATTRIBUTE_CHARS_MAX, ATTRIBUTES_PER_ACTOR_MAX};
use crate::{
    ActorId, Attribute, Error, ErrorCode, Pose, ServiceId, TrafficLightColour, UnitQuaternion,
    Vec3, VehicleFailure, WorldId,
};

type Attributes<'a> = Vector<'a, ForwardsUOffset<fb::Attribute<'a>>>;

pub(super) fn vec3_out(value: &Vec3) -> fb::Vec3 {
    fb::Vec3::new(value.x, value.y, value.z)
}

pub(super) fn vec3_in(raw: &fb::Vec3, field: &'static str) -> Result<Vec3, Error> {
    let value = Vec3::new(raw.x(), raw.y(), raw.z());
    if value.iter().all(|component| component.is_finite()) {
        return Ok(value);
    }
    Err(not_finite(field, &value))
}

pub(super) fn pose_out(value: &Pose) -> fb::Pose {
    let q = value.rotation.as_ref().coords;
    fb::Pose::new(&vec3_out(&value.translation.vector), &fb::Quat::new(q.x, q.y, q.z, q.w))
}

pub(super) fn pose_in(raw: &fb::Pose, field: &'static str) -> Result<Pose, Error> {
    let position_m = vec3_in(raw.position_m(), field)?;
    let raw = raw.orientation();
    let quaternion = Quaternion::new(raw.w(), raw.x(), raw.y(), raw.z());
    // Also false for NaN. The bits stay as they came: normalising would change a frame's hash.
    let unit = (quaternion.norm() - 1.0).abs() < 1e-3;
    if !unit {
        return Err(Error::new(
            ErrorCode::InvalidMessage,
            format!("{field} has no valid rotation"),
        )
        .wanted("a unit quaternion x, y, z, w")
        .found(format!("{:?}", quaternion.coords.as_slice())));
    }
    Ok(Pose::from_parts(Translation3::from(position_m), UnitQuaternion::new_unchecked(quaternion)))
}

pub(super) fn finite(value: f32, field: &'static str) -> Result<f32, Error> {
    if value.is_finite() { Ok(value) } else { Err(not_finite(field, &value)) }
}

pub(super) fn finite_double(value: f64, field: &'static str) -> Result<f64, Error> {
    if value.is_finite() { Ok(value) } else { Err(not_finite(field, &value)) }
}

pub(super) fn attributes_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    attributes: &[Attribute],
) -> WIPOffset<Attributes<'a>> {
    let mut raw = Vec::with_capacity(attributes.len());
    for attribute in attributes {
        let id = Some(b.create_string(&attribute.id));
        let value = Some(b.create_string(&attribute.value));
        raw.push(fb::Attribute::create(b, &fb::AttributeArgs { id, value }));
    }
    b.create_vector(&raw)
}

pub(super) fn attributes_in(raw: Option<Attributes<'_>>) -> Result<Vec<Attribute>, Error> {
    let Some(raw) = raw else { return Ok(Vec::new()) };
    check_count("attributes", raw.len(), ATTRIBUTES_PER_ACTOR_MAX)?;
    raw.iter()
        .map(|raw| {
            let (id, value) = (raw.id(), raw.value());
            check_count("characters in an attribute", id.chars().count(), ATTRIBUTE_CHARS_MAX)?;
            check_count("characters in an attribute", value.chars().count(), ATTRIBUTE_CHARS_MAX)?;
            Ok(Attribute { id: id.to_owned(), value: value.to_owned() })
        })
        .collect()
}

pub(super) fn name_in(name: &str) -> Result<ServiceId, Error> {
    name.parse().map_err(|cause| Error::new(ErrorCode::InvalidMessage, format!("name: {cause}")))
}

pub(super) fn world_in(value: u64) -> Result<WorldId, Error> {
    WorldId::new(value).ok_or_else(|| zero("a world id"))
}

pub(super) fn actor_in(value: u32) -> Result<ActorId, Error> {
    ActorId::new(value).ok_or_else(|| zero("an actor id"))
}

pub(super) fn unknown_variant(field: &'static str, found: u8) -> Error {
    Error::new(ErrorCode::InvalidMessage, format!("{field} has no such value"))
        .wanted("a value of this schema version")
        .found(found)
}

fn zero(what: &str) -> Error {
    Error::new(ErrorCode::InvalidMessage, format!("{what} is 0"))
        .wanted(format!("{what} from 1 up"))
}

fn not_finite(field: &'static str, found: &dyn std::fmt::Debug) -> Error {
    Error::new(ErrorCode::InvalidMessage, format!("{field} is not finite"))
        .wanted("finite numbers")
        .found(format!("{found:?}"))
}

/// Pairs every domain variant with its generated twin, both ways.
macro_rules! twin {
    ($out:ident, $in:ident, $domain:ty, $wire:ty, $field:literal, [$($variant:ident),+ $(,)?]) => {
        pub(super) fn $out(value: $domain) -> $wire {
            match value { $(<$domain>::$variant => <$wire>::$variant),+ }
        }
        pub(super) fn $in(raw: $wire) -> Result<$domain, Error> {
            $(if raw == <$wire>::$variant { return Ok(<$domain>::$variant); })+
            Err(unknown_variant($field, raw.0))
        }
    };
}

twin!(
    actor_kind_out,
    actor_kind_in,
    crate::ActorKind,
    fb::ActorKind,
    "kind",
    [Vehicle, Walker, Prop, TrafficLight, TrafficSign, Sensor, Marker]
);
twin!(
    image_kind_out,
    image_kind_in,
    crate::ImageKind,
    fb::ImageKind,
    "image kind",
    [Rgb, Depth, Semantic, Instance, Normals]
);
twin!(
    encoding_out,
    encoding_in,
    crate::ImageEncoding,
    fb::ImageEncoding,
    "encoding",
    [Jpeg, Rgba8, DepthF32, TagU8, TagIdU32, NormalI8]
);
twin!(
    pilot_out,
    pilot_in,
    crate::PilotMode,
    fb::PilotMode,
    "pilot mode",
    [KeepLane, ChangeLaneLeft, ChangeLaneRight]
);
twin!(
    behaviour_out,
    behaviour_in,
    crate::AgentBehaviour,
    fb::AgentBehaviour,
    "agent behaviour",
    [Basic, Cautious, Normal, Aggressive]
);
twin!(
    status_out,
    status_in,
    crate::AgentStatus,
    fb::AgentStatus,
    "agent status",
    [Wandering, OnRoute, Arrived]
);
twin!(
    service_kind_out,
    service_kind_in,
    crate::ServiceKind,
    fb::ServiceKind,
    "service kind",
    [World, Render, Scenario, Gateway]
);
twin!(
    error_code_out,
    error_code_in,
    ErrorCode,
    fb::ErrorCode,
    "error code",
    [
        Internal,
        InvalidMessage,
        InvalidArgument,
        UnknownWorld,
        UnknownActor,
        UnknownBlueprint,
        UnknownMap,
        UnknownAsset,
        SpawnBlocked,
        WrongTick,
        WorldQuarantined,
        Capacity,
        TooLarge,
        RendererUnavailable,
        Unreachable,
        TimedOut,
        Unsupported,
    ]
);
twin!(
    colour_out,
    colour_in,
    TrafficLightColour,
    fb::TrafficLightColour,
    "colour",
    [Red, Yellow, Green, Off, Unknown]
);
twin!(
    failure_out,
    failure_in,
    VehicleFailure,
    fb::VehicleFailure,
    "failure",
    [None, Rollover, Engine, TyrePuncture]
);
twin!(handling_out, handling_in, crate::Handling, fb::Handling, "handling", [Real, Carla]);
twin!(
    halt_reason_out,
    halt_reason_in,
    crate::HaltReason,
    fb::HaltReason,
    "halt reason",
    [NotFinite, TooFast, TooFar]
);
twin!(
    attachment_out,
    attachment_in,
    crate::AttachmentKind,
    fb::AttachmentKind,
    "attachment",
    [Rigid, SpringArm, SpringArmGhost]
);
twin!(
    push_out,
    push_in,
    crate::PushKind,
    fb::PushKind,
    "push kind",
    [Impulse, Force, AngularImpulse, Torque]
);
twin!(
    switch_out,
    switch_in,
    crate::BodySwitch,
    fb::BodySwitch,
    "switch",
    [Physics, Gravity, Collisions]
);
