//! Which of CARLA's clients an endpoint serves. They speak nearly the same: what differs in what
//! they are told is here, and what differs in what they send is told apart by its number of fields.
//!
//! **Source:** the packages `carla` 0.9.16 and `carla-ue5-api` 0.10.0.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use blueprints::AttributeKind;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Bytes of the number of a sensor, with which every payload begins.
const NUMBER_BYTES: usize = 8;
/// Sensors that clients of 0.10 do not know.
const ONLY_OLD: [&str; 3] =
    ["sensor.camera.cosmos_visualization", "sensor.other.v2x", "sensor.other.v2x_custom"];

/// The version of the clients that an endpoint serves. A client's first calls do not tell it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ClientVersion {
    /// Of CARLA 0.9.16, on Unreal Engine 4.
    #[default]
    V0_9,
    /// Of CARLA 0.10.0, on Unreal Engine 5.
    V0_10,
}

impl ClientVersion {
    /// As the client compares it with its own.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::V0_9 => "0.9.16",
            Self::V0_10 => "0.10.0",
        }
    }

    /// As it is typed behind a port.
    pub(crate) fn short(self) -> &'static str {
        match self {
            Self::V0_9 => "0.9",
            Self::V0_10 => "0.10",
        }
    }

    /// The other one.
    pub(crate) fn other(self) -> Self {
        match self {
            Self::V0_9 => Self::V0_10,
            Self::V0_10 => Self::V0_9,
        }
    }

    /// Whether programs learn why a call is refused: their exception says `std::exception` on 0.10.
    pub(crate) fn tells_refusals(self) -> bool {
        self == Self::V0_9
    }

    /// Whether clients can read what a blueprint sends.
    pub(crate) fn knows(self, blueprint: &str) -> bool {
        self == Self::V0_9 || !ONLY_OLD.contains(&blueprint)
    }

    /// Whether clients know some vehicles by other ids than those of 0.9.16, and by those, too.
    pub(crate) fn renames_vehicles(self) -> bool {
        self == Self::V0_10
    }

    /// CARLA's number of a kind of attribute.
    pub(crate) fn attribute_kind(self, kind: AttributeKind) -> u8 {
        let from_zero = match kind {
            AttributeKind::Bool => 0,
            AttributeKind::Int => 1,
            AttributeKind::Float => 2,
            AttributeKind::String => 3,
            AttributeKind::Colour => 4,
        };
        match self {
            Self::V0_9 => from_zero + 1,
            Self::V0_10 => from_zero,
        }
    }

    /// A payload as clients read it, whose sensor has its number of 0.9.16; `None` for that of a
    /// sensor that they do not know, which would end them. The numbers are places in a list of
    /// sensors, from which 0.10 lacks the cosmos camera before the world observer, and V2X at its
    /// end.
    pub(crate) fn payload(self, mut payload: Vec<u8>) -> Option<Vec<u8>> {
        if self == Self::V0_9 {
            return Some(payload);
        }
        let number = payload.first_chunk_mut::<NUMBER_BYTES>()?;
        let told = match u64::from_le_bytes(*number) {
            same @ 0..=15 => same,
            later @ 17..=19 => later - 1,
            _ => return None,
        };
        *number = told.to_le_bytes();
        Some(payload)
    }
}

impl FromStr for ClientVersion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "0.9" | "0.9.16" => Ok(Self::V0_9),
            "0.10" | "0.10.0" => Ok(Self::V0_10),
            _ => Err(format!("wanted a client's version, 0.9 or 0.10, found {text:?}")),
        }
    }
}

impl fmt::Display for ClientVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.short())
    }
}

/// What either client sends for the same thing.
#[derive(Debug)]
pub(super) enum Either<Old, New> {
    Old(Old),
    New(New),
}

/// Reads what clients of 0.10 send with `new_fields`, and others with `old_fields`.
pub(super) fn either<'de, D: Deserializer<'de>, Old: Deserialize<'de>, New: Deserialize<'de>>(
    deserializer: D,
    old_fields: usize,
    new_fields: usize,
) -> Result<Either<Old, New>, D::Error> {
    let fields = Fields { old_fields, new_fields, forms: PhantomData };
    deserializer.deserialize_tuple(old_fields, fields)
}

struct Fields<Old, New> {
    old_fields: usize,
    new_fields: usize,
    forms: PhantomData<(Old, New)>,
}

impl<'de, Old: Deserialize<'de>, New: Deserialize<'de>> Visitor<'de> for Fields<Old, New> {
    type Value = Either<Old, New>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} or {} fields", self.old_fields, self.new_fields)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, fields: A) -> Result<Self::Value, A::Error> {
        let is_new = fields.size_hint() == Some(self.new_fields);
        let fields = SeqAccessDeserializer::new(fields);
        if is_new {
            New::deserialize(fields).map(Either::New)
        } else {
            Old::deserialize(fields).map(Either::Old)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(number: u64) -> Vec<u8> {
        number.to_le_bytes().into_iter().chain([7]).collect()
    }

    #[test]
    fn a_payload_has_the_number_that_its_reader_has_for_the_sensor() {
        let told = |version: ClientVersion, number| version.payload(numbered(number));
        for number in 0..=21 {
            assert_eq!(told(ClientVersion::V0_9, number), Some(numbered(number)));
        }
        for number in 0..=15 {
            assert_eq!(told(ClientVersion::V0_10, number), Some(numbered(number)));
        }
        assert_eq!(told(ClientVersion::V0_10, 17), Some(numbered(16)));
        assert_eq!(told(ClientVersion::V0_10, 18), Some(numbered(17)));
        for unknown in [16, 20, 21] {
            assert_eq!(told(ClientVersion::V0_10, unknown), None);
        }
    }

    #[test]
    fn versions_are_typed_short_or_whole() {
        let parsed = |text: &str| text.parse::<ClientVersion>();
        assert_eq!(parsed("0.10"), parsed("0.10.0"));
        for version in [ClientVersion::V0_9, ClientVersion::V0_10] {
            assert_eq!(parsed(version.name()), Ok(version));
            assert_eq!(parsed(&version.to_string()), Ok(version));
            assert_ne!(version.other(), version);
        }
        for wrong in ["", "0", "0.1", "0.11", "10"] {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }
}
