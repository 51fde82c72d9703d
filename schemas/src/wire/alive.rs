//! What services say of themselves.

use flatbuffers::FlatBufferBuilder;

use super::parts::{service_kind_in, service_kind_out};
use super::{Kind, root};
use crate::generated as fb;
use crate::{Alive, Error, ErrorCode, Load};

const ALIVE: Kind =
    Kind { name: "liveliness message", identifier: fb::ALIVE_IDENTIFIER, bytes_max: 64 * 1024 };
const LOAD: Kind = Kind { name: "load", identifier: fb::LOAD_IDENTIFIER, bytes_max: 64 * 1024 };

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
            number: alive.number,
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
        number: raw.number(),
    })
}

/// A load as bytes.
pub fn encode_load(load: &Load) -> Vec<u8> {
    let mut builder = FlatBufferBuilder::new();
    let Load { worlds, worlds_max, busy } = *load;
    let root = fb::Load::create(&mut builder, &fb::LoadArgs { worlds, worlds_max, busy });
    builder.finish(root, Some(LOAD.identifier));
    builder.finished_data().to_vec()
}

/// The load in these bytes.
///
/// # Errors
/// [`ErrorCode::TooLarge`] and [`ErrorCode::InvalidMessage`].
pub fn decode_load(bytes: &[u8]) -> Result<Load, Error> {
    let raw = root::<fb::Load>(&LOAD, bytes)?;
    let busy = raw.busy();
    if !(0.0..=1.0).contains(&busy) {
        return Err(Error::new(ErrorCode::InvalidMessage, "a load that is no share")
            .wanted("0 to 1")
            .found(busy));
    }
    Ok(Load { worlds: raw.worlds(), worlds_max: raw.worlds_max(), busy })
}
