//! The kinds of lanes and road marks, with the client library's bits and names.

use serde::{Deserialize, Serialize};

/// What a lane is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u32)]
#[allow(missing_docs, reason = "the names are OpenDRIVE's lane types")]
pub enum LaneType {
    None = 1,
    Driving = 2,
    Stop = 4,
    Shoulder = 8,
    Biking = 16,
    Sidewalk = 32,
    Border = 64,
    Restricted = 128,
    Parking = 256,
    Bidirectional = 512,
    Median = 1024,
    Special1 = 2048,
    Special2 = 4096,
    Special3 = 8192,
    RoadWorks = 16384,
    Tram = 32768,
    Rail = 65536,
    Entry = 131_072,
    Exit = 262_144,
    OffRamp = 524_288,
    OnRamp = 1_048_576,
}

impl LaneType {
    /// The type an OpenDRIVE name stands for, without regard to case; unknown names are none.
    #[must_use]
    pub fn from_name(name: &str) -> Self {
        const NAMES: [(&str, LaneType); 20] = [
            ("driving", LaneType::Driving),
            ("stop", LaneType::Stop),
            ("shoulder", LaneType::Shoulder),
            ("biking", LaneType::Biking),
            ("sidewalk", LaneType::Sidewalk),
            ("border", LaneType::Border),
            ("restricted", LaneType::Restricted),
            ("parking", LaneType::Parking),
            ("bidirectional", LaneType::Bidirectional),
            ("median", LaneType::Median),
            ("special1", LaneType::Special1),
            ("special2", LaneType::Special2),
            ("special3", LaneType::Special3),
            ("roadWorks", LaneType::RoadWorks),
            ("tram", LaneType::Tram),
            ("rail", LaneType::Rail),
            ("entry", LaneType::Entry),
            ("exit", LaneType::Exit),
            ("offRamp", LaneType::OffRamp),
            ("onRamp", LaneType::OnRamp),
        ];
        NAMES
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map_or(Self::None, |(_, lane_type)| *lane_type)
    }
}

/// A set of lane types, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LaneTypes(u32);

impl LaneTypes {
    /// Driving lanes only.
    pub const DRIVING: Self = Self(LaneType::Driving as u32);
    /// Sidewalks only.
    pub const SIDEWALK: Self = Self(LaneType::Sidewalk as u32);
    /// What vehicles, cycles among them, drive, wait and stand on.
    pub(crate) const TRAFFIC: Self = Self(
        LaneType::Driving as u32
            | LaneType::Stop as u32
            | LaneType::Shoulder as u32
            | LaneType::Biking as u32
            | LaneType::Restricted as u32
            | LaneType::Parking as u32
            | LaneType::Bidirectional as u32
            | LaneType::RoadWorks as u32
            | LaneType::Tram as u32
            | LaneType::Entry as u32
            | LaneType::Exit as u32
            | LaneType::OffRamp as u32
            | LaneType::OnRamp as u32,
    );
    /// Every type but [`LaneType::None`].
    pub const ANY: Self = Self(!(LaneType::None as u32));

    /// The set with these bits, as the client library sends them.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The types of both sets.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether the set has this type.
    #[must_use]
    pub const fn contains(self, lane_type: LaneType) -> bool {
        self.0 & lane_type as u32 != 0
    }

    pub(crate) const fn bits(self) -> u32 {
        self.0
    }
}

impl From<LaneType> for LaneTypes {
    fn from(lane_type: LaneType) -> Self {
        Self(lane_type as u32)
    }
}

/// How a painted line looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names are OpenDRIVE's road mark types")]
pub enum MarkType {
    Other = 0,
    Broken = 1,
    Solid = 2,
    SolidSolid = 3,
    SolidBroken = 4,
    BrokenSolid = 5,
    BrokenBroken = 6,
    BottsDots = 7,
    Grass = 8,
    Curb = 9,
    None = 10,
}

impl MarkType {
    /// OpenDRIVE's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Other => "other",
            Self::Broken => "broken",
            Self::Solid => "solid",
            Self::SolidSolid => "solid solid",
            Self::SolidBroken => "solid broken",
            Self::BrokenSolid => "broken solid",
            Self::BrokenBroken => "broken broken",
            Self::BottsDots => "botts dots",
            Self::Grass => "grass",
            Self::Curb => "curb",
            Self::None => "none",
        }
    }

    pub(crate) fn from_name(name: &str) -> Self {
        match name.to_ascii_lowercase().as_str() {
            "broken" => Self::Broken,
            "solid" => Self::Solid,
            "solid solid" => Self::SolidSolid,
            "solid broken" => Self::SolidBroken,
            "broken solid" => Self::BrokenSolid,
            "broken broken" => Self::BrokenBroken,
            "botts dots" => Self::BottsDots,
            "grass" => Self::Grass,
            "curb" => Self::Curb,
            "none" => Self::None,
            _ => Self::Other,
        }
    }
}

/// The paint of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names are OpenDRIVE's colours")]
pub enum MarkColor {
    White = 0,
    Blue = 1,
    Green = 2,
    Red = 3,
    Yellow = 4,
    Other = 5,
}

impl MarkColor {
    pub(crate) fn from_name(name: &str) -> Self {
        match name.to_ascii_lowercase().as_str() {
            "standard" | "white" => Self::White,
            "blue" => Self::Blue,
            "green" => Self::Green,
            "red" => Self::Red,
            "yellow" => Self::Yellow,
            _ => Self::Other,
        }
    }
}

/// To which sides a lane may be left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs, reason = "the sides are what they say")]
pub enum LaneChange {
    None = 0,
    Right = 1,
    Left = 2,
    Both = 3,
}

impl LaneChange {
    pub(crate) const fn from_sides(right: bool, left: bool) -> Self {
        match (right, left) {
            (false, false) => Self::None,
            (true, false) => Self::Right,
            (false, true) => Self::Left,
            (true, true) => Self::Both,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mark_is_found_by_its_name() {
        for mark in [MarkType::Broken, MarkType::SolidSolid, MarkType::BottsDots, MarkType::None] {
            assert_eq!(MarkType::from_name(mark.name()), mark);
        }
    }
}
