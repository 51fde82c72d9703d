//! Calls about any actor.

use std::sync::Arc;

use schemas::{ActorId, Attachment, AttachmentKind, BodyCommand, BodySwitch, Command};
use schemas::{Error, ErrorCode, Vec3};
use serde::Deserialize;

use super::{orders, parts};
use crate::allowance::Room;
use crate::catalogue;
use crate::dialect::{Actor, ActorDescription, ActorRef, BoundingBox, Transform, Vector3D};
use crate::endpoint::{Endpoint, check_camera};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

/// An actor of its own.
pub(super) async fn spawn(
    endpoint: &mut Endpoint,
    description: ActorDescription,
    transform: Transform,
) -> Result<Actor, Refusal> {
    spawn_at(endpoint, &description, &transform, None).await
}

/// The arguments for an actor that hangs on another.
#[derive(Deserialize)]
pub(super) struct SpawnOn {
    #[expect(dead_code, reason = "read before the arguments")]
    meta: Meta,
    description: ActorDescription,
    transform: Transform,
    parent: ActorRef,
    attachment: u8,
    /// Clients of 0.10 name none.
    #[serde(default)]
    socket: String,
}

/// An actor that hangs on another.
pub(super) async fn spawn_on(endpoint: &mut Endpoint, wanted: SpawnOn) -> Result<Actor, Refusal> {
    let SpawnOn { description, transform, parent, attachment, socket, .. } = wanted;
    let attachment =
        Attachment { parent: self::parent(parent)?, kind: attachment_kind(attachment) };
    let at = parts::on_socket(endpoint.episode()?, attachment.parent, &socket, &transform);
    spawn_at(endpoint, &description, &at, Some(attachment)).await
}

/// What an actor is called: CARLA's names of objects and classes are those of its own files.
pub(super) fn name(endpoint: &mut Endpoint, id: ActorRef) -> Result<String, Refusal> {
    Ok(format!("{}_{id}", class_name(endpoint, id)?))
}

/// What an actor is made from.
pub(super) fn class_name(endpoint: &mut Endpoint, id: ActorRef) -> Result<String, Refusal> {
    let episode = endpoint.episode()?;
    let known = id.id().and_then(|id| episode.actor(id));
    known.map(|actor| actor.description.type_id.clone()).ok_or_else(|| id.unknown())
}

pub(super) fn bounding_box(endpoint: &mut Endpoint, id: ActorRef) -> Result<BoundingBox, Refusal> {
    let episode = endpoint.episode()?;
    let known = id.id().and_then(|id| episode.actor(id));
    Ok(known.map(|actor| actor.bounding_box).unwrap_or_default())
}

/// In a world that is gone.
pub(super) fn no_box(_: &Request, _: Refusal) -> Answer {
    Payload::value(&BoundingBox::default())
}

/// How an actor hangs on its parent; what CARLA does not know is rigid.
fn attachment_kind(kind: u8) -> AttachmentKind {
    match kind {
        1 => AttachmentKind::SpringArm,
        2 => AttachmentKind::SpringArmGhost,
        _ => AttachmentKind::Rigid,
    }
}

