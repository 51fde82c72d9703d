//! Calls about sensors beyond their streams.

use schemas::limits::IGNORED_VEHICLES_MAX;
use schemas::{ActorId, Command, SensorCommand};
use serde_bytes::ByteBuf;

use crate::dialect::ActorRef;
use crate::endpoint::Endpoint;
use crate::pictures::TextureId;
use crate::rpc::Refusal;
use crate::stream::{StreamId, token};

pub(super) fn enable_textures(
    endpoint: &mut Endpoint,
    camera: ActorRef,
    on: bool,
) -> Result<(), Refusal> {
    let episode = endpoint.episode()?;
    let camera = episode.known(camera)?;
    episode.set_textured(camera, on);
    Ok(())
}

pub(super) fn are_textures_enabled(
    endpoint: &mut Endpoint,
    camera: ActorRef,
) -> Result<bool, Refusal> {
    let episode = endpoint.episode()?;
    Ok(camera.id().is_some_and(|camera| episode.is_textured(camera)))
}

/// The stream of a texture of a camera, opened at the first call. A client asks once more before it
/// leaves, so that only one that nobody has is expected to get a listener.
pub(super) fn texture_token(
    endpoint: &mut Endpoint,
    camera: ActorRef,
    texture: TextureId,
) -> Result<ByteBuf, Refusal> {
    let next = endpoint.next_stream();
    let episode = endpoint.episode()?;
    let stream = camera.id().and_then(|camera| episode.texture_stream(camera, texture, next));
    let stream = stream.ok_or_else(|| {
        Refusal(format!("actor {camera} has no texture {texture}: wanted a camera and 0 to 12"))
    })?;
    endpoint.open_stream(stream);
    if endpoint.hub.listener_count(stream) == 0 {
        endpoint.expect_listener(stream);
    }
    Ok(ByteBuf::from(token(stream, endpoint.stream_port)))
}

/// The sensor sees through these vehicles from the next frame on.
pub(super) async fn ignore_vehicles(
    endpoint: &mut Endpoint,
    id: ActorRef,
    vehicles: Vec<ActorRef>,
) -> Result<(), Refusal> {
    let vehicles: Vec<ActorId> =
        vehicles.into_iter().map(ActorRef::named).collect::<Result<_, _>>()?;
    if vehicles.len() > IGNORED_VEHICLES_MAX {
        let found = vehicles.len();
        return Err(Refusal(format!(
            "a sensor ignores at most {IGNORED_VEHICLES_MAX} vehicles, not {found}"
        )));
    }
    let sensor = id.named()?;
    let command = SensorCommand::IgnoreVehicles { sensor, vehicles: vehicles.clone() };
    if let Some(Err(error)) = endpoint.run_now(vec![Command::Sensor(command)]).await?.pop() {
        return Err(Refusal(error.to_string()));
    }
    endpoint.episode()?.set_ignored(sensor, vehicles);
    Ok(())
}

pub(super) fn is_for_ros(_: &mut Endpoint, _stream: StreamId) -> Result<bool, Refusal> {
    Ok(false)
}

/// Gives a V2X sensor a text for the next tick.
pub(super) async fn send(
    endpoint: &mut Endpoint,
    id: ActorRef,
    text: String,
) -> Result<(), Refusal> {
    let sensor = endpoint.episode()?.known(id)?;
    endpoint.queue(Command::Sensor(SensorCommand::SendV2x { sensor, text })).await
}
