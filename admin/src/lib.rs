//! What watches over a process asks here, over HTTP: is it started, does it live, is it ready, what
//! are its figures; and tells it to take no new work.
//!
//! | request | 200 when | otherwise |
//! |---|---|---|
//! | `GET /startupz` | it has started | 503 |
//! | `GET /livez` | every loop waits for work or has turned within [`monitoring::STUCK_AFTER`] | 503 and the loop |
//! | `GET /readyz` | it takes new work | 503 and the first reason why not |
//! | `GET /metrics` | always: OpenMetrics text | |
//! | `POST /drain` | from this machine: it takes no new work from now on | 403 |
//! | `POST /undrain` | from this machine: it takes new work again | 403, or 409 when it is ending |
//!
//! [`serve`] answers on a thread of its own, so that it answers also when everything else in the
//! process stands still. [`ask`] is the other side, for images that have no other HTTP client.

mod address;
mod answer;
mod client;
mod process;
mod server;

pub use address::{PORT, address};
pub use client::{AskError, Told, ask};
pub use server::serve;
