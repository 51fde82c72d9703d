//! Calls about vehicles.

use schemas::{ActorKind, ActorState, Command};

use super::orders::{self, queue};
use super::{astray, parts, wrong_kind};
use crate::dialect::{
    AckermannControl, AckermannSettings, BatchCommand as To, LightFlags, TelemetryData,
    VehicleControl, VehiclePhysicsControl, counted_wheels,
};
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "apply_control_to_vehicle" => {
            let (_, id, control): (Meta, u32, VehicleControl) = request.args()?;
            queue(endpoint, &To::Control(id, control)).await
        }
        "apply_ackermann_control_to_vehicle" => {
            let (_, id, control): (Meta, u32, AckermannControl) = request.args()?;
            queue(endpoint, &To::Ackermann(id, control)).await
        }
        "set_vehicle_light_state" => {
            let (_, id, lights): (Meta, u32, LightFlags) = request.args()?;
            queue(endpoint, &To::Lights(id, lights.flags)).await
        }
        "get_vehicle_light_state" => {
            let (_, id): (Meta, u32) = request.args()?;
            Payload::value(&LightFlags { flags: vehicle(endpoint, id)?.lights })
        }
        "get_vehicle_light_states" => {
            let actors = endpoint.episode()?.frame.actors.iter();
            let vehicles = actors.filter(|actor| actor.kind == ActorKind::Vehicle);
            let lights: Vec<(u32, u32)> =
                vehicles.map(|vehicle| (vehicle.id.get(), vehicle.lights)).collect();
            Payload::value(&lights)
        }
        "open_vehicle_door" | "close_vehicle_door" => {
            let (_, id, door): (Meta, u32, u8) = request.args()?;
            let open = request.method == "open_vehicle_door";
            let actor = orders::actor(id)?;
            endpoint.queue(Command::SetDoors { actor, doors: doors(door), open }).await?;
            Ok(Payload::Void)
        }
        "get_wheel_steer_angle" | "get_wheel_pitch_angle" => {
            let (_, id, wheel): (Meta, u32, u8) = request.args()?;
            let angles = wheel_angles(endpoint, id, wheel)?;
            let is_steer = request.method == "get_wheel_steer_angle";
            Payload::value(&if is_steer { angles.0 } else { angles.1 })
        }
        "set_wheel_steer_direction" | "set_wheel_pitch_angle" => hold_wheel(endpoint, request),
        "get_vehicle_bone_world_transforms" => {
            let (_, id): (Meta, u32) = request.args()?;
            vehicle(endpoint, id)?;
            parts::answer(endpoint, request)
        }
        // Without effect, and nobody waits: the compatibility page says so.
        "show_vehicle_debug_telemetry"
        | "set_actor_autopilot"
        | "enable_carsim"
        | "use_carsim_road"
        | "enable_chrono_physics"
        | "restore_physx_physics" => {
            tracing::warn!(method = request.method, "this call has no effect");
            Ok(Payload::Void)
        }
        _ => inside(endpoint, request).await,
    }
}

/// Steering and pitch of a wheel in degrees: as a client holds it, or as it is driven.
fn wheel_angles(endpoint: &mut Endpoint, id: u32, wheel: u8) -> Result<(f32, f32), Refusal> {
    let mean_rad = vehicle(endpoint, id)?.road_wheel_rad;
    let episode = endpoint.episode()?;
    let held = episode.wheel_angles(id, wheel);
    let type_id = episode.state(id).map_or("", |state| episode.frame.type_of(state));
    let driven_rad = parts::model(type_id)
        .map_or(0.0, |model| parts::wheel_rad(model, usize::from(wheel), mean_rad));
    Ok((held.steer.unwrap_or_else(|| -driven_rad.to_degrees()), held.pitch))
}

fn hold_wheel(endpoint: &mut Endpoint, request: &Request) -> Answer {
    /// Of one vehicle, far more than any has.
    const WHEELS_MAX: u8 = 16;
    let (_, id, wheel, degrees): (Meta, u32, u8, f32) = request.args()?;
    vehicle(endpoint, id)?;
    if wheel >= WHEELS_MAX || !degrees.is_finite() {
        return Err(Refusal(format!("no vehicle holds wheel {wheel} at {degrees} degrees")));
    }
    match endpoint.episode()?.wheel_angles_mut(id, wheel) {
        Some(angles) if request.method == "set_wheel_steer_direction" => {
            angles.steer = Some(degrees);
        }
        Some(angles) => angles.pitch = degrees,
        None => tracing::warn!(vehicle = id, "wheels are held only without physics"),
    }
    Ok(Payload::Void)
}

/// What makes a vehicle drive as it does.
async fn inside(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "get_physics_control" => {
            let (_, id): (Meta, u32) = request.args()?;
            let report = endpoint.inspect(id).await?;
            let pose = vehicle(endpoint, id)?.world_from_actor;
            Payload::value(&VehiclePhysicsControl::of(&report.physics, &pose))
        }
        "apply_physics_control" => {
            let (_, id, control): (Meta, u32, VehiclePhysicsControl) = request.args()?;
            let command = physics_command(endpoint, id, &control).await?;
            endpoint.queue(command).await?;
            Ok(Payload::Void)
        }
        "get_telemetry_data" => {
            let (_, id): (Meta, u32) = request.args()?;
            Payload::value(&TelemetryData::of(&endpoint.inspect(id).await?.telemetry))
        }
        "get_ackermann_controller_settings" => {
            let (_, id): (Meta, u32) = request.args()?;
            Payload::value(&AckermannSettings::of(&endpoint.inspect(id).await?.gains))
        }
        "apply_ackermann_controller_settings" => {
            let (_, id, settings): (Meta, u32, AckermannSettings) = request.args()?;
            let actor = orders::actor(id)?;
            endpoint.queue(Command::SetAckermannGains { actor, gains: settings.ours() }).await?;
            Ok(Payload::Void)
        }
        _ => astray(request),
    }
}

/// The command for a change of physics, which needs to know what stays.
///
/// # Errors
/// No such vehicle, or another number of wheels.
pub(super) async fn physics_command(
    endpoint: &mut Endpoint,
    id: u32,
    control: &VehiclePhysicsControl,
) -> Result<Command, Refusal> {
    vehicle(endpoint, id)?;
    let now = endpoint.inspect(id).await?.physics;
    let wanted = counted_wheels(now.wheels.len());
    if control.wheel_count() != wanted {
        return Err(Refusal(format!(
            "a vehicle keeps its number of wheels: wanted {wanted}, found {}",
            control.wheel_count()
        )));
    }
    Ok(Command::SetVehiclePhysics {
        actor: orders::actor(id)?,
        physics: Box::new(control.ours(&now)),
    })
}

fn vehicle(endpoint: &mut Endpoint, id: u32) -> Result<&ActorState, Refusal> {
    let state = endpoint.episode()?.state(id).ok_or_else(|| unknown_actor(id))?;
    if state.kind == ActorKind::Vehicle {
        return Ok(state);
    }
    Err(wrong_kind(id))
}

/// Bits of CARLA's number of a door.
fn doors(door: u8) -> u8 {
    match door {
        0..=5 => 1 << door,
        _ => 0b11_1111,
    }
}
