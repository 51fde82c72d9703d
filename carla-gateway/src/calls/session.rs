//! Server, episode, clock.

use serde_bytes::ByteBuf;

use crate::dialect::{EpisodeSettings, OpendriveParameters, Opt, Token};
use crate::endpoint::Endpoint;
use crate::maps;
use crate::rpc::Refusal;
use crate::stream::{StreamId, WORLD_OBSERVER, token};

/// What a call gives.
type Told<T> = Result<T, Refusal>;

/// Number of the episode and where its snapshots come.
pub(super) fn episode_info(endpoint: &mut Endpoint) -> Told<(u64, Token)> {
    Ok((endpoint.episodes_begun, token_of(WORLD_OBSERVER, endpoint)))
}

/// The client listens next.
pub(super) fn sensor_token(endpoint: &mut Endpoint, stream: StreamId) -> Told<Token> {
    endpoint.expect_listener(stream);
    Ok(token_of(stream, endpoint))
}

fn token_of(stream: StreamId, endpoint: &Endpoint) -> Token {
    Token { data: ByteBuf::from(token(stream, endpoint.stream_port)) }
}

/// Takes over settings; a step of 0 means a variable one, as in CARLA. Gives the present frame.
pub(super) async fn set_settings(endpoint: &mut Endpoint, settings: EpisodeSettings) -> Told<u64> {
    /// Longer steps are no simulation any more.
    const DELTA_SECS_MAX: f64 = 10.0;
    let fixed = settings.fixed_delta_seconds.0.filter(|delta| *delta != 0.0);
    if fixed.is_some_and(|delta| !(delta > 0.0 && delta <= DELTA_SECS_MAX)) {
        return Err(Refusal(format!(
            "fixed_delta_seconds must be 0 to {DELTA_SECS_MAX}, not {:?}",
            fixed.unwrap_or_default()
        )));
    }
    endpoint.check_step(fixed)?;
    // Nobody is active where no tiles are, as in CARLA.
    let tile_stream_distance = settings.tile_stream_distance.max(settings.actor_active_distance);
    let fixed_delta_seconds = Opt(fixed);
    endpoint.settle(EpisodeSettings { fixed_delta_seconds, tile_stream_distance, ..settings });
    if fixed.is_some() {
        endpoint.begin_trial().await;
    }
    endpoint.expect_step();
    Ok(endpoint.frame_number)
}

/// Of a tick in asynchronous mode, which comes by itself.
pub(super) fn next_frame(endpoint: &mut Endpoint) -> Told<u64> {
    endpoint.episode()?;
    Ok(endpoint.frame_number + 1)
}

pub(super) async fn load(
    endpoint: &mut Endpoint,
    name: String,
    resets_settings: bool,
    layers: u16,
) -> Told<()> {
    endpoint.load(&name, layers).await?;
    if resets_settings {
        endpoint.reset_settings();
    }
    Ok(())
}

pub(super) async fn upload(
    endpoint: &mut Endpoint,
    text: String,
    _: OpendriveParameters,
) -> Told<()> {
    endpoint.upload(text).await
}

pub(super) async fn maps(endpoint: &mut Endpoint) -> Told<Vec<String>> {
    let maps = endpoint.maps.list().await.map_err(|error| Refusal(error.to_string()))?;
    let ours = maps.iter().filter(|map| map.name != endpoint.upload_name());
    Ok(ours.map(|map| maps::listed_name(&map.name)).collect())
}
