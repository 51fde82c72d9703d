//! HTTP answers that are not 200, in the shapes that OpenEnv's server gives them.

use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use super::coerce::FieldError;
use super::reply;
use crate::session::SessionError;
use crate::session::table::{AttachError, OpenError};

/// When a client that was sent away may come again: another service may answer at once.
const RETRY_AFTER_SECS: &str = "1";

/// Any status with a `detail`.
pub(super) fn detail(status: StatusCode, detail: impl Into<Value>) -> Response {
    (status, Json(json!({ "detail": detail.into() }))).into_response()
}

/// For those who come when the service is about to end.
pub(super) fn elsewhere() -> Response {
    let refused = detail(StatusCode::SERVICE_UNAVAILABLE, OpenError::Draining.to_string());
    ([(header::RETRY_AFTER, RETRY_AFTER_SECS)], refused).into_response()
}

/// For paths nobody serves.
pub(super) fn not_found() -> Response {
    detail(StatusCode::NOT_FOUND, "Not Found")
}

/// For methods a path does not know.
pub(super) async fn method_not_allowed() -> Response {
    detail(StatusCode::METHOD_NOT_ALLOWED, "Method Not Allowed")
}

/// For values that are not what they must be.
pub(super) fn invalid(errors: &[FieldError]) -> Response {
    detail(StatusCode::UNPROCESSABLE_ENTITY, reply::field_errors(errors))
}

/// For a body that is no JSON.
pub(super) fn no_json() -> Response {
    let error = json!([{
        "type": "json_invalid",
        "loc": ["body", 0],
        "msg": "JSON decode error",
        "input": {},
        "ctx": { "error": "Expecting value" },
    }]);
    detail(StatusCode::UNPROCESSABLE_ENTITY, error)
}

impl IntoResponse for SessionError {
    fn into_response(self) -> Response {
        let status = match &self {
            error if error.is_callers_fault() => StatusCode::BAD_REQUEST,
            Self::World(_) => StatusCode::SERVICE_UNAVAILABLE,
            _ => StatusCode::INTERNAL_SERVER_ERROR,
        };
        detail(status, self.to_string())
    }
}

impl IntoResponse for OpenError {
    fn into_response(self) -> Response {
        match &self {
            Self::Capacity { .. } | Self::Quota { .. } => {
                detail(StatusCode::SERVICE_UNAVAILABLE, self.to_string())
            }
            Self::Draining => elsewhere(),
            Self::Scenario(_) => detail(StatusCode::INTERNAL_SERVER_ERROR, self.to_string()),
        }
    }
}

impl IntoResponse for AttachError {
    fn into_response(self) -> Response {
        detail(StatusCode::NOT_FOUND, self.to_string())
    }
}
