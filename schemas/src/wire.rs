//! FlatBuffers in and out: bytes → size check → verifier with our limits → domain types.
//!
//! The only module that sees generated code. What it returns needs no further checks of form: ids
//! are not zero, numbers are finite, quaternions are unit, counts are within
//! [`limits`](crate::limits). What a value means (does the actor exist, is the blueprint known) is
//! the receiver's business.

mod agent;
mod alive;
mod camera;
mod command;
mod description;
mod frame;
mod paint;
mod parts;
mod reply;
mod request;
mod scenery;
mod sensor;
mod staging;
mod v2x;
mod vehicle;
mod walker_pose;

pub use alive::{decode_alive, decode_load, encode_alive, encode_load};
pub use camera::{decode_render_job, encode_render_job};
pub use frame::{decode_frame, encode_frame};
pub use reply::{decode_reply, encode_reply};
pub use request::{check_command, decode_request, encode_request};

use flatbuffers::{Follow, Verifiable, VerifierOptions};

use crate::limits::{TABLE_COUNT_MAX, TABLE_DEPTH_MAX};
use crate::{Error, ErrorCode};

/// One kind of message: its name for people, its file identifier, its largest size.
struct Kind {
    name: &'static str,
    identifier: &'static str,
    bytes_max: usize,
}

/// The verified root table of `bytes`.
fn root<'a, T>(kind: &Kind, bytes: &'a [u8]) -> Result<T::Inner, Error>
where
    T: Follow<'a> + Verifiable + 'a,
{
    if bytes.len() > kind.bytes_max {
        return Err(Error::new(ErrorCode::TooLarge, format!("the {} is too large", kind.name))
            .wanted(format!("at most {} bytes", kind.bytes_max))
            .found(format!("{} bytes", bytes.len())));
    }
    // Below 8 bytes there is no identifier to look at.
    if bytes.len() < 8 || !flatbuffers::buffer_has_identifier(bytes, kind.identifier, false) {
        let found = bytes.get(4..8).unwrap_or(bytes);
        return Err(invalid(kind)
            .wanted(format!("file identifier {}", kind.identifier))
            .found(format!("{:?}", String::from_utf8_lossy(found))));
    }
    let options = VerifierOptions {
        max_depth: TABLE_DEPTH_MAX,
        max_tables: TABLE_COUNT_MAX,
        max_apparent_size: kind.bytes_max.saturating_mul(2),
        ignore_missing_null_terminator: false,
    };
    flatbuffers::root_with_opts::<T>(&options, bytes)
        .map_err(|cause| invalid(kind).wanted("a valid FlatBuffer").found(cause))
}

fn invalid(kind: &Kind) -> Error {
    Error::new(ErrorCode::InvalidMessage, format!("these bytes are no {}", kind.name))
}

/// A field that the schema makes optional but the message needs.
fn needed<T>(value: Option<T>, field: &'static str) -> Result<T, Error> {
    value.ok_or_else(|| {
        Error::new(ErrorCode::InvalidMessage, format!("{field} is missing")).wanted(field)
    })
}

fn check_count(what: &'static str, count: usize, count_max: usize) -> Result<(), Error> {
    if count <= count_max {
        return Ok(());
    }
    Err(Error::new(ErrorCode::TooLarge, format!("too many {what}"))
        .wanted(format!("at most {count_max}"))
        .found(count))
}
