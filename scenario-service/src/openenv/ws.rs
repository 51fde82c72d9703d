//! The WebSocket `/ws`: one connection, one session, one answer per message, in order.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Extension;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{CloseFrame, Message as Frame, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::extract::{Query, State};
use axum::response::{IntoResponse as _, Response};
use futures_util::SinkExt as _;
use monitoring::Drain;
use serde_json::{Map, Value};
use tenancy::Visitor;
use tokio::sync::watch;

use super::envelope::{self, Message, Refusal};
use super::line::Meter;
use super::{Face, access, http_errors, mcp, reply};
use crate::limits::{MESSAGE_BYTES_MAX, READ_BUFFER_BYTES, TRANSPORT_BYTES_MAX};
use crate::session::table::{InUse, Life, OpenError, TenantSessions};

/// How long a client may take to answer a close.
const CLOSE_WAIT: Duration = Duration::from_secs(1);
/// Of a client's ping or pong, beside what it says, RFC 6455 §5.2.
const CONTROL_HEAD_BYTES: usize = 6;
/// Normal closure, RFC 6455 §7.4.1.
const CLOSE_NORMAL: u16 = 1000;
/// The service restarts: whoever connects again finds another one. Registered by IANA for RFC 6455.
const CLOSE_RESTART: u16 = 1012;

/// A WebSocket, and what of its messages is unfinished.
pub(super) struct Talk {
    socket: WebSocket,
    meter: Arc<Meter>,
}

#[derive(serde::Deserialize)]
pub(super) struct Params {
    session_id: Option<String>,
}

/// Upgrades `/ws`.
pub(super) async fn upgrade(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    Extension(meter): Extension<Arc<Meter>>,
    Query(params): Query<Params>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    // Before the upgrade, so that whoever balances the load tries another service.
    if params.session_id.is_none() && face.sessions.drain().is_on() {
        return OpenError::Draining.into_response();
    }
    with_limits(upgrade, move |socket| async move {
        let sessions = face.sessions.of(visitor);
        serve(Talk::new(socket, meter), &face, &sessions, params.session_id).await;
    })
}

/// Upgrades `/mcp`.
pub(super) async fn upgrade_mcp(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    Extension(meter): Extension<Arc<Meter>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    with_limits(upgrade, move |socket| async move {
        let sessions = face.sessions.of(visitor);
        serve_mcp(Talk::new(socket, meter), &face, &sessions).await;
    })
}

pub(super) fn with_limits<F>(
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
    serve: impl FnOnce(WebSocket) -> F + Send + 'static,
) -> Response
where
    F: Future<Output = ()> + Send + 'static,
{
    match upgrade {
        Ok(upgrade) => upgrade
            .max_message_size(TRANSPORT_BYTES_MAX)
            .max_frame_size(TRANSPORT_BYTES_MAX)
            .read_buffer_size(READ_BUFFER_BYTES)
            .protocols([access::PROTOCOL])
            .on_upgrade(serve),
        Err(_) => http_errors::not_found(),
    }
}

async fn serve(mut talk: Talk, face: &Face, sessions: &TenantSessions, session_id: Option<String>) {
    let opened = match &session_id {
        Some(id) => sessions
            .attach(id)
            .map_err(|error| reply::error("SESSION_ERROR", &error.to_string(), Map::new())),
        None => sessions.open(Life::Connection).map_err(|error| open_error(&error)),
    };
    let in_use = match opened {
        Ok(in_use) => in_use,
        Err(text) => return talk.part(text).await,
    };
    let idle = face.sessions.idle.connected;
    let mut drain = face.sessions.follow_drain();
    let mut code = CLOSE_NORMAL;
    loop {
        let text = tokio::select! {
            text = talk.next_text(idle) => text,
            () = until_it_leaves(&mut drain, &in_use) => {
                code = CLOSE_RESTART;
                break;
            }
        };
        let message = match text {
            Some(Ok(text)) => envelope::parse(&text),
            Some(Err(refusal)) => Err(refusal),
            None => break,
        };
        let answer = match message {
            Ok(Message::Close) => break,
            Ok(Message::Reset(_)) if face.sessions.drain().is_late(Instant::now()) => {
                code = CLOSE_RESTART;
                let refused = open_error(&OpenError::Draining);
                talk.send(refused).await;
                break;
            }
            Ok(message) => answer(sessions, &in_use, message).await,
            Err(refusal) => reply::refusal(&refusal),
        };
        if !talk.send(answer).await || in_use.is_closing() {
            break;
        }
    }
    drop(in_use);
    talk.close_as(code).await;
}

