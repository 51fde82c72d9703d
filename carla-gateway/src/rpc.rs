//! MessagePack-RPC over TCP as CARLA's client speaks it: framing, requests, replies, connections.

mod backlog;
#[cfg(test)]
mod draw;
mod finite;
mod framing;
mod intake;
mod message;
mod server;

#[cfg(test)]
pub(crate) use draw::Draw;
pub(crate) use message::{Answer, ConnectionId, Meta, Payload, Refusal, Request, Ticket};
pub(crate) use server::{CONNECTIONS_MAX, Event, Outbox, serve};
