//! Calls about vehicles.

use schemas::{ActorKind, ActorState, Command, VehicleCommand};

use super::{orders, parts};
use crate::dialect::{AckermannSettings, ActorRef, BatchCommand, LightFlags, TelemetryData};
use crate::dialect::{PhysicsControl, Transform, counted_wheels};
use crate::endpoint::Endpoint;
use crate::episode::WheelAngles;
use crate::rpc::{Answer, Payload, Refusal, Request};

pub(super) fn lights(endpoint: &mut Endpoint, id: ActorRef) -> Result<LightFlags, Refusal> {
    Ok(LightFlags { flags: vehicle(endpoint, id)?.lights })
}

pub(super) async fn set_lights(
    endpoint: &mut Endpoint,
    id: ActorRef,
    lights: LightFlags,
) -> Result<(), Refusal> {
    orders::queue(endpoint, &BatchCommand::Lights(id, lights.flags)).await
}

pub(super) fn lights_of_all(endpoint: &mut Endpoint) -> Result<Vec<(ActorRef, u32)>, Refusal> {
    let vehicles = endpoint.episode()?.states().filter(|actor| actor.kind == ActorKind::Vehicle);
    Ok(vehicles.map(|vehicle| (vehicle.id.into(), vehicle.lights)).collect())
}

/// In a world that is gone.
pub(super) fn no_lights(_: &Request, _: Refusal) -> Answer {
    Payload::value(&[(); 0])
}

pub(super) async fn open_door(
    endpoint: &mut Endpoint,
    id: ActorRef,
    door: u8,
) -> Result<(), Refusal> {
    set_doors(endpoint, id, door, true).await
}

pub(super) async fn close_door(
    endpoint: &mut Endpoint,
    id: ActorRef,
    door: u8,
) -> Result<(), Refusal> {
    set_doors(endpoint, id, door, false).await
}

async fn set_doors(
    endpoint: &mut Endpoint,
    id: ActorRef,
    door: u8,
    open: bool,
) -> Result<(), Refusal> {
    let actor = id.named()?;
    let command = VehicleCommand::Doors { actor, doors: doors(door), open };
    endpoint.queue(Command::Vehicle(command)).await
}

/// Bits of CARLA's number of a door.
fn doors(door: u8) -> u8 {
    match door {
        0..=5 => 1 << door,
        _ => 0b11_1111,
    }
}

/// As a client holds the wheel, or as it is driven.
pub(super) fn wheel_steer_deg(
    endpoint: &mut Endpoint,
    id: ActorRef,
    wheel: u8,
) -> Result<f32, Refusal> {
    let episode = endpoint.episode()?;
    Ok(episode.wheel_deg(episode.found_as(id, ActorKind::Vehicle)?, wheel).0)
}

/// As a client holds the wheel, or as it has rolled.
pub(super) fn wheel_pitch_deg(
    endpoint: &mut Endpoint,
    id: ActorRef,
    wheel: u8,
) -> Result<f32, Refusal> {
    let episode = endpoint.episode()?;
    Ok(episode.wheel_deg(episode.found_as(id, ActorKind::Vehicle)?, wheel).1)
}

pub(super) fn steer_wheel(
    endpoint: &mut Endpoint,
    id: ActorRef,
    wheel: u8,
    degrees: f32,
) -> Result<(), Refusal> {
    hold_wheel(endpoint, id, wheel, |angles| angles.steer = Some(degrees))
}

pub(super) fn pitch_wheel(
    endpoint: &mut Endpoint,
    id: ActorRef,
    wheel: u8,
    degrees: f32,
) -> Result<(), Refusal> {
    hold_wheel(endpoint, id, wheel, |angles| angles.pitch = Some(degrees))
}

fn hold_wheel(
    endpoint: &mut Endpoint,
    id: ActorRef,
    wheel: u8,
    hold: impl FnOnce(&mut WheelAngles),
) -> Result<(), Refusal> {
    /// Of one vehicle, far more than any has.
    const WHEELS_MAX: u8 = 16;
    let vehicle = vehicle(endpoint, id)?.id;
    if wheel >= WHEELS_MAX {
        return Err(Refusal(format!("no vehicle has a wheel {wheel}")));
    }
    match endpoint.episode()?.wheel_angles_mut(vehicle, wheel) {
        Some(angles) => hold(angles),
        None => tracing::warn!(%vehicle, "wheels are held only without physics"),
    }
    Ok(())
}

pub(super) fn bones_in_world(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<Vec<Transform>, Refusal> {
    vehicle(endpoint, id)?;
    parts::bones_in_world(endpoint, id)
}

/// What makes a vehicle drive as it does.
pub(super) async fn physics(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<PhysicsControl, Refusal> {
    let report = endpoint.inspect(id).await?;
    let pose = vehicle(endpoint, id)?.world_from_actor;
    Ok(PhysicsControl::of(&report.physics, &pose, endpoint.config.version))
}

pub(super) async fn set_physics(
    endpoint: &mut Endpoint,
    id: ActorRef,
    control: PhysicsControl,
) -> Result<(), Refusal> {
    let command = physics_command(endpoint, id, &control).await?;
    endpoint.queue(command).await
}

/// The command for a change of physics, which needs to know what stays.
///
/// # Errors
/// No such vehicle, another number of wheels, or numbers that overflow in our units.
pub(super) async fn physics_command(
    endpoint: &mut Endpoint,
    id: ActorRef,
    control: &PhysicsControl,
) -> Result<Command, Refusal> {
    let actor = vehicle(endpoint, id)?.id;
    let now = endpoint.inspect(id).await?.physics;
    let wanted = counted_wheels(now.wheels.len());
    if control.wheel_count() != wanted {
        return Err(Refusal(format!(
            "a vehicle keeps its number of wheels: wanted {wanted}, found {}",
            control.wheel_count()
        )));
    }
    let physics = Box::new(control.ours(&now));
    endpoint.recorder.note_physics(actor);
    orders::check(endpoint, Command::Vehicle(VehicleCommand::Physics { actor, physics }))
}

pub(super) async fn telemetry(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<TelemetryData, Refusal> {
    Ok(TelemetryData::of(&endpoint.inspect(id).await?.telemetry))
}

pub(super) async fn ackermann_settings(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<AckermannSettings, Refusal> {
    Ok(AckermannSettings::of(&endpoint.inspect(id).await?.gains))
}

pub(super) async fn set_ackermann_settings(
    endpoint: &mut Endpoint,
    id: ActorRef,
    settings: AckermannSettings,
) -> Result<(), Refusal> {
    let actor = id.named()?;
    let command = VehicleCommand::AckermannGains { actor, gains: settings.ours() };
    endpoint.queue(Command::Vehicle(command)).await
}

fn vehicle(endpoint: &mut Endpoint, id: ActorRef) -> Result<&ActorState, Refusal> {
    endpoint.episode()?.found_as(id, ActorKind::Vehicle)
}
