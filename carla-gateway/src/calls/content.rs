//! Blueprints, spectator, actors, weather, drawing.

use std::sync::Arc;

use schemas::{ActorId, Command};

use super::{astray, debug, lamps};
use crate::catalogue;
use crate::dialect::{Actor, WeatherParameters};
use crate::endpoint::Endpoint;
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "get_actor_definitions" => Payload::value(catalogue::definitions()),
        "get_spectator" => {
            let episode = endpoint.episode()?;
            let spectator = episode.spectator.and_then(|id| episode.actor(id.get()));
            match spectator {
                Some(actor) => Payload::value(actor),
                None => Err(Refusal("this world has no spectator".to_owned())),
            }
        }
        "get_actors_by_id" => {
            let (_, ids): (Meta, Vec<u32>) = request.args()?;
            Payload::value(&actors(endpoint, &ids).await?)
        }
        "get_weather_parameters" => Payload::value(&endpoint.weather),
        "set_weather_parameters" => {
            let (_, weather): (Meta, WeatherParameters) = request.args()?;
            endpoint.weather = weather;
            endpoint.switch_lights();
            endpoint.queue(Command::SetWeather { weather: weather.ours() }).await?;
            Ok(Payload::Void)
        }
        "get_imui_gravity" => Payload::value(&endpoint.imui_gravity_mps2),
        "set_imui_gravity" => {
            let (_, gravity_mps2): (Meta, f32) = request.args()?;
            if !gravity_mps2.is_finite() {
                return Err(Refusal("gravity is a finite number".to_owned()));
            }
            endpoint.imui_gravity_mps2 = gravity_mps2;
            Ok(Payload::Void)
        }
        "draw_debug_shape" => debug::draw(endpoint, request),
        "clear_debug_shape" => {
            endpoint.shapes = Arc::default();
            Ok(Payload::Void)
        }
        "query_lights_state" | "update_lights_state" | "update_day_night_cycle" => {
            lamps::answer(endpoint, request)
        }
        // Without effect, and nobody waits: the compatibility page says so.
        "set_annotations_traverse_translucency" | "clear_debug_string" => Ok(Payload::Void),
        _ => astray(request),
    }
}

/// The known actors of those asked for.
async fn actors(endpoint: &mut Endpoint, ids: &[u32]) -> Result<Vec<Actor>, Refusal> {
    let episode = endpoint.episode()?;
    let is_unknown = |id: &&u32| episode.actor(**id).is_none() && episode.state(**id).is_some();
    let any_unknown = ids.iter().any(|id| is_unknown(&id));
    let strangers: Vec<ActorId> = if any_unknown { episode.strangers() } else { Vec::new() };
    if !strangers.is_empty() {
        endpoint.learn(strangers).await?;
    }
    let episode = endpoint.episode()?;
    Ok(ids.iter().filter_map(|id| episode.actor(*id)).cloned().collect())
}
