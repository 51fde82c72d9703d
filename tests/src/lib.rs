//! Whole-system tests: real processes on private ports, one file per promise.
//!
//! This library is their harness. A [`Site`] is `causeway up` with everything it starts; a
//! [`Session`] is one WebSocket client; a [`Probe`] looks at its bus. Everything has a deadline,
//! says what it last saw when the deadline passes, and is gone when its value is dropped.
#![allow(clippy::unwrap_used, reason = "a panic of the harness is a failed test, which is its job")]
#![allow(clippy::missing_panics_doc, reason = "everything here panics when a promise is broken")]

mod http;
mod probe;
mod process;
mod session;
mod site;
mod wait;

pub use http::get;
pub use probe::Probe;
pub use process::{Process, is_running};
pub use rustix::process::Signal;
pub use session::Session;
pub use site::{Service, Site};
pub use wait::eventually;

use std::time::Duration;

/// For what takes milliseconds when it works, on a busy machine.
pub const SOON: Duration = Duration::from_secs(30);
/// For what a person would call stuck.
pub const AT_LAST: Duration = Duration::from_secs(90);
