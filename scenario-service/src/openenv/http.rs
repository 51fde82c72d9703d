//! The HTTP endpoints.

#![allow(clippy::result_large_err, reason = "a refusal is as large as the answer it stands for")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Query, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::{MethodRouter, any, get, post};
use axum::{Extension, Json, Router};
use serde_json::{Map, Value, json};
use tenancy::Visitor;

use super::coerce::{self, FieldError, Reader};
use super::web::{self, page};
use super::{
    Face, Mode, access, body, docs, envelope, http_errors, json as lenient, mcp, openapi, reply,
};
use super::{origin, schema, snapshots, tasks, ws};
use crate::action::Action;
use crate::episode::{self, Observation};
use crate::limits::{ID_CHARS_MAX, MESSAGE_BYTES_MAX};
use crate::session::ResetRequest;
use crate::session::table::{InUse, Life};

/// Which session a request means and is answered with.
const SESSION_HEADER: &str = "x-session-id";

/// Every route; a body may take so long.
pub(super) fn router(face: Arc<Face>, body_wait: Duration) -> Router {
    let mut router = Router::new()
        .route("/docs", page(docs::API))
        .route("/redoc", page(docs::API))
        .route("/health", fixed(json!({ "status": "healthy" })))
        .route("/metadata", fixed(schema::metadata()))
        .route("/schema", fixed(schema::all()))
        .route("/openapi.json", fixed(openapi::document(face.mode)))
        .route("/ws", get_only(get(ws::upgrade)))
        .route("/mcp", any(ws::upgrade_mcp).post(rpc))
        .route("/metrics", get_only(get(metrics)))
        .merge(tasks::router())
        .merge(web::router(&face));
    if face.mode == Mode::Simulation {
        router = router
            .route("/reset", post(reset))
            .route("/step", post(step))
            .route("/state", get_only(get(state)))
            .merge(snapshots::router());
    }
    router
        .fallback(|| async { http_errors::not_found() })
        .method_not_allowed_fallback(http_errors::method_not_allowed)
        .layer(from_fn_with_state(body_wait, body::read))
        .layer(DefaultBodyLimit::max(MESSAGE_BYTES_MAX))
        .layer(from_fn_with_state(Arc::clone(&face), access::check))
        .layer(from_fn_with_state(Arc::new(face.origins.clone()), origin::check))
        .with_state(face)
}

pub(super) type Routes = MethodRouter<Arc<Face>>;

/// GET without the HEAD that would come with it, as in the reference server.
pub(super) fn get_only(routes: Routes) -> Routes {
    routes.head(http_errors::method_not_allowed)
}

pub(super) fn fixed(value: Value) -> Routes {
    let body = Bytes::from(value.to_string());
    get_only(get(move || async move { ([(header::CONTENT_TYPE, "application/json")], body) }))
}

async fn metrics(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
) -> Json<Value> {
    let (active, max) = face.sessions.of(visitor).load();
    Json(json!({ "active_sessions": active, "max_sessions": max }))
}

async fn rpc(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    body: Bytes,
) -> Json<Value> {
    let request = std::str::from_utf8(&body).ok().and_then(|text| lenient::parse(text).ok());
    Json(match request {
        Some(request) => mcp::answer(&face.sessions.of(visitor), None, &request),
        None => mcp::parse_error(None),
    })
}

