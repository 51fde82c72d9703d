//! Signals: what stands beside the road, and which lanes it speaks to.

use std::collections::BTreeMap;

/// A place with the rotation of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalPose {
    /// The place in metres.
    pub point: nalgebra::Point3<f64>,
    /// Direction of the traffic it addresses, counter-clockwise from east.
    pub heading_rad: f64,
    /// Nose up positive.
    pub pitch_rad: f64,
    /// As the map gives it.
    pub roll_rad: f64,
}

/// One `signal` element, or an object that stands for one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Signal {
    pub(crate) name: String,
    pub(crate) signal_type: String,
    pub(crate) subtype: String,
    pub(crate) country: String,
    pub(crate) unit: String,
    pub(crate) text: String,
    pub(crate) value: f64,
    pub(crate) dynamic: bool,
    pub(crate) road: u32,
    pub(crate) s: f64,
    pub(crate) t: f64,
    pub(crate) z_offset_m: f64,
    pub(crate) heading_offset_rad: f64,
    pub(crate) pitch_rad: f64,
    pub(crate) roll_rad: f64,
    pub(crate) height_m: f64,
    pub(crate) width_m: f64,
    /// `positionInertial`, which replaces the place on the road.
    pub(crate) inertial: Option<SignalPose>,
}

/// To which traffic an orientation speaks when no lanes are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Orientation {
    /// "+": lanes with positive ids.
    Positive = 0,
    /// "-": lanes with negative ids.
    Negative = 1,
    /// Anything else.
    Both = 2,
}

impl Orientation {
    pub(crate) fn from_name(name: &str) -> Self {
        match name {
            "+" => Self::Positive,
            "-" => Self::Negative,
            _ => Self::Both,
        }
    }
}

/// A place on a road where a signal applies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reference {
    pub(crate) signal: String,
    pub(crate) road: u32,
    pub(crate) s: f64,
    pub(crate) t: f64,
    pub(crate) orientation: Orientation,
    /// First and last lane id of each range.
    pub(crate) validities: Vec<[i32; 2]>,
}

/// All signals of a map.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    /// By id; of several definitions the last one holds.
    pub(crate) definitions: BTreeMap<String, Signal>,
    /// In the order of the file.
    pub(crate) references: Vec<Reference>,
    /// In the order of the file.
    pub(crate) controllers: Vec<Controller>,
}

/// One `controller` element of the map: signals that change together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Controller {
    pub(crate) id: String,
    /// Ids of its signals.
    pub(crate) signals: Vec<String>,
}

/// Whether a type is one of those the client takes for traffic lights.
pub(crate) fn is_traffic_light(signal_type: &str) -> bool {
    match signal_type {
        "F" | "W" | "A" => true,
        number => number
            .parse::<u32>()
            .is_ok_and(|number| matches!(number, 1_000_001 | 1_000_002 | 1_000_007..=1_000_020)),
    }
}
