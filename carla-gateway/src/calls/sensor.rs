//! Calls about sensors beyond their streams.

use schemas::limits::IGNORED_VEHICLES_MAX;
use schemas::{ActorId, Command};
use serde_bytes::ByteBuf;

use super::astray;
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};
use crate::stream::token;

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "enable_gbuffers" => {
            let (_, camera, on): (Meta, u32, bool) = request.args()?;
            let episode = endpoint.episode()?;
            episode.actor(camera).ok_or_else(|| unknown_actor(camera))?;
            episode.set_textured(camera, on);
            Ok(Payload::Void)
        }
        "are_gbuffers_enabled" => {
            let (_, camera): (Meta, u32) = request.args()?;
            Payload::value(&endpoint.episode()?.is_textured(camera))
        }
        "get_gbuffer_token" => {
            let (_, camera, number): (Meta, u32, u32) = request.args()?;
            let stream = endpoint.open_texture(camera, number)?;
            Payload::value(&ByteBuf::from(token(stream, endpoint.stream_port())))
        }
        "set_ignored_vehicles" => {
            let (_, sensor, vehicles): (Meta, u32, Vec<u32>) = request.args()?;
            endpoint.ignore_vehicles(sensor, &vehicles).await?;
            Ok(Payload::Void)
        }
        "is_sensor_enabled_for_ros" => Payload::value(&false),
        "send" => {
            let (_, sensor, text): (Meta, u32, String) = request.args()?;
            endpoint.episode()?.actor(sensor).ok_or_else(|| unknown_actor(sensor))?;
            let sensor = ActorId::new(sensor).ok_or_else(|| unknown_actor(sensor))?;
            endpoint.queue(Command::SendV2x { sensor, text }).await?;
            Ok(Payload::Void)
        }
        // Without effect, and nobody waits: the compatibility page says so.
        "disable_sensor_for_ros" | "enable_sensor_for_ros" => {
            tracing::warn!(method = request.method, "this call has no effect");
            Ok(Payload::Void)
        }
        _ => astray(request),
    }
}

impl Endpoint {
    /// The sensor sees through these vehicles from the next frame on.
    async fn ignore_vehicles(&mut self, sensor: u32, vehicles: &[u32]) -> Result<(), Refusal> {
        let id_of = |id: u32| ActorId::new(id).ok_or_else(|| unknown_actor(id));
        let vehicles: Vec<ActorId> =
            vehicles.iter().copied().map(id_of).collect::<Result<_, _>>()?;
        if vehicles.len() > IGNORED_VEHICLES_MAX {
            let found = vehicles.len();
            return Err(Refusal(format!(
                "a sensor ignores at most {IGNORED_VEHICLES_MAX} vehicles, not {found}"
            )));
        }
        let command =
            Command::IgnoreVehicles { sensor: id_of(sensor)?, vehicles: vehicles.clone() };
        if let Some(Err(error)) = self.run_now(vec![command]).await?.pop() {
            return Err(Refusal(error.to_string()));
        }
        self.episode()?.set_ignored(sensor, vehicles);
        Ok(())
    }

    /// The stream of a texture of a camera, opened at the first call. A client asks once more
    /// before it leaves, so that only one that nobody has is expected to get a listener.
    fn open_texture(&mut self, camera: u32, number: u32) -> Result<u32, Refusal> {
        let next = self.streams_opened() + 1;
        let stream = self.episode()?.texture_stream(camera, number, next).ok_or_else(|| {
            Refusal(format!("actor {camera} has no texture {number}: wanted a camera and 0 to 12"))
        })?;
        self.open_stream(stream);
        if self.hub.listener_count(stream) == 0 {
            self.expect_listener(stream);
        }
        Ok(stream)
    }
}
