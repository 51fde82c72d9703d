//! What every call does. [`METHODS`] names all calls of CARLA's client;
//! `docs/carla-compatibility.md` repeats it, and a test compares the two.

mod actor;
mod batch;
mod content;
mod debug;
mod lamps;
mod lights;
mod map;
mod orders;
mod parts;
mod scenery;
mod sensor;
mod session;
mod table;
mod vehicle;
mod walker;

use crate::dialect::EpisodeSettings;
use crate::endpoint::Endpoint;
use crate::rpc::{Answer, Payload, Refusal, Request};
pub(crate) use lamps::of_map as street_lights;
use table::{Group, METHODS};

/// The client whose protocol this is.
const VERSION: &str = "0.9.16";

/// The call by which clients read the settings.
pub(crate) const READ_OF_SETTINGS: &str = "get_episode_settings";

/// Answers what needs no endpoint, even while it ticks or loads.
///
/// A Traffic Manager reads the settings between two frames, on a thread of its own, and must have
/// them before the next frame comes.
pub(crate) fn at_once(request: &Request, settings: &EpisodeSettings) -> Option<Answer> {
    match request.method.as_str() {
        "version" => Some(Payload::value(VERSION)),
        READ_OF_SETTINGS => Some(Payload::value(settings)),
        _ => None,
    }
}

/// Answers one call.
pub(crate) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    if let Some(answer) = at_once(request, endpoint.settings()) {
        return answer;
    }
    let method = METHODS.iter().find(|method| method.name == request.method);
    let Some(method) = method else {
        return Err(Refusal(format!("this server knows no call {:?}", request.method)));
    };
    if method.needs_world
        && let Err(refusal) = endpoint.ensure_episode().await
    {
        return without_world(request, refusal);
    }
    let answer = match method.group {
        Group::Session => session::answer(endpoint, request).await,
        Group::Map => map::answer(endpoint, request).await,
        Group::Scenery => scenery::answer(endpoint, request).await,
        Group::Content => content::answer(endpoint, request).await,
        Group::Actor => actor::answer(endpoint, request).await,
        Group::Vehicle => vehicle::answer(endpoint, request).await,
        Group::Walker => walker::answer(endpoint, request).await,
        Group::Lights => lights::answer(endpoint, request).await,
        Group::Sensor => sensor::answer(endpoint, request).await,
        Group::Batch => batch::answer(endpoint, request).await,
        Group::Refused => Err(refused(request)),
    };
    match answer {
        Err(refusal) => without_world(request, worded(method, refusal)),
        answer => answer,
    }
}

/// As CARLA words what goes wrong with an actor; spawning and destroying have words of their own.
fn worded(method: &table::Method, refusal: Refusal) -> Refusal {
    let is_about_life = method.name.starts_with("spawn_") || method.name.starts_with("destroy_");
    match method.group {
        Group::Actor | Group::Vehicle | Group::Walker | Group::Lights if !is_about_life => {
            by_function(method.name, &refusal)
        }
        _ => refusal,
    }
}

/// CARLA's words for a function that could not do something.
fn by_function(name: &str, why: &Refusal) -> Refusal {
    Refusal(format!("Responding error from function {name}: {why}"))
}

/// CARLA's words for an actor that is no vehicle, walker or whatever a function is about.
fn wrong_kind(id: u32) -> Refusal {
    Refusal(format!("Actor does not match the expected type.  Actor Id: {id}"))
}

/// A refusal, but for calls whose failure would end the client's process: its Traffic Manager makes
/// them on a thread where nothing catches exceptions.
fn without_world(request: &Request, refusal: Refusal) -> Answer {
    use crate::dialect::{BatchResponse, BoundingBox};
    match request.method.as_str() {
        "get_actor_bounding_box" => Payload::value(&BoundingBox::default()),
        "get_vehicle_light_states" => Payload::value(&[(); 0]),
        "set_actor_simulate_physics" => {
            tracing::debug!(%refusal, "set_actor_simulate_physics had no effect");
            Ok(Payload::Void)
        }
        "apply_batch" => {
            let count = batch::length(request);
            Payload::bare(&vec![BatchResponse(Err(refusal.0)); count])
        }
        _ => Err(refusal),
    }
}

/// Why a call is refused whatever its arguments.
fn refused(request: &Request) -> Refusal {
    let method = METHODS.iter().find(|method| method.name == request.method);
    let why = match method.map(|method| method.state) {
        Some(table::State::Refused(why)) => why,
        _ => "not available",
    };
    Refusal(format!("{}: {why}", request.method))
}

/// For a method that its group's table names and its group does not know; a test keeps it
/// unreachable.
fn astray(request: &Request) -> Answer {
    Err(Refusal(format!("{} has no answer", request.method)))
}

#[cfg(test)]
mod tests;
