//! A place on a lane and what is known about the lane there.

use serde::{Deserialize, Serialize};

use crate::kinds::{LaneChange, LaneType, MarkColor, MarkType};

/// A place on a lane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Waypoint {
    /// OpenDRIVE road id.
    pub road: u32,
    /// Position of the lane section in its road, from 0.
    pub section: u32,
    /// OpenDRIVE lane id: positive left of the reference line, negative right of it.
    pub lane: i32,
    /// Road coordinate in metres; it grows along the reference line, also for lanes that run
    /// against it.
    pub s: f64,
}

/// A painted line beside a lane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaneMark {
    /// How it looks.
    pub mark_type: MarkType,
    /// Its paint.
    pub color: MarkColor,
    /// Its own permission to cross it.
    pub lane_change: LaneChange,
    /// Width of the paint in metres.
    pub width_m: f64,
}

/// What is known about a lane at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaneInfo {
    /// What the lane is for.
    pub lane_type: LaneType,
    /// Width in metres.
    pub width_m: f64,
    /// Whether traffic of the road keeps to the right.
    pub is_right_hand_traffic: bool,
    /// Whether the road leads through a junction.
    pub is_junction: bool,
    /// That junction.
    pub junction_id: Option<u32>,
    /// Limit of the road's type record in metres per second, where the map has one.
    pub speed_limit_mps: Option<f64>,
    /// The line to the left of the traffic.
    pub left_mark: Option<LaneMark>,
    /// The line to the right of the traffic.
    pub right_mark: Option<LaneMark>,
    /// To which sides traffic may leave the lane.
    pub lane_change: LaneChange,
}