async fn reset(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, Response> {
    let (body, request) = reset_of(&face, &headers, &body)?;
    let sessions = face.sessions.of(visitor);
    // A reset by id without a session makes one: the id comes back with the answer.
    let session = match session_id(&headers, body.get("session_id")) {
        Some(id) if !id.is_empty() => sessions.find(&id).map_err(IntoResponse::into_response)?,
        Some(_) => sessions.open(Life::Detached).map_err(IntoResponse::into_response)?,
        None => sessions.open(Life::Connection).map_err(IntoResponse::into_response)?,
    };
    carry_out(&session, Order::Reset(request), |_, _| ()).await
}

async fn step(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, Response> {
    if body.is_empty() {
        return Err(http_errors::invalid(&[FieldError::missing("body", &Value::Null)]));
    }
    let body = object(&headers, &body)?;
    let action = action_of(&body)?;
    let sessions = face.sessions.of(visitor);
    let session = match session_id(&headers, body.get("session_id")) {
        Some(id) => sessions.find(&id).map_err(IntoResponse::into_response)?,
        None => sessions.open(Life::Connection).map_err(IntoResponse::into_response)?,
    };
    carry_out(&session, Order::Step(&action), |_, _| ()).await
}

#[derive(serde::Deserialize)]
struct StateParams {
    session_id: Option<String>,
}

async fn state(
    State(face): State<Arc<Face>>,
    Extension(visitor): Extension<Visitor>,
    Query(params): Query<StateParams>,
    headers: HeaderMap,
) -> Result<Response, Response> {
    let asked = params.session_id.map(Value::String);
    let Some(id) = session_id(&headers, asked.as_ref()) else {
        return Ok(Json(json!({ "episode_id": null, "step_count": 0 })).into_response());
    };
    let session = face.sessions.of(visitor).find(&id).map_err(IntoResponse::into_response)?;
    let running = session.session.lock().await;
    Ok(Json(reply::http_state(&running.state())).into_response())
}

/// What a session is asked to do.
pub(super) enum Order<'a> {
    Reset(ResetRequest),
    Step(&'a Action),
}

/// What a body asks a reset for, and the body; refused where the service is about to end.
pub(super) fn reset_of(
    face: &Face,
    headers: &HeaderMap,
    body: &Bytes,
) -> Result<(Map<String, Value>, ResetRequest), Response> {
    let body = if body.is_empty() { Map::new() } else { object(headers, body)? };
    let request = envelope::reset_request(&body).map_err(in_body)?;
    if face.sessions.drain().is_late(Instant::now()) {
        return Err(http_errors::elsewhere());
    }
    Ok((body, request))
}

/// Does it and answers; `tell` hears first what came of it. Sessions that live on tell their id.
pub(super) async fn carry_out(
    session: &InUse,
    order: Order<'_>,
    tell: impl FnOnce(&episode::State<'_>, &Observation<'_>),
) -> Result<Response, Response> {
    let mut running = session.session.lock().await;
    let report = match order {
        Order::Reset(request) => running.reset(request).await,
        Order::Step(action) => running.step(action).await,
    };
    let report = report.map_err(IntoResponse::into_response)?;
    let Some(observation) = running.observation(&report) else {
        return Err(http_errors::detail(StatusCode::INTERNAL_SERVER_ERROR, "the episode is over"));
    };
    tell(&running.state(), &observation);
    let id = session.lives_on().then_some(session.id.as_str());
    let mut response = Json(reply::http_observation(&observation, id)).into_response();
    if let Some(value) = id.and_then(|id| HeaderValue::from_str(id).ok()) {
        response.headers_mut().insert(SESSION_HEADER, value);
    }
    Ok(response)
}

fn session_id(headers: &HeaderMap, member: Option<&Value>) -> Option<String> {
    let in_header = headers.get(SESSION_HEADER).and_then(|id| id.to_str().ok());
    member.and_then(Value::as_str).or(in_header).map(str::to_owned)
}

/// The object in a body that says it is JSON.
pub(super) fn object(headers: &HeaderMap, body: &Bytes) -> Result<Map<String, Value>, Response> {
    let wrong_kind = |input: &Value| {
        let msg = "Input should be a valid dictionary or object to extract fields from";
        http_errors::invalid(&[FieldError::new("model_attributes_type", "body", msg, input)])
    };
    let content_type = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok());
    let text = std::str::from_utf8(body).map_err(|_| http_errors::no_json())?;
    if !content_type.is_some_and(|kind| kind.to_ascii_lowercase().contains("json")) {
        return Err(wrong_kind(&Value::String(text.to_owned())));
    }
    match lenient::parse(text) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(other) => Err(wrong_kind(&other)),
        Err(_) => Err(http_errors::no_json()),
    }
}

/// The action of a step body; errors of the body come before those of the action.
pub(super) fn action_of(body: &Map<String, Value>) -> Result<Action, Response> {
    let mut read = Reader::new(body);
    let action = read.object("action");
    let timeout_s = read.optional_number("timeout_s", coerce::Bounds::FINITE);
    read.optional_short_text("request_id", ID_CHARS_MAX);
    let mut errors = read.finish_open(()).err().unwrap_or_default();
    if !body.contains_key("action") {
        errors.insert(0, FieldError::missing("action", &Value::Object(body.clone())));
    }
    if timeout_s.is_some_and(|timeout_s| timeout_s <= 0.0) {
        let input = body.get("timeout_s").unwrap_or(&Value::Null);
        errors.push(FieldError::not_above_zero("timeout_s", input));
    }
    if !errors.is_empty() {
        return Err(in_body(errors));
    }
    let empty = Map::new();
    coerce::action(action.unwrap_or(&empty)).map_err(|errors| http_errors::invalid(&errors))
}

pub(super) fn in_body(errors: Vec<FieldError>) -> Response {
    let errors: Vec<FieldError> = errors.into_iter().map(|error| error.below("body")).collect();
    http_errors::invalid(&errors)
}
