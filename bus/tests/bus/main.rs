//! The bus between two places in one process. One binary, as each links all of Zenoh.
#![allow(clippy::unwrap_used, reason = "the helpers of tests are tests")]

mod channels;
mod common;
mod draining;
mod frames;
mod hostile;
mod presence;
mod renderers;
mod requests;
mod routers;
mod shortcuts;
