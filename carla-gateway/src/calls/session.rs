//! Server, episode, clock, Traffic Managers.

use serde_bytes::ByteBuf;

use super::astray;
use crate::dialect::{EpisodeSettings, OpendriveParameters, Opt, Token};
use crate::endpoint::Endpoint;
use crate::maps;
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};
use crate::stream::{WORLD_OBSERVER, token};

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "get_episode_info" => {
            let token = token_of(WORLD_OBSERVER, endpoint);
            Payload::value(&(endpoint.episodes_begun, token))
        }
        "get_sensor_token" => {
            let (_, stream): (Meta, u32) = request.args()?;
            endpoint.expect_listener(stream);
            Payload::value(&token_of(stream, endpoint))
        }
        "set_episode_settings" => {
            let (_, settings): (Meta, EpisodeSettings) = request.args()?;
            change_settings(endpoint, settings)?;
            endpoint.expect_step();
            Payload::value(&endpoint.frame_number)
        }
        "tick_cue" => {
            endpoint.episode()?;
            Payload::value(&(endpoint.frame_number + 1))
        }
        "load_new_episode" => {
            let (_, name, reset, layers): (Meta, String, bool, u16) = request.args()?;
            endpoint.load(&name, layers).await?;
            if reset {
                endpoint.reset_settings();
            }
            Ok(Payload::Void)
        }
        "copy_opendrive_to_file" => {
            let (_, text, _): (Meta, String, OpendriveParameters) = request.args()?;
            endpoint.upload(text).await?;
            Ok(Payload::Void)
        }
        "get_available_maps" => {
            let maps = endpoint.maps.list().await.map_err(|error| Refusal(error.to_string()))?;
            let ours = maps.iter().filter(|map| map.name != endpoint.upload_name());
            let names: Vec<String> = ours.map(|map| maps::listed_name(&map.name)).collect();
            Payload::value(&names)
        }
        _ => traffic_managers(endpoint, request),
    }
}

fn token_of(stream: u32, endpoint: &Endpoint) -> Token {
    Token { data: ByteBuf::from(token(stream, endpoint.stream_port())) }
}

/// Takes over settings; a step of 0 means a variable one, as in CARLA.
fn change_settings(endpoint: &mut Endpoint, settings: EpisodeSettings) -> Result<(), Refusal> {
    /// Longer steps are no simulation any more.
    const DELTA_SECS_MAX: f64 = 10.0;
    let fixed = settings.fixed_delta_seconds.0.filter(|delta| *delta != 0.0);
    if fixed.is_some_and(|delta| !(delta > 0.0 && delta <= DELTA_SECS_MAX)) {
        return Err(Refusal(format!(
            "fixed_delta_seconds must be 0 to {DELTA_SECS_MAX}, not {:?}",
            fixed.unwrap_or_default()
        )));
    }
    endpoint.settle(EpisodeSettings { fixed_delta_seconds: Opt(fixed), ..settings });
    Ok(())
}

fn traffic_managers(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "is_traffic_manager_running" => {
            let (_, port): (Meta, u16) = request.args()?;
            let is_running = endpoint.traffic_managers.host(port).is_some();
            if !is_running && endpoint.is_caller_here() {
                // The client starts its own next.
                endpoint.site.announce_traffic_manager(port);
            }
            Payload::value(&is_running)
        }
        "get_traffic_manager_running" => {
            let (_, port): (Meta, u16) = request.args()?;
            match endpoint.traffic_managers.host(port) {
                Some(host) => Payload::value(&(host, port)),
                None => Payload::value(&("", 0u16)),
            }
        }
        "add_traffic_manager_running" => {
            let (_, (host, port)): (Meta, (String, u16)) = request.args()?;
            let owner = endpoint.caller();
            let managers = &mut endpoint.traffic_managers;
            Payload::value(&owner.is_some_and(|owner| managers.add(port, host, owner)))
        }
        "destroy_traffic_manager" => {
            let (_, port): (Meta, u16) = request.args()?;
            Payload::value(&endpoint.traffic_managers.remove(port))
        }
        _ => astray(request),
    }
}
