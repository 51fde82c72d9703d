//! `/ws/ui`: whoever listens there is told what the session of the web interface does, as
//! OpenEnv's pages are.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use axum::Extension;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::response::Response;
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
            "timestamp": utc(SystemTime::now()),
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

/// A time as ISO 8601 has it. The day is that of the proleptic Gregorian calendar, by H. Hinnant,
/// "chrono-Compatible Low-Level Date Algorithms", `civil_from_days`.
fn utc(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let (secs, micros) = (since.as_secs(), since.subsec_micros());
    let days = secs / 86_400 + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = era * 400 + year + u64::from(month <= 2);
    let (hour, minute, second) = (secs / 3_600 % 24, secs / 60 % 60, secs % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{micros:06}+00:00")
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        for (micros, wanted) in [
            (0, "1970-01-01T00:00:00.000000+00:00"),
            (951_782_399_000_001, "2000-02-28T23:59:59.000001+00:00"),
            (951_868_799_999_999, "2000-02-29T23:59:59.999999+00:00"),
            (1_798_761_599_000_000, "2026-12-31T23:59:59.000000+00:00"),
            (4_107_542_400_000_000, "2100-03-01T00:00:00.000000+00:00"),
        ] {
            assert_eq!(utc(UNIX_EPOCH + Duration::from_micros(micros)), wanted);
        }
    }
}
