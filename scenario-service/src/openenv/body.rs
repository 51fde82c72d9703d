//! Bodies of requests: read whole before anybody deals with them, and waited for so long.

use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::{FromRequest as _, Request, State};
use axum::http::StatusCode;
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use hyper::body::Body as _;

use super::http_errors;

/// Has a request dealt with once its body is there.
pub(super) async fn read(State(wait): State<Duration>, request: Request, next: Next) -> Response {
    if request.body().is_end_stream() {
        return next.run(request).await;
    }
    let (parts, body) = request.into_parts();
    let reading = Bytes::from_request(Request::from_parts(parts.clone(), body), &());
    match tokio::time::timeout(wait, reading).await {
        Ok(Ok(body)) => next.run(Request::from_parts(parts, Body::from(body))).await,
        Ok(Err(refused)) => refused.into_response(),
        Err(_) => {
            let text = format!("A body must come within {} s, and has not", wait.as_secs_f32());
            http_errors::detail(StatusCode::REQUEST_TIMEOUT, text)
        }
    }
}
