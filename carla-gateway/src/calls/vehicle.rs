//! Calls about vehicles.

use schemas::{ActorKind, ActorState, Command};

use super::astray;
use super::orders::{self, queue};
use crate::dialect::{
    AckermannControl, AckermannSettings, BatchCommand as To, LightFlags, TelemetryData, Transform,
    VehicleControl, VehiclePhysicsControl,
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
            let steers = wheel < 2 && request.method == "get_wheel_steer_angle";
            let angle_deg = -vehicle(endpoint, id)?.road_wheel_rad.to_degrees();
            Payload::value(&if steers { angle_deg } else { 0.0 })
        }
        "get_vehicle_bone_world_transforms" => {
            let (_, id): (Meta, u32) = request.args()?;
            vehicle(endpoint, id)?;
            Payload::value(&[Transform::default(); 0])
        }
        // Without effect, and nobody waits: the compatibility page says so.
        "show_vehicle_debug_telemetry"
        | "set_actor_autopilot"
        | "set_wheel_steer_direction"
        | "set_wheel_pitch_angle"
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
    let now = endpoint.inspect(id).await?.physics;
    if control.wheel_count() != now.wheels.len() {
        return Err(Refusal(format!(
            "a vehicle keeps its number of wheels: wanted {}, found {}",
            now.wheels.len(),
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
    Err(Refusal(format!("Actor is not a Vehicle. Actor Id: {id}")))
}

/// Bits of CARLA's number of a door.
fn doors(door: u8) -> u8 {
    match door {
        0..=5 => 1 << door,
        _ => 0b11_1111,
    }
}
