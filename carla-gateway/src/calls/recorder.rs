//! Calls of the recorder and the replayer. Nobody waits for the answers of some: what goes wrong
//! is logged.

use recording::query::Letter;
use serde::Deserialize;

use crate::dialect::{Location, Rotation, Transform};
use crate::endpoint::Endpoint;
use crate::recorder::Question;
use crate::replayer::Order;
use crate::rpc::{Meta, Refusal};

/// The file that is recorded to.
pub(super) async fn start(
    endpoint: &mut Endpoint,
    name: String,
    has_additional: bool,
) -> Result<String, Refusal> {
    endpoint.stop_replay(false).await?;
    endpoint.end_recording().await;
    let map = endpoint.episode()?.map_name.clone();
    let allowance = endpoint.config.allowance.clone();
    let told = endpoint.recorder.start(&name, &map, has_additional, &allowance).await?;
    endpoint.begin_journal().await;
    Ok(told)
}

pub(super) async fn stop(endpoint: &mut Endpoint) -> Result<(), Refusal> {
    endpoint.record_last_frame().await;
    endpoint.end_recording().await;
    Ok(())
}

pub(super) fn info(endpoint: &mut Endpoint, name: String, is_all: bool) -> Result<(), Refusal> {
    ask(endpoint, &name, Question::Info { is_all })
}

/// The kinds of actors come as the first letters of what the client named them.
pub(super) fn collisions(
    endpoint: &mut Endpoint,
    name: String,
    first: u8,
    second: u8,
) -> Result<(), Refusal> {
    let wanted = [first, second].map(|code| Letter(char::from(code)));
    ask(endpoint, &name, Question::Collisions(wanted))
}

pub(super) fn blocked(
    endpoint: &mut Endpoint,
    name: String,
    min_secs: f64,
    min_cm: f64,
) -> Result<(), Refusal> {
    ask(endpoint, &name, Question::Blocked { min_secs, min_cm })
}

fn ask(endpoint: &mut Endpoint, name: &str, question: Question) -> Result<(), Refusal> {
    let answer = endpoint.recorder.ask(name, question)?;
    endpoint.answer_later(answer);
    Ok(())
}

/// The arguments for a replay.
#[derive(Deserialize)]
pub(super) struct Replay {
    #[expect(dead_code, reason = "read before the arguments")]
    meta: Meta,
    name: String,
    start_secs: f64,
    duration_secs: f64,
    follow_id: u32,
    has_sensors: bool,
    /// Clients of 0.10 name none.
    #[serde(default = "behind_and_above")]
    offset: Transform,
}

/// Where the spectator is to who is followed, as clients of 0.9.16 send it unless told otherwise.
fn behind_and_above() -> Transform {
    Transform {
        location: Location { x: -10.0, y: 0.0, z: 5.0 },
        rotation: Rotation { pitch: -25.0, ..Rotation::default() },
    }
}

pub(super) async fn replay(endpoint: &mut Endpoint, wanted: Replay) -> Result<String, Refusal> {
    let Replay { name, start_secs, duration_secs, follow_id, has_sensors, offset, .. } = wanted;
    let order = Order { name, start_secs, duration_secs, follow_id, has_sensors, offset };
    endpoint.replay(order).await
}

pub(super) async fn stop_replay(
    endpoint: &mut Endpoint,
    keeps_actors: bool,
) -> Result<(), Refusal> {
    endpoint.stop_replay(keeps_actors).await
}

pub(super) fn set_factor(endpoint: &mut Endpoint, factor: f64) -> Result<(), Refusal> {
    endpoint.replayer.set_factor(factor);
    Ok(())
}

pub(super) fn set_ignores_hero(endpoint: &mut Endpoint, ignores: bool) -> Result<(), Refusal> {
    endpoint.replayer.set_ignores_hero(ignores);
    Ok(())
}

pub(super) fn set_ignores_spectator(endpoint: &mut Endpoint, ignores: bool) -> Result<(), Refusal> {
    endpoint.replayer.set_ignores_spectator(ignores);
    Ok(())
}
