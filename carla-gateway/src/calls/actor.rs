//! Calls about any actor.

use std::sync::Arc;

use schemas::{ActorId, Attachment, AttachmentKind, Command, Error, ErrorCode, Vec3};

use super::orders::{self, queue};
use super::{astray, parts};
use crate::catalogue;
use crate::dialect::{Actor, ActorDescription, BatchCommand as To, Location, Transform, Vector3D};
use crate::endpoint::{Endpoint, check_camera, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "spawn_actor" => {
            let (_, description, transform): (Meta, ActorDescription, Transform) =
                request.args()?;
            Payload::value(&spawn(endpoint, &description, &transform, None).await?)
        }
        "spawn_actor_with_parent" => {
            let (_, description, transform, parent, kind, socket): (
                Meta,
                ActorDescription,
                Transform,
                u32,
                u8,
                String,
            ) = request.args()?;
            let attachment =
                Attachment { parent: self::parent(parent)?, kind: attachment_kind(kind) };
            let at =
                parts::on_socket(endpoint.episode()?, attachment.parent.get(), &socket, &transform);
            Payload::value(&spawn(endpoint, &description, &at, Some(attachment)).await?)
        }
        "destroy_actor" => {
            let (_, id): (Meta, u32) = request.args()?;
            Payload::value(&destroy(endpoint, id).await?)
        }
        "get_actor_bounding_box" => {
            let (_, id): (Meta, u32) = request.args()?;
            let known = endpoint.episode()?.actor(id);
            Payload::value(&known.map(|actor| actor.bounding_box).unwrap_or_default())
        }
        "set_actor_simulate_physics" | "set_actor_collisions" => switch(endpoint, request).await,
        method if method.starts_with("get_actor_") => parts::answer(endpoint, request),
        _ => change(endpoint, request).await,
    }
}

/// How an actor hangs on its parent; what CARLA does not know is rigid.
fn attachment_kind(kind: u8) -> AttachmentKind {
    match kind {
        1 => AttachmentKind::SpringArm,
        2 => AttachmentKind::SpringArmGhost,
        _ => AttachmentKind::Rigid,
    }
}

/// The command that spawns what a client describes.
///
/// # Errors
/// What of it cannot be.
pub(super) fn spawn_command(
    description: &ActorDescription,
    transform: &Transform,
    attachment: Option<Attachment>,
) -> Result<Command, Refusal> {
    let (blueprint, attributes) = catalogue::order(description)?;
    if !transform.is_finite() {
        return Err(Refusal("Spawn failed because of a transform that is not finite".to_owned()));
    }
    if blueprint.id.starts_with("sensor.camera.") {
        let actor = Actor { description: description.clone(), ..Actor::default() };
        check_camera(&actor)?;
    }
    Ok(Command::SpawnActor {
        blueprint: blueprint.id.clone(),
        world_from_actor: transform.ours(),
        linear_velocity_mps: Vec3::zeros(),
        attributes,
        attachment,
    })
}

/// CARLA's words for a refused spawn.
pub(super) fn spawn_refusal(error: &Error) -> Refusal {
    match error.code {
        ErrorCode::SpawnBlocked => {
            Refusal("Spawn failed because of collision at spawn position".to_owned())
        }
        ErrorCode::UnknownActor => no_parent(),
        _ => Refusal(format!("Spawn failed because of invalid actor description: {error}")),
    }
}

async fn spawn(
    endpoint: &mut Endpoint,
    description: &ActorDescription,
    transform: &Transform,
    attachment: Option<Attachment>,
) -> Result<Actor, Refusal> {
    let command = spawn_command(description, transform, attachment)?;
    if description.type_id.starts_with("sensor.camera.") {
        endpoint.need_renderer().await?;
    }
    let reply = endpoint.run_now(vec![command]).await?.pop();
    let unknown = || Refusal("Unknown error while trying to spawn actor".to_owned());
    let id = match reply {
        Some(Ok(Some(id))) => id,
        Some(Err(error)) => return Err(spawn_refusal(&error)),
        _ => return Err(unknown()),
    };
    endpoint.learn(vec![id]).await?;
    endpoint.fit_tyres(&[id]).await?;
    endpoint.answer_with_next_frame();
    endpoint.episode()?.actor(id.get()).cloned().ok_or_else(unknown)
}

/// # Errors
/// For 0, which nobody has.
pub(super) fn parent(id: u32) -> Result<ActorId, Refusal> {
    ActorId::new(id).ok_or_else(no_parent)
}

