//! CARLA's commands as commands of ours.

use schemas::{ActorId, ActorKind, BodySwitch, Command, Error, ErrorCode, Pose, PushKind, Vec3};

use super::wrong_kind;
use crate::dialect::{BatchCommand as From, Vector3D, spin_from_deg, twist_from_deg};
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Payload, Refusal};
use crate::snapshot::colour_of;

/// The command of ours for one of a client's; `None` for those without effect here. What it changes
/// is noted in the newest frame, so that the same client reads what it wrote.
///
/// # Errors
/// What cannot be; spawning and destroying have their own ways.
pub(super) fn command(endpoint: &mut Endpoint, command: &From) -> Result<Option<Command>, Refusal> {
    check_kind(endpoint, command)?;
    let order = match command {
        From::Control(id, control) => {
            Command::SetControl { actor: actor(*id)?, control: control.ours() }
        }
        From::Ackermann(id, control) => {
            Command::SetAckermann { actor: actor(*id)?, control: control.ours() }
        }
        From::WalkerControl(id, control) => {
            Command::SetWalkerControl { actor: actor(*id)?, control: control.ours() }
        }
        From::Transform(..)
        | From::Location(..)
        | From::WalkerState(..)
        | From::TargetVelocity(..)
        | From::TargetAngularVelocity(..)
        | From::Impulse(..)
        | From::Force(..)
        | From::AngularImpulse(..)
        | From::Torque(..) => motion(endpoint, command)?,
        From::SimulatePhysics(id, on) => {
            endpoint.episode()?.note_physics(*id, *on);
            Command::SetSwitch { actor: actor(*id)?, switch: BodySwitch::Physics, on: *on }
        }
        From::EnableGravity(id, on) => {
            Command::SetSwitch { actor: actor(*id)?, switch: BodySwitch::Gravity, on: *on }
        }
        From::Lights(id, lights) => {
            if let Some(state) = endpoint.episode()?.state_mut(*id) {
                state.lights = *lights;
            }
            Command::SetVehicleLights { actor: actor(*id)?, lights: *lights }
        }
        From::TrafficLight(id, colour) => Command::SetTrafficLight {
            actor: actor(*id)?,
            colour: Some(colour_of(*colour)),
            green_secs: None,
            yellow_secs: None,
            red_secs: None,
        },
        // The autopilot is the client's own Traffic Manager.
        From::Autopilot(..) | From::DebugTelemetry(..) => return Ok(None),
        From::Console(_) => return Err(Refusal("there is no console".to_owned())),
        From::Spawn(_) | From::Destroy(_) | From::Physics(..) => {
            return Err(Refusal("this command cannot wait".to_owned()));
        }
    };
    Ok(Some(order))
}

/// # Errors
/// For what only vehicles or walkers do, of anything else.
fn check_kind(endpoint: &mut Endpoint, command: &From) -> Result<(), Refusal> {
    let (id, wanted) = match command {
        From::Control(id, _)
        | From::Ackermann(id, _)
        | From::Lights(id, _)
        | From::Autopilot(id, _)
        | From::DebugTelemetry(id, _) => (*id, ActorKind::Vehicle),
        From::WalkerControl(id, _) | From::WalkerState(id, ..) => (*id, ActorKind::Walker),
        _ => return Ok(()),
    };
    let found = endpoint.episode()?.state(id).ok_or_else(|| unknown_actor(id))?.kind;
    if found == wanted { Ok(()) } else { Err(wrong_kind(id)) }
}

