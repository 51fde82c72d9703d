//! What services say of themselves.

use flatbuffers::FlatBufferBuilder;

use super::parts::{service_kind_in, service_kind_out};
use super::{Kind, root};
use crate::generated as fb;
use crate::{Alive, Error, ErrorCode};

const ALIVE: Kind =
    Kind { name: "liveliness message", identifier: fb::ALIVE_IDENTIFIER, bytes_max: 64 * 1024 };

/// A liveliness message as bytes.
pub fn encode_alive(alive: &Alive) -> Vec<u8> {
    let mut builder = FlatBufferBuilder::new();
    let id = builder.create_string(alive.id.as_str());
    let version = builder.create_string(&alive.version);
    let detail = builder.create_string(&alive.detail);
    let root = fb::Alive::create(
        &mut builder,
        &fb::AliveArgs {
            kind: service_kind_out(alive.kind),
            id: Some(id),
            version: Some(version),
            pid: alive.pid,
            capacity: alive.capacity,
            detail: Some(detail),
        },
    );
    builder.finish(root, Some(ALIVE.identifier));
    builder.finished_data().to_vec()
}

/// The liveliness message in these bytes.
///
/// # Errors
/// [`ErrorCode::TooLarge`] and [`ErrorCode::InvalidMessage`].
pub fn decode_alive(bytes: &[u8]) -> Result<Alive, Error> {
    let raw = root::<fb::Alive>(&ALIVE, bytes)?;
    Ok(Alive {
        kind: service_kind_in(raw.kind())?,
        id: raw
            .id()
            .parse()
            .map_err(|cause| Error::new(ErrorCode::InvalidMessage, format!("id: {cause}")))?,
        version: raw.version().to_owned(),
        pid: raw.pid(),
        capacity: raw.capacity(),
        detail: raw.detail().to_owned(),
    })
}
