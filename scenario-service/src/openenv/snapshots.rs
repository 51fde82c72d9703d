//! States of episodes over HTTP, for trainers: kept, told, given up, and sessions that go on from
//! one. The driver's own messages know nothing of these addresses.

#![allow(clippy::result_large_err, reason = "a refusal is as large as the answer it stands for")]

use std::sync::Arc;
use std::time::Instant;

use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::{delete, get, post};
use axum::{Extension, Json, Router};
use serde_json::{Map, Value, json};
use tenancy::Visitor;

use super::coerce::{FieldError, Reader};
use super::http::{get_only, in_body, object};
use super::{Face, http_errors};
use crate::limits::{FORKS_MAX, ID_CHARS_MAX};
use crate::session::Saved;
use crate::session::table::{InUse, Life, TenantSessions};

pub(super) fn router() -> Router<Arc<Face>> {
    Router::new()
        .route("/snapshots", get_only(get(list)).post(keep))
        .route("/snapshots/{id}", delete(forget))
        .route("/fork", post(fork))
}

/// Which session a request is about, and how many are to go on from it.
struct Asked {
    session_id: String,
    count: usize,
}

impl Asked {
    fn read(headers: &HeaderMap, body: &Bytes) -> Result<Self, Response> {
        let body = object(headers, body)?;
        let mut read = Reader::new(&body);
        let session_id = read.optional_short_text("session_id", ID_CHARS_MAX);
        let count = read.optional_integer("count", 1).unwrap_or(1);
        let mut errors = read.finish_open(()).err().unwrap_or_default();
        let whole = || Value::Object(body.clone());
        if session_id.is_none() && errors.is_empty() {
            errors.push(FieldError::missing("session_id", &whole()));
        }
        if !errors.is_empty() {
            return Err(in_body(errors));
        }
        if count > FORKS_MAX {
            let text = format!("count: wanted at most {FORKS_MAX}, found {count}");
            return Err(http_errors::detail(StatusCode::UNPROCESSABLE_ENTITY, text));
        }
        Ok(Self { session_id: session_id.unwrap_or_default(), count: count as usize })
    }
}

async fn keep(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, Response> {
    let asked = Asked::read(&headers, &body)?;
    let session = found(&face.sessions.of(visitor), &asked.session_id)?;
    let mut running = session.session.lock().await;
    let saved = running.saved().await.map_err(IntoResponse::into_response)?;
    let mut told = told(&saved);
    told.insert("snapshot_id".to_owned(), json!(running.keep(saved).id));
    Ok(Json(told).into_response())
}

fn found(sessions: &TenantSessions, session_id: &str) -> Result<InUse, Response> {
    sessions.find(session_id).map_err(IntoResponse::into_response)
}

/// What a client hears of a state.
fn told(saved: &Saved) -> Map<String, Value> {
    let (tick, state_hash) = saved.state();
    let told = [
        ("bytes", json!(saved.bytes())),
        ("tick", json!(tick.0)),
        ("state_hash", json!(format!("{state_hash:016x}"))),
    ];
    told.map(|(name, value)| (name.to_owned(), value)).into_iter().collect()
}

async fn list(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
) -> Json<Value> {
    let told = face.sessions.of(visitor).snapshots(Instant::now());
    let told = told.into_iter().map(|(id, bytes, idle)| {
        json!({ "snapshot_id": id, "bytes": bytes, "idle_secs": idle.as_secs() })
    });
    Json(json!({ "snapshots": told.collect::<Vec<_>>() }))
}

async fn forget(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    Path(id): Path<String>,
) -> Response {
    match face.sessions.of(visitor).forget(&id, Instant::now()) {
        true => StatusCode::NO_CONTENT.into_response(),
        false => http_errors::detail(StatusCode::NOT_FOUND, "there is no such snapshot"),
    }
}

/// Sessions that go on from where one is. All or none: those of a fork that fails are closed.
async fn fork(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, Response> {
    let asked = Asked::read(&headers, &body)?;
    if face.sessions.drain().is_late(Instant::now()) {
        return Err(http_errors::elsewhere());
    }
    let sessions = face.sessions.of(visitor);
    let session = found(&sessions, &asked.session_id)?;
    let saved = session.session.lock().await.saved().await.map_err(IntoResponse::into_response)?;
    let mut branches = Branches { sessions: &sessions, ids: Vec::with_capacity(asked.count) };
    for _ in 0..asked.count {
        branches.add(saved.clone()).await?;
    }
    let mut told = told(&saved);
    told.insert("session_ids".to_owned(), json!(branches.keep()));
    Ok(Json(told).into_response())
}

/// Sessions of a fork that is not done: they are closed when this is dropped, also when the client
/// has gone.
struct Branches<'a> {
    sessions: &'a TenantSessions,
    ids: Vec<String>,
}

impl Branches<'_> {
    async fn add(&mut self, saved: Saved) -> Result<(), Response> {
        let branch = self.sessions.open(Life::Detached).map_err(IntoResponse::into_response)?;
        self.ids.push(branch.id.clone());
        let begun = branch.session.lock().await.go_on_from(saved, None).await;
        begun.map(drop).map_err(IntoResponse::into_response)
    }

    /// They live on.
    fn keep(mut self) -> Vec<String> {
        std::mem::take(&mut self.ids)
    }
}

impl Drop for Branches<'_> {
    fn drop(&mut self) {
        for id in &self.ids {
            self.sessions.close(id);
        }
    }
}