fn no_parent() -> Refusal {
    Refusal("unable to attach actor: parent actor not found".to_owned())
}

pub(super) fn not_found() -> Refusal {
    Refusal("unable to destroy actor: not found".to_owned())
}

/// Whether there was such an actor.
pub(super) async fn destroy(endpoint: &mut Endpoint, id: u32) -> Result<bool, Refusal> {
    let actor = ActorId::new(id).ok_or_else(not_found)?;
    let reply = endpoint.run_now(vec![Command::DestroyActor { actor }]).await?.pop();
    match reply {
        Some(Ok(_)) => {
            endpoint.answer_after_managers_step(id);
            endpoint.forget(id);
            Ok(true)
        }
        Some(Err(error)) if error.code == ErrorCode::UnknownActor => Err(not_found()),
        Some(Err(error)) => Err(Refusal(format!("unable to destroy actor: {error}"))),
        None => Err(not_found()),
    }
}

/// Waits for the outcome, as these calls do.
async fn switch(endpoint: &mut Endpoint, request: &Request) -> Answer {
    let (_, id, on): (Meta, u32, bool) = request.args()?;
    let actor = ActorId::new(id).ok_or_else(|| unknown_actor(id))?;
    let switch = match request.method.as_str() {
        "set_actor_collisions" => schemas::BodySwitch::Collisions,
        _ => schemas::BodySwitch::Physics,
    };
    if switch == schemas::BodySwitch::Collisions && !on {
        check_ground(endpoint, id).await?;
    }
    if switch == schemas::BodySwitch::Physics {
        endpoint.episode()?.note_physics(id, on);
    }
    match endpoint.run_now(vec![Command::SetSwitch { actor, switch, on }]).await?.pop() {
        Some(Err(error)) => Err(orders::refusal(&error, id)),
        _ => Ok(Payload::Void),
    }
}

/// A controller that starts switches the collisions of its walker off. Sent anywhere, it ends the
/// client's process when it finds no ground to walk on where the walker stands.
async fn check_ground(endpoint: &mut Endpoint, id: u32) -> Result<(), Refusal> {
    let episode = endpoint.episode()?;
    let Some(walker) = episode.state(id).filter(|_| episode.is_steered(id)) else { return Ok(()) };
    let place = walker.world_from_actor.translation.vector;
    let navigation = Arc::clone(&episode.navigation);
    match navigation.file().await {
        Some(file) if !file.has_ground_at([0, 1, 2].map(|axis| f64::from(place[axis]))) => {
            Err(Refusal(format!(
                "walker {id} stands more than 12 m away from all sidewalks, crossings and roads: nobody \
             can find a way from there"
            )))
        }
        _ => Ok(()),
    }
}

/// Changes that nobody waits for.
async fn change(endpoint: &mut Endpoint, request: &Request) -> Answer {
    let vector = |to: fn(u32, Vector3D) -> To| {
        let args: Result<(Meta, u32, Vector3D), Refusal> = request.args();
        args.map(|(_, id, vector)| to(id, vector))
    };
    let command = match request.method.as_str() {
        "set_actor_location" => {
            let (_, id, location): (Meta, u32, Location) = request.args()?;
            To::Location(id, location)
        }
        "set_actor_transform" => {
            let (_, id, transform): (Meta, u32, Transform) = request.args()?;
            To::Transform(id, transform)
        }
        "set_actor_target_velocity" => vector(To::TargetVelocity)?,
        "set_actor_target_angular_velocity" => vector(To::TargetAngularVelocity)?,
        "add_actor_impulse" => vector(To::Impulse)?,
        "add_actor_force" => vector(To::Force)?,
        "add_actor_angular_impulse" => vector(To::AngularImpulse)?,
        "add_actor_torque" => vector(To::Torque)?,
        "set_actor_enable_gravity" => {
            let (_, id, on): (Meta, u32, bool) = request.args()?;
            To::EnableGravity(id, on)
        }
        "enable_actor_constant_velocity" => {
            let (_, id, velocity): (Meta, u32, Vector3D) = request.args()?;
            return orders::hold_velocity(endpoint, id, Some(velocity)).await;
        }
        "disable_actor_constant_velocity" => {
            let (_, id): (Meta, u32) = request.args()?;
            return orders::hold_velocity(endpoint, id, None).await;
        }
        _ => return astray(request),
    };
    queue(endpoint, &command).await
}
