//! Which web pages may talk to the face: a browser lets any page of the web open a socket to this
//! machine, and says only whose page it is.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
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
    /// Nobody is asked for a token, which no page of others has.
    pub(crate) is_open: bool,
    /// Origins as browsers send them, e.g. `https://example.com`.
    pub(crate) allowed: Vec<String>,
}

impl OriginRule {
    fn admits(&self, headers: &HeaderMap) -> Result<(), Stranger> {
        if self.is_called_by_name(headers) {
            if self.is_own_page(headers) { Ok(()) } else { Err(Stranger::Page) }
        } else {
            Err(Stranger::Name)
        }
    }

    /// Whether a request was sent to a name of this machine. Behind a name that somebody else has
    /// made to lead here is a page whose own requests carry no origin.
    fn is_called_by_name(&self, headers: &HeaderMap) -> bool {
        let host = headers.get(header::HOST).filter(|_| self.is_loopback && self.is_open);
        let Some(host) = host else { return true };
        let Ok(host) = host.to_str() else { return false };
        let is_configured = |allowed: &String| {
            let authority = allowed.split_once("://").map(|(_, authority)| authority);
            authority
                .is_some_and(|authority| name_of(authority).eq_ignore_ascii_case(name_of(host)))
        };
        is_this_machine(host) || self.allowed.iter().any(is_configured)
    }

    fn is_own_page(&self, headers: &HeaderMap) -> bool {
        let Some(origin) = headers.get(header::ORIGIN) else { return true };
        let Ok(origin) = origin.to_str() else { return false };
        if self.allowed.iter().any(|allowed| allowed.eq_ignore_ascii_case(origin)) {
            return true;
        }
        let own = headers.get(header::HOST).and_then(|host| host.to_str().ok());
        let page = origin.split_once("://").map(|(_, authority)| authority);
        own.zip(page).is_some_and(|(own, page)| {
            own.eq_ignore_ascii_case(page) && (!self.is_loopback || is_this_machine(own))
        })
    }
}

/// Who is not served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stranger {
    /// A page of another site.
    Page,
    /// Whoever calls the face by a name that is none of its own.
    Name,
}

/// A host without its port.
fn name_of(host: &str) -> &str {
    match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    }
}

/// Whether a host, with or without a port, is an address, or a name that nobody can have lead here:
/// those of the loopback (RFC 6761), and that of Docker for the machine of a container.
fn is_this_machine(host: &str) -> bool {
    let name = name_of(host).to_ascii_lowercase();
    name == "localhost"
        || name.ends_with(".localhost")
        || name == "host.docker.internal"
        || name.parse::<IpAddr>().is_ok()
}

/// Refuses what pages of others ask for.
pub(super) async fn check(
    State(rule): State<Arc<OriginRule>>,
    request: Request,
    next: Next,
) -> Response {
    let headers = request.headers();
    let (named, text) = match rule.admits(headers) {
        Ok(()) => return next.run(request).await,
        Err(Stranger::Page) => (
            header::ORIGIN,
            "Pages of {} may not use this server; it admits its own, and origins given with \
             --allow-origin",
        ),
        Err(Stranger::Name) => (
            header::HOST,
            "This server is not called {}: it listens on the loopback, as localhost or an address; \
             --allow-origin http://NAME gives it another name",
        ),
    };
    let found = headers.get(named).map(HeaderValue::as_bytes).unwrap_or_default();
    let found: String = String::from_utf8_lossy(found).chars().take(128).collect();
    http_errors::detail(StatusCode::FORBIDDEN, text.replace("{}", &format!("{found:?}")))
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
        rule.admits(&headers).is_ok()
    }

    #[test]
    fn own_pages_and_programs_are_admitted_and_pages_of_others_are_not() {
        let rule = OriginRule { is_loopback: true, is_open: true, allowed: Vec::new() };
        for host in ["localhost:8000", "127.0.0.1:8000", "[::1]:8000", "host.docker.internal:8000"]
        {
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
        let mut rule = OriginRule { is_loopback: true, is_open: true, allowed: Vec::new() };
        for page in [page, None] {
            assert!(!admits(&rule, "evil.example:8000", page), "{page:?}");
        }
        rule.is_open = false;
        assert!(!admits(&rule, "evil.example:8000", page));
        assert!(admits(&rule, "sim.example", None), "a proxy in front, and a token");
        rule.is_open = true;
        assert!(rule.admits(&HeaderMap::new()).is_ok(), "a program of before HTTP/1.1");
        rule.is_loopback = false;
        for page in [Some("http://sim.example:8000"), None] {
            assert!(admits(&rule, "sim.example:8000", page), "{page:?}");
        }
        rule.is_loopback = true;
        rule.allowed.push("https://sim.example".to_owned());
        assert!(admits(&rule, "127.0.0.1:8000", Some("https://sim.example")));
        // A proxy on this machine passes on what it was called.
        assert!(admits(&rule, "sim.example", None));
    }
}