/// Only for what [`command`] sends here.
fn motion(endpoint: &mut Endpoint, command: &From) -> Result<Command, Refusal> {
    Ok(match command {
        From::Transform(id, transform) => {
            finite(transform.is_finite())?;
            place(endpoint, *id, transform.ours())?
        }
        From::Location(id, location) => {
            let at_m = vector(*location)?;
            let episode = endpoint.episode()?;
            let state = episode.state(*id).ok_or_else(|| unknown_actor(*id))?;
            let carrier = episode.carrier(state);
            let rotation = carrier.rotation.inverse() * state.world_from_actor.rotation;
            place(endpoint, *id, Pose::from_parts(at_m.into(), rotation))?
        }
        From::WalkerState(id, transform, speed) => {
            finite(transform.is_finite() && speed.is_finite())?;
            Command::SetWalkerState {
                actor: actor(*id)?,
                world_from_actor: transform.ours(),
                speed_mps: *speed,
            }
        }
        From::TargetVelocity(id, velocity) => Command::SetVelocity {
            actor: actor(*id)?,
            linear_mps: Some(vector(*velocity)?),
            angular_radps: None,
        },
        From::TargetAngularVelocity(id, velocity) => {
            vector(*velocity)?;
            Command::SetVelocity {
                actor: actor(*id)?,
                linear_mps: None,
                angular_radps: Some(spin_from_deg(*velocity)),
            }
        }
        From::Impulse(id, amount) => push(*id, PushKind::Impulse, vector(*amount)?)?,
        From::Force(id, amount) => push(*id, PushKind::Force, vector(*amount)?)?,
        From::AngularImpulse(id, amount) => push(*id, PushKind::AngularImpulse, twist(*amount)?)?,
        From::Torque(id, amount) => push(*id, PushKind::Torque, twist(*amount)?)?,
        other => unreachable!("{other:?} moves nothing"),
    })
}

/// Puts an actor elsewhere, in the frame of what carries it.
fn place(endpoint: &mut Endpoint, id: u32, pose: Pose) -> Result<Command, Refusal> {
    let episode = endpoint.episode()?;
    let carrier = episode.state(id).map(|state| episode.carrier(state));
    if let Some((state, carrier)) = episode.state_mut(id).zip(carrier) {
        state.world_from_actor = carrier * pose;
    }
    Ok(Command::SetPose { actor: actor(id)?, world_from_actor: pose })
}

/// Queues a command that nobody waits for.
pub(super) async fn queue(endpoint: &mut Endpoint, from: &From) -> Answer {
    if let Some(order) = command(endpoint, from)? {
        endpoint.queue(order).await?;
    }
    Ok(Payload::Void)
}

/// Holds a velocity in the actor's frame, or lets go.
pub(super) async fn hold_velocity(
    endpoint: &mut Endpoint,
    id: u32,
    velocity: Option<Vector3D>,
) -> Answer {
    let velocity_mps = velocity.map(vector).transpose()?;
    endpoint.queue(Command::SetConstantVelocity { actor: actor(id)?, velocity_mps }).await?;
    Ok(Payload::Void)
}

/// What the world refuses to do with an actor, in CARLA's words where CARLA has some.
pub(super) fn refusal(error: &Error, id: u32) -> Refusal {
    match error.code {
        ErrorCode::UnknownActor => unknown_actor(id),
        _ => Refusal(error.to_string()),
    }
}

/// # Errors
/// For 0, which nobody has.
pub(super) fn actor(id: u32) -> Result<ActorId, Refusal> {
    ActorId::new(id).ok_or_else(|| unknown_actor(id))
}

fn push(id: u32, kind: PushKind, amount: Vec3) -> Result<Command, Refusal> {
    Ok(Command::Push { actor: actor(id)?, kind, amount })
}

fn vector(theirs: Vector3D) -> Result<Vec3, Refusal> {
    let ours = theirs.ours();
    finite(ours.iter().all(|number| number.is_finite()))?;
    Ok(ours)
}

fn twist(theirs: Vector3D) -> Result<Vec3, Refusal> {
    vector(theirs)?;
    Ok(twist_from_deg(theirs))
}

fn finite(is_finite: bool) -> Result<(), Refusal> {
    if is_finite { Ok(()) } else { Err(Refusal("numbers must be finite".to_owned())) }
}
