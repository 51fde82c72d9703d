//! What is answered to whom. Pure: no sockets.

use monitoring::Monitor;
use serde_json::json;

/// What is asked, and by whom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Question<'a> {
    pub(crate) method: &'a str,
    pub(crate) path: &'a str,
    /// From this machine.
    pub(crate) is_local: bool,
    /// By a web page: browsers say so where it matters.
    pub(crate) is_of_page: bool,
}

/// What is answered.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) content_type: &'static str,
    pub(crate) body: String,
    /// The method that the path knows, where another was used.
    pub(crate) allow: Option<&'static str>,
}

/// Of the text that Prometheus and its relatives read.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// The answer of a process.
pub(crate) fn answer(monitor: &Monitor, question: Question<'_>) -> Answer {
    let wanted = match question.path {
        "/startupz" | "/livez" | "/readyz" | "/metrics" => "GET",
        "/drain" | "/undrain" => "POST",
        _ => return unknown(question.path),
    };
    let is_look = wanted == "GET" && question.method == "HEAD";
    if question.method != wanted && !is_look {
        let refused = status(monitor, 405, "wrong method", Some(&format!("use {wanted}")));
        return Answer { allow: Some(wanted), ..refused };
    }
    match question.path {
        "/startupz" if monitor.is_started() => status(monitor, 200, "started", None),
        "/startupz" => status(monitor, 503, "starting", monitor.why_not_ready().as_deref()),
        "/livez" => told(monitor, "alive", "stuck", monitor.why_not_live()),
        "/readyz" => told(monitor, "ready", "not ready", monitor.why_not_ready()),
        "/metrics" => {
            let body = monitor.metrics().text();
            Answer { status: 200, content_type: OPEN_METRICS, body, allow: None }
        }
        _ if !question.is_local || question.is_of_page => {
            let why = "only programs on the same machine may ask for this";
            status(monitor, 403, "refused", Some(why))
        }
        "/drain" => {
            monitor.drain();
            tracing::info!(target: "audit", "drain");
            status(monitor, 200, "draining", None)
        }
        _ if monitor.undrain() => {
            tracing::info!(target: "audit", "undrain");
            status(monitor, 200, "not draining", None)
        }
        _ => status(monitor, 409, "draining", Some("it was told to end")),
    }
}

fn told(monitor: &Monitor, good: &str, bad: &str, why_not: Option<String>) -> Answer {
    match why_not {
        None => status(monitor, 200, good, None),
        Some(why) => status(monitor, 503, bad, Some(&why)),
    }
}

fn status(monitor: &Monitor, status: u16, word: &str, reason: Option<&str>) -> Answer {
    let mut body = json!({ "service": monitor.service(), "status": word });
    if let Some(reason) = reason {
        body["reason"] = reason.into();
    }
    let body = format!("{body}\n");
    Answer { status, content_type: "application/json", body, allow: None }
}

fn unknown(path: &str) -> Answer {
    let found: String = path.chars().take(64).collect();
    let body = json!({
        "status": "not found",
        "found": found,
        "wanted": ["/startupz", "/livez", "/readyz", "/metrics", "/drain", "/undrain"],
    });
    let body = format!("{body}\n");
    Answer { status: 404, content_type: "application/json", body, allow: None }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn from_here<'a>(method: &'a str, path: &'a str) -> Question<'a> {
        Question { method, path, is_local: true, is_of_page: false }
    }

    #[test]
    fn a_process_tells_what_it_is_and_why_not() {
        let monitor = Monitor::new("world", "0.1", Duration::ZERO);
        let ask = |path| answer(&monitor, from_here("GET", path));
        assert_eq!((ask("/livez").status, ask("/startupz").status), (200, 503));
        let unready = ask("/readyz");
        assert_eq!(unready.status, 503);
        assert!(unready.body.contains("start: it has not started yet"), "{}", unready.body);
        monitor.set_started();
        assert_eq!((ask("/startupz").status, ask("/readyz").status), (200, 200));
        assert_eq!(ask("/readyz").body, "{\"service\":\"world\",\"status\":\"ready\"}\n");
        assert!(ask("/metrics").body.ends_with("# EOF\n"));
    }

    #[test]
    fn only_programs_of_this_machine_have_it_drained() {
        let monitor = Monitor::default();
        let drain = from_here("POST", "/drain");
        for stranger in
            [Question { is_local: false, ..drain }, Question { is_of_page: true, ..drain }]
        {
            assert_eq!(answer(&monitor, stranger).status, 403);
            assert!(!monitor.is_draining());
        }
        assert_eq!(answer(&monitor, drain).status, 200);
        assert!(monitor.is_draining());
        assert_eq!(answer(&monitor, from_here("POST", "/undrain")).status, 200);
        assert!(!monitor.is_draining());
        monitor.begin_end();
        assert_eq!(answer(&monitor, from_here("POST", "/undrain")).status, 409);
    }

    #[test]
    fn what_cannot_be_asked_is_refused_with_what_can() {
        let monitor = Monitor::default();
        let wrong = answer(&monitor, from_here("GET", "/drain"));
        assert_eq!((wrong.status, wrong.allow), (405, Some("POST")));
        assert!(!monitor.is_draining());
        assert_eq!(answer(&monitor, from_here("HEAD", "/livez")).status, 200);
        let unknown = answer(&monitor, from_here("GET", "/health"));
        assert!(unknown.status == 404 && unknown.body.contains("/readyz"), "{}", unknown.body);
    }
}
