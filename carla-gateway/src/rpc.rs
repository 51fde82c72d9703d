//! MessagePack-RPC over TCP as CARLA's client speaks it: framing, requests, replies, connections.

mod framing;
mod gate;
mod message;
mod server;

pub(crate) use message::{Answer, Meta, Payload, Refusal, Request};
pub(crate) use server::{Connection, ConnectionId, Desk, serve};