/// The command that spawns what a client describes, in the room that its tenant has.
///
/// # Errors
/// What of it cannot be.
pub(super) fn spawn_command(
    endpoint: &mut Endpoint,
    description: &ActorDescription,
    transform: &Transform,
    attachment: Option<Attachment>,
    room: &mut Room,
) -> Result<Command, Refusal> {
    let (blueprint, attributes) = catalogue::order(description)?;
    room.take(&blueprint.id)?;
    if blueprint.id.starts_with("sensor.camera.") {
        let actor = Actor { description: description.clone(), ..Actor::default() };
        check_camera(&actor)?;
    }
    let command = Command::SpawnActor {
        blueprint: blueprint.id.clone(),
        reference_from_actor: transform.ours(),
        linear_velocity_mps: Vec3::zeros(),
        attributes,
        attachment,
        id: None,
    };
    orders::check(endpoint, command)
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

async fn spawn_at(
    endpoint: &mut Endpoint,
    description: &ActorDescription,
    transform: &Transform,
    attachment: Option<Attachment>,
) -> Result<Actor, Refusal> {
    let mut room = endpoint.room()?;
    let command = spawn_command(endpoint, description, transform, attachment, &mut room)?;
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
    endpoint.fit_cars(&[id]).await?;
    endpoint.answer_with_next_frame();
    endpoint.episode()?.actor(id).cloned().ok_or_else(unknown)
}

/// # Errors
/// For 0, which nobody has.
pub(super) fn parent(id: ActorRef) -> Result<ActorId, Refusal> {
    id.id().ok_or_else(no_parent)
}

fn no_parent() -> Refusal {
    Refusal("unable to attach actor: parent actor not found".to_owned())
}

pub(super) fn not_found() -> Refusal {
    Refusal("unable to destroy actor: not found".to_owned())
}

/// Whether there was such an actor.
pub(super) async fn destroy(endpoint: &mut Endpoint, id: ActorRef) -> Result<bool, Refusal> {
    let actor = id.id().ok_or_else(not_found)?;
    let reply = endpoint.run_now(vec![Command::DestroyActor { actor }]).await?.pop();
    match reply {
        Some(Ok(_)) => {
            endpoint.answer_after_managers_step(actor);
            endpoint.forget(actor);
            Ok(true)
        }
        Some(Err(error)) if error.code == ErrorCode::UnknownActor => Err(not_found()),
        Some(Err(error)) => Err(Refusal(format!("unable to destroy actor: {error}"))),
        None => Err(not_found()),
    }
}

/// Waits for the outcome.
pub(super) async fn switch_physics(
    endpoint: &mut Endpoint,
    id: ActorRef,
    on: bool,
) -> Result<(), Refusal> {
    let actor = id.named()?;
    endpoint.episode()?.note_physics(actor, on);
    switch(endpoint, actor, BodySwitch::Physics, on).await
}

/// A Traffic Manager makes this call for cars that are gone.
pub(super) fn physics_refused(_: &Request, refusal: Refusal) -> Answer {
    tracing::debug!(%refusal, "set_actor_simulate_physics had no effect");
    Ok(Payload::Void)
}

/// Waits for the outcome. Sensors, lights and signs, which nothing runs into, have none, as in
/// CARLA.
pub(super) async fn switch_collisions(
    endpoint: &mut Endpoint,
    id: ActorRef,
    on: bool,
) -> Result<(), Refusal> {
    let actor = id.named()?;
    let known = endpoint.episode()?.actor(actor);
    if known.is_some_and(|actor| !has_body(&actor.description.type_id)) {
        return Ok(());
    }
    if !on {
        check_ground(endpoint, actor).await?;
    }
    switch(endpoint, actor, BodySwitch::Collisions, on).await
}

/// Whether others run into actors of this blueprint.
fn has_body(type_id: &str) -> bool {
    ["vehicle.", "walker.", "static."].iter().any(|kind| type_id.starts_with(kind))
}

async fn switch(
    endpoint: &mut Endpoint,
    actor: ActorId,
    switch: BodySwitch,
    on: bool,
) -> Result<(), Refusal> {
    let command = Command::Body(BodyCommand::SetSwitch { actor, switch, on });
    match endpoint.run_now(vec![command]).await?.pop() {
        Some(Err(error)) => Err(orders::refusal(&error, actor.into())),
        _ => Ok(()),
    }
}

/// A controller that starts switches the collisions of its walker off. Sent anywhere, it ends the
/// client's process when it finds no ground to walk on where the walker stands.
async fn check_ground(endpoint: &mut Endpoint, id: ActorId) -> Result<(), Refusal> {
    let episode = endpoint.episode()?;
    let Some(walker) = episode.state(id).filter(|_| episode.is_steered(id)) else { return Ok(()) };
    let place = walker.world_from_actor.translation.vector;
    let navigation = Arc::clone(&episode.navigation);
    match navigation.file().await {
        Some(file) if !file.has_ground_at([0, 1, 2].map(|axis| f64::from(place[axis]))) => {
            Err(Refusal(format!(
                "walker {} stands more than 12 m away from all sidewalks, crossings and roads: nobody \
             can find a way from there",
                id.get()
            )))
        }
        _ => Ok(()),
    }
}

/// Holds a velocity in the actor's frame.
pub(super) async fn hold_velocity(
    endpoint: &mut Endpoint,
    id: ActorRef,
    velocity: Vector3D,
) -> Result<(), Refusal> {
    let (actor, velocity_mps) = (id.named()?, Some(velocity.ours()));
    let command = BodyCommand::SetConstantVelocity { actor, velocity_mps };
    endpoint.queue(Command::Body(command)).await
}

/// Lets go of it.
pub(super) async fn let_go(endpoint: &mut Endpoint, id: ActorRef) -> Result<(), Refusal> {
    let actor = id.named()?;
    let command = BodyCommand::SetConstantVelocity { actor, velocity_mps: None };
    endpoint.queue(Command::Body(command)).await
}
