//! What every call does. The table names all calls of CARLA's client and the function of each;
//! `docs/carla-compatibility.md` repeats it, and a test compares the two.

mod actor;
mod batch;
mod content;
mod debug;
mod lamps;
mod lights;
mod map;
mod method;
mod orders;
mod paint;
mod parts;
mod recorder;
mod scenery;
mod sensor;
mod session;
mod table;
mod vehicle;
mod walker;

use crate::endpoint::Endpoint;
use crate::rpc::{Answer, Refusal, Request};

/// Answers one call.
pub(crate) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match table::find(&request.method) {
        Some(method) => method.answer(endpoint, request).await,
        None => Err(Refusal(format!("this server knows no call {:?}", request.method))),
    }
}

/// Names of the calls that never come here, as the [lobby](crate::lobby) answers them.
#[cfg(test)]
pub(crate) fn left_to_the_lobby() -> impl Iterator<Item = &'static str> {
    table::all()
        .filter(|method| matches!(method.service, method::Service::ByLobby))
        .map(|method| method.name)
}

#[cfg(test)]
mod tests;
