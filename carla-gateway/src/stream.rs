//! Streams from the server to its clients: the world observer and every sensor.

mod hub;
mod server;
mod token;

pub(crate) use hub::Hub;
pub(crate) use server::{seats, serve};
pub(crate) use token::{StreamId, WORLD_OBSERVER, token};
