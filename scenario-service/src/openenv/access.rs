//! Who asks: a token in the headers of a request, wherever clients can put one.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::extract::{ConnectInfo, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use tenancy::Refusal;

use super::{Face, http_errors};
use crate::limits::ECHO_CHARS_MAX;

/// What says nothing of any world: probes, hubs and validators ask for it without a token.
const PUBLIC: [&str; 7] =
    ["/", "/health", "/metadata", "/schema", "/openapi.json", "/docs", "/redoc"];
/// What the WebSocket of a browser, which cannot set other headers, is answered with.
pub(super) const PROTOCOL: &str = "causeway.v1";
/// How such a WebSocket names its token among its protocols.
const BEARER_PROTOCOL: &str = "bearer.";

/// What tokens begin with.
const TOKEN: &str = "cw_";

/// Where a connection comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peer(pub(super) SocketAddr);

/// Lets in who may come in, and says to everything behind it who it is.
pub(super) async fn check(
    State(face): State<Arc<Face>>,
    ConnectInfo(Peer(peer)): ConnectInfo<Peer>,
    mut request: Request,
    next: Next,
) -> Response {
    if PUBLIC.contains(&request.uri().path()) {
        return next.run(request).await;
    }
    let presented = token(request.headers());
    match face.door.admit(presented.as_deref(), peer.ip()) {
        Ok(visitor) => {
            request.extensions_mut().insert(visitor);
            next.run(request).await
        }
        Err(refusal) => {
            face.sessions.contexts().first().figures.note_refusal(refusal);
            if refusal == Refusal::WrongToken {
                let path = without_secrets(request.uri().path());
                tracing::warn!(target: "audit", %peer, path, why = %refusal, "enter refused");
            }
            refused(refusal)
        }
    }
}

/// A path as it may be written down: somebody may have put a token there, where none is read.
fn without_secrets(path: &str) -> String {
    let part = |part: &str| if part.contains(TOKEN) { "TOKEN" } else { part }.to_owned();
    let parts: Vec<String> = path.split('/').map(part).collect();
    parts.join("/").chars().take(ECHO_CHARS_MAX).collect()
}

fn refused(refusal: Refusal) -> Response {
    let text = refusal.to_string();
    match refusal {
        Refusal::TooMany => {
            let refused = http_errors::detail(StatusCode::TOO_MANY_REQUESTS, text);
            ([(header::RETRY_AFTER, HeaderValue::from_static("1"))], refused).into_response()
        }
        Refusal::NoToken | Refusal::WrongToken => {
            let mut refused = http_errors::detail(StatusCode::UNAUTHORIZED, text);
            // A browser asks its user by the first of them.
            for way in ["Basic realm=\"causeway\"", "Bearer realm=\"causeway\""] {
                refused
                    .headers_mut()
                    .append(header::WWW_AUTHENTICATE, HeaderValue::from_static(way));
            }
            refused
        }
    }
}

/// What a client presents: as bearer, as the password of any user, or among the protocols of its
/// WebSocket.
fn token(headers: &HeaderMap) -> Option<String> {
    let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    let authorized = text(header::AUTHORIZATION).and_then(|value| value.split_once(' '));
    if let Some((way, rest)) = authorized {
        let rest = rest.trim();
        if way.eq_ignore_ascii_case("bearer") {
            return Some(rest.to_owned());
        }
        if way.eq_ignore_ascii_case("basic") {
            let decoded = String::from_utf8(STANDARD.decode(rest).ok()?).ok()?;
            return decoded.split_once(':').map(|(_, password)| password.to_owned());
        }
    }
    let mut protocols = text(header::SEC_WEBSOCKET_PROTOCOL)?.split(',').map(str::trim);
    protocols.find_map(|protocol| protocol.strip_prefix(BEARER_PROTOCOL)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: header::HeaderName, value: &str) -> Option<String> {
        token(&HeaderMap::from_iter([(name, value.parse().unwrap())]))
    }

    #[test]
    fn a_token_in_a_path_is_not_written_down() {
        assert_eq!(without_secrets("/t/cw_alice_secret/ws"), "/t/TOKEN/ws");
        assert_eq!(without_secrets("/x=cw_alice_secret"), "/TOKEN");
        assert_eq!(without_secrets("/web/state"), "/web/state");
    }

    #[test]
    fn a_token_is_found_wherever_clients_can_put_it() {
        let basic = STANDARD.encode("anybody:cw_a_b");
        for (name, value) in [
            (header::AUTHORIZATION, "Bearer cw_a_b"),
            (header::AUTHORIZATION, "bearer  cw_a_b"),
            (header::AUTHORIZATION, &format!("Basic {basic}")),
            (header::SEC_WEBSOCKET_PROTOCOL, "causeway.v1, bearer.cw_a_b"),
        ] {
            assert_eq!(of(name, value).as_deref(), Some("cw_a_b"), "{value}");
        }
        for value in ["", "Bearer", "Digest cw_a_b", "Basic ???", "Basic Y3c="] {
            assert_eq!(of(header::AUTHORIZATION, value), None, "{value}");
        }
        assert_eq!(of(header::SEC_WEBSOCKET_PROTOCOL, "causeway.v1"), None);
    }
}
