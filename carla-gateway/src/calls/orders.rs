//! CARLA's commands as commands of ours.

use schemas::wire::{decode_request, encode_request};
use schemas::{
    ActorKind, BodyCommand as Body, BodySwitch, Command, Error, ErrorCode, Pose, Request,
};
use schemas::{
    PushKind, TrafficLightColour, TrafficLightCommand, Vec3, VehicleCommand as Vehicle,
    WalkerCommand,
};

use crate::dialect::{ActorRef, BatchCommand as From, spin_from_deg, twist_from_deg};
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;
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
            let (actor, control) = (id.named()?, control.ours());
            Command::Vehicle(Vehicle::Control { actor, control })
        }
        From::Ackermann(id, control) => {
            let (actor, control) = (id.named()?, control.ours());
            Command::Vehicle(Vehicle::Ackermann { actor, control })
        }
        From::WalkerControl(id, control) => {
            let (actor, control) = (id.named()?, control.ours());
            Command::Walker(WalkerCommand::Control { actor, control })
        }
        From::WalkerState(id, transform, speed_mps) => {
            let (actor, world_from_actor) = (id.named()?, transform.ours());
            let speed_mps = *speed_mps;
            Command::Walker(WalkerCommand::State { actor, world_from_actor, speed_mps })
        }
        From::Transform(id, transform) => place(endpoint, *id, transform.ours())?,
        From::Location(id, location) => relocate(endpoint, *id, location.ours())?,
        From::TargetVelocity(id, velocity) => velocity_of(*id, Some(velocity.ours()), None)?,
        From::TargetAngularVelocity(id, velocity) => {
            velocity_of(*id, None, Some(spin_from_deg(*velocity)))?
        }
        From::Impulse(id, amount) => push(*id, PushKind::Impulse, amount.ours())?,
        From::Force(id, amount) => push(*id, PushKind::Force, amount.ours())?,
        From::AngularImpulse(id, amount) => {
            push(*id, PushKind::AngularImpulse, twist_from_deg(*amount))?
        }
        From::Torque(id, amount) => push(*id, PushKind::Torque, twist_from_deg(*amount))?,
        From::SimulatePhysics(id, on) => {
            endpoint.episode()?.note_physics(id.named()?, *on);
            switch(*id, BodySwitch::Physics, *on)?
        }
        From::EnableGravity(id, on) => switch(*id, BodySwitch::Gravity, *on)?,
        From::Lights(id, lights) => {
            let (actor, lights) = (id.named()?, *lights);
            if let Some(state) = endpoint.episode()?.state_mut(actor) {
                state.lights = lights;
            }
            Command::Vehicle(Vehicle::Lights { actor, lights })
        }
        From::TrafficLight(id, colour) => show(*id, colour_of(*colour))?,
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
    endpoint.episode()?.found_as(id, wanted).map(drop)
}

/// Puts an actor elsewhere, in the frame of what carries it.
fn place(endpoint: &mut Endpoint, id: ActorRef, pose: Pose) -> Result<Command, Refusal> {
    let actor = id.named()?;
    let episode = endpoint.episode()?;
    let carrier = episode.state(actor).map(|state| episode.carrier(state));
    if let Some((state, carrier)) = episode.state_mut(actor).zip(carrier) {
        state.world_from_actor = carrier * pose;
    }
    Ok(Command::Body(Body::SetPose { actor, reference_from_actor: pose }))
}

/// Puts an actor elsewhere, in the frame of what carries it, as it is turned.
fn relocate(endpoint: &mut Endpoint, id: ActorRef, at_m: Vec3) -> Result<Command, Refusal> {
    let episode = endpoint.episode()?;
    let state = episode.found(id)?;
    let carrier = episode.carrier(state);
    let rotation = carrier.rotation.inverse() * state.world_from_actor.rotation;
    place(endpoint, id, Pose::from_parts(at_m.into(), rotation))
}

fn velocity_of(
    id: ActorRef,
    linear_mps: Option<Vec3>,
    angular_radps: Option<Vec3>,
) -> Result<Command, Refusal> {
    Ok(Command::Body(Body::SetVelocity { actor: id.named()?, linear_mps, angular_radps }))
}

fn switch(id: ActorRef, switch: BodySwitch, on: bool) -> Result<Command, Refusal> {
    Ok(Command::Body(Body::SetSwitch { actor: id.named()?, switch, on }))
}

fn show(id: ActorRef, colour: TrafficLightColour) -> Result<Command, Refusal> {
    Ok(Command::TrafficLight(TrafficLightCommand::Set {
        actor: id.named()?,
        colour: Some(colour),
        green_secs: None,
        yellow_secs: None,
        red_secs: None,
    }))
}

/// Queues a command that nobody waits for.
pub(super) async fn queue(endpoint: &mut Endpoint, from: &From) -> Result<(), Refusal> {
    match command(endpoint, from)? {
        Some(order) => endpoint.queue(order).await,
        None => Ok(()),
    }
}

/// Refuses a command with numbers that the world never takes: a client's may be finite, and too
/// large in our units or axes. For commands whose numbers were multiplied or turned.
pub(super) fn check(endpoint: &mut Endpoint, command: Command) -> Result<Command, Refusal> {
    let world = endpoint.episode()?.world;
    let request = Request::RunCommands { world, commands: vec![command.clone()] };
    decode_request(&encode_request(&request)).map_err(|error| Refusal(error.to_string()))?;
    Ok(command)
}

/// What the world refuses to do with an actor, in CARLA's words where CARLA has some.
pub(super) fn refusal(error: &Error, id: ActorRef) -> Refusal {
    match error.code {
        ErrorCode::UnknownActor => id.unknown(),
        _ => Refusal(error.to_string()),
    }
}

fn push(id: ActorRef, kind: PushKind, amount: Vec3) -> Result<Command, Refusal> {
    Ok(Command::Body(Body::Push { actor: id.named()?, kind, amount }))
}
