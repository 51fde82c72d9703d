//! The OpenEnv face: HTTP and WebSocket on one port, a translation layer over sessions.

mod access;
mod body;
pub(crate) mod coerce;
mod docs;
mod envelope;
mod http;
mod http_errors;
mod json;
mod line;
mod mcp;
mod openapi;
mod origin;
mod reply;
mod schema;
mod serving;
mod snapshots;
mod tasks;
mod ui;
mod web;
mod ws;

use std::sync::Arc;

use tenancy::Door;

pub(crate) use origin::OriginRule;
pub(crate) use serving::{Bounds, serve};
pub(crate) use web::WebSessions;

use crate::session::table::Sessions;

/// Which endpoints there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mode {
    /// All of them.
    #[default]
    Simulation,
    /// Without the HTTP endpoints that control an episode; `/ws` stays.
    Production,
}

impl Mode {
    /// The inverse of the word on the command line.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        match text {
            "simulation" => Some(Self::Simulation),
            "production" => Some(Self::Production),
            _ => None,
        }
    }
}

/// What every request can reach.
pub(crate) struct Face {
    /// All sessions.
    pub(crate) sessions: Arc<Sessions>,
    /// Which endpoints there are.
    pub(crate) mode: Mode,
    /// Where the web interface is on.
    pub(crate) web: Option<WebSessions>,
    /// Who may come in.
    pub(crate) door: Arc<Door>,
    /// Whose web pages are served.
    pub(crate) origins: OriginRule,
}

#[cfg(test)]
mod tests;
