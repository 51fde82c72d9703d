//! Calls about traffic lights.

use roads::Post;
use schemas::{ActorKind, Command, TrafficLightCommand as Change, TrafficLightState};

use crate::dialect::{ActorRef, BoundingBox, Transform, Vector3D};
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;

pub(super) async fn set_green_secs(
    endpoint: &mut Endpoint,
    id: ActorRef,
    secs: f32,
) -> Result<(), Refusal> {
    set_times(endpoint, id, [Some(secs), None, None]).await
}

pub(super) async fn set_yellow_secs(
    endpoint: &mut Endpoint,
    id: ActorRef,
    secs: f32,
) -> Result<(), Refusal> {
    set_times(endpoint, id, [None, Some(secs), None]).await
}

pub(super) async fn set_red_secs(
    endpoint: &mut Endpoint,
    id: ActorRef,
    secs: f32,
) -> Result<(), Refusal> {
    set_times(endpoint, id, [None, None, Some(secs)]).await
}

async fn set_times(
    endpoint: &mut Endpoint,
    id: ActorRef,
    times_secs: [Option<f32>; 3],
) -> Result<(), Refusal> {
    if times_secs.iter().flatten().any(|secs| *secs < 0.0) {
        return Err(Refusal("a light shows a colour for a positive time".to_owned()));
    }
    let [green_secs, yellow_secs, red_secs] = times_secs;
    let actor = id.named()?;
    let change = Change::Set { actor, colour: None, green_secs, yellow_secs, red_secs };
    endpoint.queue(Command::TrafficLight(change)).await
}

pub(super) async fn freeze_all(endpoint: &mut Endpoint, frozen: bool) -> Result<(), Refusal> {
    endpoint.queue(Command::TrafficLight(Change::Freeze { frozen })).await
}

/// One alone cannot be stopped: its group would go on around it.
pub(super) async fn freeze(
    endpoint: &mut Endpoint,
    _id: ActorRef,
    frozen: bool,
) -> Result<(), Refusal> {
    freeze_all(endpoint, frozen).await
}

pub(super) async fn reset_group(endpoint: &mut Endpoint, id: ActorRef) -> Result<(), Refusal> {
    let actor = Some(id.named()?);
    endpoint.queue(Command::TrafficLight(Change::Reset { actor })).await
}

pub(super) async fn reset_all(endpoint: &mut Endpoint) -> Result<(), Refusal> {
    endpoint.queue(Command::TrafficLight(Change::Reset { actor: None })).await?;
    endpoint.flush().await
}

/// The lights that take turns with one, itself included; without those that were destroyed.
pub(super) fn group(endpoint: &mut Endpoint, id: ActorRef) -> Result<Vec<ActorRef>, Refusal> {
    let frame = &endpoint.episode()?.frame;
    let is_there = |light: &&TrafficLightState| frame.actor(light.actor).is_some();
    let lights = || frame.traffic_lights.iter().filter(is_there);
    let own = lights().find(|light| Some(light.actor) == id.id());
    let own = own.ok_or_else(|| no_light(id))?;
    let same = lights().filter(|light| light.group == own.group);
    Ok(same.map(|light| light.actor.into()).collect())
}

/// The housings of the lamps, in the world: the near ones, then those beyond the junction.
pub(super) fn boxes(endpoint: &mut Endpoint, id: ActorRef) -> Result<Vec<BoundingBox>, Refusal> {
    let episode = endpoint.episode()?;
    let state = episode.found(id)?;
    if state.kind != ActorKind::TrafficLight {
        return Err(no_light(id));
    }
    let signal = episode.signal(state.id);
    let landmarks = episode.map.landmarks();
    let position = landmarks.iter().position(|landmark| Some(landmark.id.as_str()) == signal);
    let posts = episode.map.posts().iter().filter(|post| Some(post.landmark) == position);
    Ok(posts.map(|post| box_at_top(post, id)).collect())
}

/// The housing of lamps, or the board, that a post carries, in the world.
pub(super) fn box_at_top(post: &Post, actor_id: ActorRef) -> BoundingBox {
    let Transform { location, rotation } = Transform::of(&post.world_from_carried().cast());
    let extent = Vector3D::size(post.carried_half_m.cast());
    BoundingBox { location, extent, rotation, actor_id }
}

fn no_light(id: ActorRef) -> Refusal {
    Refusal(format!("Actor is not a traffic light.  Actor Id: {id}"))
}
