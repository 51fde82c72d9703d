//! Which web pages may talk to the face: a browser lets any page of the web open a socket to this
//! machine, and says only whose page it is.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;

use super::http_errors;

/// Whose pages are served, besides the face's own. Programs that are no browsers name no origin and
/// are not asked.
#[derive(Clone, Debug, Default)]
pub(crate) struct OriginRule {
    /// The face listens on the loopback alone: a name that is not this machine's own was made to
    /// lead here by somebody else.
    pub(crate) is_loopback: bool,
    /// Origins as browsers send them, e.g. `https://example.com`.
    pub(crate) allowed: Vec<String>,
}

impl OriginRule {
    fn admits(&self, headers: &HeaderMap) -> bool {
        let Some(origin) = headers.get(header::ORIGIN) else { return true };
        let Ok(origin) = origin.to_str() else { return false };
        if self.allowed.iter().any(|allowed| allowed.eq_ignore_ascii_case(origin)) {
            return true;
        }
        let own = headers.get(header::HOST).and_then(|host| host.to_str().ok());
        let page = origin.split_once("://").map(|(_, authority)| authority);
        match (own, page) {
            (Some(own), Some(page)) => {
                own.eq_ignore_ascii_case(page) && (!self.is_loopback || is_this_machine(own))
            }
            _ => false,
        }
    }
}

/// Whether a host, with or without a port, is a name of the loopback or an address.
fn is_this_machine(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    };
    name.eq_ignore_ascii_case("localhost") || name.parse::<IpAddr>().is_ok()
}

/// Refuses what pages of others ask for.
pub(super) async fn check(
    State(rule): State<Arc<OriginRule>>,
    request: Request,
    next: Next,
) -> Response {
    if rule.admits(request.headers()) {
        return next.run(request).await;
    }
    let found = request.headers().get(header::ORIGIN);
    let found = found.map(|origin| String::from_utf8_lossy(origin.as_bytes()).into_owned());
    let found: String = found.unwrap_or_default().chars().take(128).collect();
    let text = format!(
        "Pages of {found:?} may not use this server; it admits its own, and origins given with \
         --allow-origin"
    );
    http_errors::detail(StatusCode::FORBIDDEN, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn admits(rule: &OriginRule, host: &str, origin: Option<&str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        rule.admits(&headers)
    }

    #[test]
    fn own_pages_and_programs_are_admitted_and_pages_of_others_are_not() {
        let rule = OriginRule { is_loopback: true, allowed: Vec::new() };
        for host in ["localhost:8000", "127.0.0.1:8000", "[::1]:8000"] {
            assert!(admits(&rule, host, None));
            assert!(admits(&rule, host, Some(&format!("http://{host}"))));
            for foreign in ["https://evil.example", "null", "http://localhost:9000", "", "://"] {
                assert!(!admits(&rule, host, Some(foreign)), "{foreign:?} at {host}");
            }
        }
    }

    #[test]
    fn a_name_that_was_made_to_lead_to_the_loopback_is_no_name_of_this_machine() {
        let page = Some("http://evil.example:8000");
        let mut rule = OriginRule { is_loopback: true, allowed: Vec::new() };
        assert!(!admits(&rule, "evil.example:8000", page));
        rule.is_loopback = false;
        assert!(admits(&rule, "sim.example:8000", Some("http://sim.example:8000")));
        rule.is_loopback = true;
        rule.allowed.push("https://sim.example".to_owned());
        assert!(admits(&rule, "127.0.0.1:8000", Some("https://sim.example")));
    }
}
