//! Pages for people; self-contained, so that they work without the internet.

/// The front page.
pub(super) const INDEX: &str = include_str!("pages/index.html");
/// The endpoints, drawn from `/openapi.json`.
pub(super) const API: &str = include_str!("pages/api.html");
