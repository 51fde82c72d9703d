//! What the writer of a log meant: numbers and sizes changed between versions without telling.

use crate::bytes::{Layout, Malformed};
use crate::packet::{Kind, Packet};

/// Bytes of the count of a packet.
const COUNT_BYTES: usize = 2;
/// Bytes of one position of UE5.
const WIDE_POSITION_BYTES: usize = 52;

/// What is known of the one who wrote a log.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dialect {
    version: u16,
    /// Doors have id 21, wheels 22 and bikers 23: builds of November 2023 to March 2025, and UE5.
    doors_come_first: bool,
    /// Vectors of double precision: UE5.
    is_wide: bool,
}

impl Dialect {
    pub(crate) fn of_version(version: u16) -> Self {
        Self { version, doors_come_first: false, is_wide: false }
    }

    /// What a packet is about; learns from where it stands in the frame.
    pub(crate) fn kind(&mut self, id: u8, is_before_positions: bool) -> Kind {
        if self.version > 1 {
            return Kind::of_id(id);
        }
        // CARLA writes doors before positions and wheels after them.
        if id == Kind::Wheels.id() && is_before_positions {
            self.doors_come_first = true;
        }
        match (Kind::of_id(id), self.doors_come_first) {
            (Kind::Wheels, true) => Kind::Doors,
            (Kind::Bikers, true) => Kind::Wheels,
            (Kind::Doors, true) => Kind::Bikers,
            (kind, _) => kind,
        }
    }

    /// Learns from a packet whether vectors are wide.
    pub(crate) fn note(&mut self, kind: Kind, body: &[u8]) {
        if self.version > 1 || self.is_wide {
            return;
        }
        self.is_wide = match kind {
            Kind::Positions => {
                let count = body.first_chunk().map_or(0, |count| u16::from_le_bytes(*count));
                let bytes = COUNT_BYTES + WIDE_POSITION_BYTES * usize::from(count);
                count > 0 && body.len() == bytes
            }
            Kind::Adds => {
                let uses_up = |wide_vectors| {
                    let layout = Layout { wide_vectors, ..self.layout() };
                    matches!(Packet::decode(kind, body, layout), Ok((_, 0)))
                };
                !uses_up(false) && uses_up(true)
            }
            _ => false,
        };
    }

    pub(crate) fn layout(&self) -> Layout {
        Layout {
            wide_vectors: self.is_wide,
            short_wheels: false,
            types_from_zero: self.version <= 1,
        }
    }
}

/// Reads one packet, and tells how many bytes of it follow the last record.
///
/// Physics of UE5 has another content and is passed on unread.
pub(crate) fn decode(
    kind: Kind,
    body: &[u8],
    layout: Layout,
) -> Result<(Packet, usize), Malformed> {
    match kind {
        Kind::Physics if layout.wide_vectors => Ok((Packet::Foreign(kind.id(), body.to_vec()), 0)),
        Kind::Physics => match Packet::decode(kind, body, layout) {
            Ok((packet, 0)) => Ok((packet, 0)),
            long => {
                let short = Layout { short_wheels: true, ..layout };
                match Packet::decode(kind, body, short) {
                    Ok((packet, 0)) => Ok((packet, 0)),
                    _ => long,
                }
            }
        },
        _ => Packet::decode(kind, body, layout),
    }
}
