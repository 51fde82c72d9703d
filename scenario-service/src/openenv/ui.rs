//! `/ws/ui`: whoever listens there is told what the session of the web interface does, as
//! OpenEnv's pages are.

use std::collections::VecDeque;
use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::response::Response;
use jiff::Timestamp;
use monitoring::Drain;
use serde::Serialize;
use serde_json::{Value, json};
use tenancy::Visitor;
use tokio::sync::watch;

use super::Face;
use super::line::Meter;
use super::ws::{self, Talk};
use crate::action::Action;
use crate::episode::{self, Observation};

/// So many actions of an episode are told, the latest.
const LOG_MAX: usize = 100;
/// Of times, as Python writes and reads them.
const ISO_8601: &str = "%Y-%m-%dT%H:%M:%S%.6f+00:00";

/// What a listener is told of an episode: OpenEnv's members.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EpisodeState {
    episode_id: Option<String>,
    step_count: u64,
    current_observation: Option<Value>,
    action_logs: VecDeque<Value>,
    is_reset: bool,
}

impl Default for EpisodeState {
    fn default() -> Self {
        Self {
            episode_id: None,
            step_count: 0,
            current_observation: None,
            action_logs: VecDeque::new(),
            is_reset: true,
        }
    }
}

impl EpisodeState {
    /// After a reset.
    pub(super) fn begin(&mut self, state: &episode::State<'_>, observation: &Observation<'_>) {
        *self = Self {
            episode_id: state.episode_id.map(str::to_owned),
            current_observation: Some(json!(observation)),
            ..Self::default()
        };
    }

    /// After a step. The log is without pictures: that of the last one is in the observation.
    pub(super) fn step(
        &mut self,
        action: &Action,
        state: &episode::State<'_>,
        observation: &Observation<'_>,
    ) {
        let now = json!(observation);
        let mut logged = now.clone();
        if let Some(picture) = logged.get_mut("camera_image") {
            *picture = Value::Null;
        }
        self.action_logs.push_back(json!({
            "timestamp": Timestamp::now().strftime(ISO_8601).to_string(),
            "action": told(action),
            "observation": logged,
            "reward": observation.reward,
            "done": observation.done,
            "step_count": state.step_count,
        }));
        if self.action_logs.len() > LOG_MAX {
            self.action_logs.pop_front();
        }
        self.episode_id = state.episode_id.map(str::to_owned);
        self.step_count = state.step_count;
        self.current_observation = Some(now);
        self.is_reset = false;
    }
}

/// An action with all its members but its options.
fn told(action: &Action) -> Value {
    json!({
        "action_type": action.kind.as_str(),
        "throttle": action.throttle,
        "steer": action.steer,
        "brake": action.brake,
        "lane_direction": action.lane_direction,
        "target_speed_kmh": action.target_speed_kmh,
        "brake_intensity": action.brake_intensity,
        "target_lane_id": action.target_lane_id,
        "navigation_behavior": action.navigation_behavior,
        "destination_x": action.destination_x,
        "destination_y": action.destination_y,
        "destination_z": action.destination_z,
        "route_steps": action.route_steps,
    })
}

/// Upgrades `/ws/ui`.
pub(super) async fn upgrade(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    Extension(meter): Extension<Arc<Meter>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    ws::with_limits(upgrade, move |socket| async move {
        let Some(web) = &face.web else { return };
        let news = web.follow(&visitor.tenant);
        tell(Talk::new(socket, meter), &face, news).await;
    })
}

/// Tells the state at once and after every change, the last of several, until the client goes or
/// the service ends. What the client says is for keeping the connection, as in OpenEnv.
async fn tell(mut talk: Talk, face: &Face, mut news: watch::Receiver<EpisodeState>) {
    let mut drain = face.sessions.follow_drain();
    loop {
        let told = json!({ "type": "state_update", "episode_state": &*news.borrow_and_update() });
        if !talk.send(told.to_string()).await {
            return;
        }
        loop {
            tokio::select! {
                changed = news.changed() => match changed {
                    Ok(()) => break,
                    Err(_) => return talk.close().await,
                },
                said = talk.next_text(face.sessions.idle.connected) => {
                    if said.is_none() {
                        return talk.close().await;
                    }
                    talk.heard();
                }
                () = until_it_ends(&mut drain) => return talk.leave().await,
            }
        }
    }
}

async fn until_it_ends(drain: &mut watch::Receiver<Drain>) {
    if drain.wait_for(|drain| drain.is_on()).await.is_err() {
        std::future::pending().await
    }
}
