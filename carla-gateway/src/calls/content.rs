//! Blueprints, spectator, actors, weather.

use schemas::{ActorId, Command};

use crate::catalogue;
use crate::dialect::{Actor, ActorDefinition, ActorRef, WeatherParameters};
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;

pub(super) fn definitions(endpoint: &mut Endpoint) -> Result<&'static [ActorDefinition], Refusal> {
    Ok(catalogue::definitions(endpoint.config.version))
}

pub(super) fn spectator(endpoint: &mut Endpoint) -> Result<Actor, Refusal> {
    let episode = endpoint.episode()?;
    let spectator = episode.spectator.and_then(|id| episode.actor(id)).cloned();
    spectator.ok_or_else(|| Refusal("this world has no spectator".to_owned()))
}

/// The known actors of those asked for.
pub(super) async fn actors(
    endpoint: &mut Endpoint,
    ids: Vec<ActorRef>,
) -> Result<Vec<Actor>, Refusal> {
    let ids: Vec<ActorId> = ids.into_iter().filter_map(ActorRef::id).collect();
    let episode = endpoint.episode()?;
    let is_unknown = |id: &ActorId| episode.actor(*id).is_none() && episode.state(*id).is_some();
    let any_unknown = ids.iter().any(is_unknown);
    let strangers: Vec<ActorId> = if any_unknown { episode.strangers() } else { Vec::new() };
    if !strangers.is_empty() {
        endpoint.learn(strangers).await?;
    }
    let episode = endpoint.episode()?;
    Ok(ids.iter().filter_map(|id| episode.actor(*id)).cloned().collect())
}

/// Clients of 0.10 can ask.
pub(super) fn has_weather(_: &mut Endpoint) -> Result<bool, Refusal> {
    Ok(true)
}

pub(super) fn weather(endpoint: &mut Endpoint) -> Result<WeatherParameters, Refusal> {
    Ok(endpoint.weather)
}

pub(super) async fn set_weather(
    endpoint: &mut Endpoint,
    weather: WeatherParameters,
) -> Result<(), Refusal> {
    endpoint.weather = weather;
    endpoint.lamps.switch(endpoint.is_night());
    endpoint.queue(Command::SetWeather { weather: weather.ours() }).await
}

pub(super) fn inertial_gravity(endpoint: &mut Endpoint) -> Result<f32, Refusal> {
    Ok(endpoint.imui_gravity_mps2)
}

pub(super) fn set_inertial_gravity(
    endpoint: &mut Endpoint,
    gravity_mps2: f32,
) -> Result<(), Refusal> {
    endpoint.imui_gravity_mps2 = gravity_mps2;
    Ok(())
}