/// Returns when there is nothing left for a session to do before the service ends.
async fn until_it_leaves(drain: &mut watch::Receiver<Drain>, in_use: &InUse) {
    loop {
        let now = *drain.borrow_and_update();
        if now.is_on() && in_use.session.lock().await.leaves(now) {
            return;
        }
        let half = now.late_at().map(tokio::time::Instant::from_std);
        let is_late = async {
            match half.filter(|half| *half > tokio::time::Instant::now()) {
                Some(half) => tokio::time::sleep_until(half).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            changed = drain.changed() => {
                if changed.is_err() {
                    return std::future::pending().await;
                }
            }
            () = is_late => {}
        }
    }
}

impl Talk {
    pub(super) fn new(socket: WebSocket, meter: Arc<Meter>) -> Self {
        Self { socket, meter }
    }

    /// A message that wants no answer.
    pub(super) fn heard(&self) {
        self.meter.finish();
    }

    /// Whether a client has taken the answer to its message, as far as the system's buffers can
    /// tell.
    pub(super) async fn send(&mut self, answer: String) -> bool {
        self.meter.finish();
        self.socket.send(Frame::Text(answer.into())).await.is_ok()
    }

    /// The next message of a client; `None` when the connection is over.
    pub(super) async fn next_text(&mut self, idle: Duration) -> Option<Result<Utf8Bytes, Refusal>> {
        loop {
            // Missing pongs close nothing: a client may think for minutes.
            let frame = tokio::time::timeout(idle, self.socket.recv()).await.ok()??;
            let text = match frame.ok()? {
                Frame::Text(text) => text,
                Frame::Binary(bytes) => match Utf8Bytes::try_from(bytes) {
                    Ok(text) => text,
                    Err(_) => {
                        return Some(Err(Refusal::InvalidJson(
                            "a binary frame that is not UTF-8".into(),
                        )));
                    }
                },
                // The answer is out before the next frame is read: a client that asks on without
                // reading finds nobody who listens.
                Frame::Ping(bytes) => {
                    self.meter.discount(CONTROL_HEAD_BYTES + bytes.len());
                    self.socket.flush().await.ok()?;
                    continue;
                }
                Frame::Pong(bytes) => {
                    self.meter.discount(CONTROL_HEAD_BYTES + bytes.len());
                    continue;
                }
                Frame::Close(_) => return None,
            };
            if text.len() > MESSAGE_BYTES_MAX {
                let found = text.len();
                return Some(Err(Refusal::InvalidJson(format!(
                    "a message has at most {MESSAGE_BYTES_MAX} bytes, not {found}"
                ))));
            }
            return Some(Ok(text));
        }
    }

    /// Says the last word.
    async fn part(mut self, text: String) {
        if self.send(text).await {
            self.close_as(CLOSE_NORMAL).await;
        }
    }

    /// Says goodbye.
    pub(super) async fn close(self) {
        self.close_as(CLOSE_NORMAL).await;
    }

    /// The same, as the service ends.
    pub(super) async fn leave(self) {
        self.close_as(CLOSE_RESTART).await;
    }

    /// Says goodbye and lets the client say it too, so that nothing sent before is lost.
    async fn close_as(mut self, code: u16) {
        let reason = if code == CLOSE_RESTART { "the service restarts; connect again" } else { "" };
        let frame = CloseFrame { code, reason: reason.into() };
        let farewell = async {
            if self.socket.send(Frame::Close(Some(frame))).await.is_ok() {
                while let Some(Ok(_)) = self.socket.recv().await {}
            }
        };
        // A client that does not answer is cut off.
        let _ = tokio::time::timeout(CLOSE_WAIT, farewell).await;
    }
}

async fn answer(sessions: &TenantSessions, in_use: &InUse, message: Message) -> String {
    let mut session = in_use.session.lock().await;
    let result = match message {
        Message::Reset(request) => session.reset(request).await,
        Message::Step(action) => session.step(&action).await,
        Message::State => return reply::state(&session.state(), &in_use.id),
        Message::Mcp(request) => {
            drop(session);
            return reply::mcp(&mcp::answer(sessions, Some(&in_use.id), &request));
        }
        Message::Close => return String::new(),
    };
    match result {
        Ok(report) => match session.observation(&report) {
            Some(observation) => reply::observation(&observation),
            None => execution_error("the episode is over"),
        },
        Err(error) => execution_error(&error.to_string()),
    }
}

fn execution_error(text: &str) -> String {
    reply::error("EXECUTION_ERROR", text, Map::new())
}

fn open_error(error: &OpenError) -> String {
    match error {
        OpenError::Capacity { active, max } | OpenError::Quota { active, max, .. } => {
            let mut more = Map::new();
            more.insert("active_sessions".to_owned(), (*active).into());
            more.insert("max_sessions".to_owned(), (*max).into());
            reply::error("CAPACITY_REACHED", &error.to_string(), more)
        }
        OpenError::Draining => reply::error("SERVICE_ENDING", &error.to_string(), Map::new()),
        OpenError::Scenario(_) => {
            let name = "CarlaEnvironment";
            let text = format!("Environment factory '{name}' failed to create instance.");
            let mut more = Map::new();
            more.insert("factory_name".to_owned(), name.into());
            more.insert("detail".to_owned(), error.to_string().into());
            reply::error("FACTORY_ERROR", &text, more)
        }
    }
}

async fn serve_mcp(mut talk: Talk, face: &Face, sessions: &TenantSessions) {
    let in_use = match sessions.open(Life::Connection) {
        Ok(in_use) => in_use,
        Err(error) => return talk.part(mcp::refused(&error).to_string()).await,
    };
    let idle = face.sessions.idle.connected;
    let mut drain = face.sessions.follow_drain();
    loop {
        let text = tokio::select! {
            text = talk.next_text(idle) => text,
            () = until_it_leaves(&mut drain, &in_use) => None,
        };
        let Some(text) = text else { break };
        let response: Value = match text {
            Ok(text) => match super::json::parse(&text) {
                Ok(request) => mcp::answer(sessions, Some(&in_use.id), &request),
                Err(why) => mcp::parse_error(Some(&why)),
            },
            Err(_) => mcp::parse_error(Some("not a text of legal size")),
        };
        if !talk.send(response.to_string()).await {
            break;
        }
    }
    drop(in_use);
    talk.close_as(CLOSE_NORMAL).await;
}
