//! The web interface: the page to try an environment by hand, and OpenEnv's routes below `/web/`,
//! at which everybody of a tenant has the same session; `/ws/ui` tells what it does.

#![allow(clippy::result_large_err, reason = "a refusal is as large as the answer it stands for")]

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use schemas::Tenant;
use serde_json::{Map, json};
use tenancy::Visitor;
use tokio::sync::watch;

use super::http::{Order, Routes, action_of, carry_out, fixed, get_only, object, reset_of};
use super::ui::{self, EpisodeState};
use super::{Face, Mode, docs, reply, schema};
use crate::session::table::{InUse, Life, OpenError};

/// The session of each tenant that has used the web interface.
#[derive(Debug, Default)]
pub(crate) struct WebSessions(Mutex<BTreeMap<Tenant, Shared>>);

/// What everybody of a tenant has.
#[derive(Debug, Default)]
struct Shared {
    /// Of the session, where one was begun.
    id: Option<String>,
    /// What happens in it, for those who listen.
    episode: watch::Sender<EpisodeState>,
}

impl WebSessions {
    fn of<T>(&self, tenant: &Tenant, with: impl FnOnce(&mut Shared) -> T) -> T {
        // Nothing panics while it holds the lock.
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        with(all.entry(tenant.clone()).or_default())
    }

    /// What a tenant's session does, from now on.
    pub(super) fn follow(&self, tenant: &Tenant) -> watch::Receiver<EpisodeState> {
        self.of(tenant, |shared| shared.episode.subscribe())
    }
}

/// Its routes; none where it is off.
pub(super) fn router(face: &Face) -> Router<Arc<Face>> {
    if face.web.is_none() {
        return Router::new();
    }
    let router = Router::new()
        .route("/", page(docs::INDEX))
        .route("/web", page(docs::INDEX))
        .route("/web/", get_only(get(|| async { to_page() })))
        .route("/web/metadata", fixed(schema::web_metadata()));
    if face.mode == Mode::Production {
        return router;
    }
    router
        .route("/web/reset", post(reset))
        .route("/web/step", post(step))
        .route("/web/state", get_only(get(state)))
        .route("/ws/ui", get_only(get(ui::upgrade)))
}

pub(super) fn page(html: &'static str) -> Routes {
    get_only(get(move || async move { Html(html) }))
}

/// To the page without a slash at the end, whose addresses are relative to it.
fn to_page() -> Response {
    (StatusCode::TEMPORARY_REDIRECT, [(header::LOCATION, "../web")]).into_response()
}

async fn reset(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, Response> {
    let (_, request) = reset_of(&face, &headers, &body)?;
    let tenant = visitor.tenant.clone();
    let session = shared(&face, visitor).map_err(IntoResponse::into_response)?;
    carry_out(&session, Order::Reset(request), |state, seen| {
        tell_all(&face, &tenant, |told| told.begin(state, seen));
    })
    .await
}

/// Without an action it observes.
async fn step(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, Response> {
    let mut body = if body.is_empty() { Map::new() } else { object(&headers, &body)? };
    body.entry("action").or_insert_with(|| json!({}));
    let action = action_of(&body)?;
    let tenant = visitor.tenant.clone();
    let session = shared(&face, visitor).map_err(IntoResponse::into_response)?;
    carry_out(&session, Order::Step(&action), |state, seen| {
        tell_all(&face, &tenant, |told| told.step(&action, state, seen));
    })
    .await
}

/// The whole state, of a session that is yet to begin where there is none.
async fn state(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
) -> Result<Response, Response> {
    let session = match known(&face, &visitor) {
        Some(session) => session,
        None => {
            let sessions = face.sessions.of(visitor);
            sessions.open(Life::Connection).map_err(IntoResponse::into_response)?
        }
    };
    let running = session.session.lock().await;
    Ok(Json(reply::http_state(&running.state())).into_response())
}

/// Tells those who listen.
fn tell_all(face: &Face, tenant: &Tenant, change: impl FnOnce(&mut EpisodeState)) {
    if let Some(web) = &face.web {
        web.of(tenant, |shared| shared.episode.send_modify(change));
    }
}

/// The session that a tenant shares, if it has not ended.
fn known(face: &Face, visitor: &Visitor) -> Option<InUse> {
    let id = face.web.as_ref()?.of(&visitor.tenant, |shared| shared.id.clone())?;
    face.sessions.of(visitor.clone()).find(&id).ok()
}

/// The same, or a new one.
fn shared(face: &Face, visitor: Visitor) -> Result<InUse, OpenError> {
    if let Some(session) = known(face, &visitor) {
        return Ok(session);
    }
    let (tenant, sessions) = (visitor.tenant.clone(), face.sessions.of(visitor));
    let session = sessions.open(Life::Detached)?;
    if let Some(web) = &face.web {
        // Of two that come at once the later one stays; the other's ends when it has been idle.
        web.of(&tenant, |shared| shared.id = Some(session.id.clone()));
    }
    Ok(session)
}
