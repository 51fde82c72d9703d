//! Where a road ends beside a lane.

use roads::LaneType;
use schemas::{Translation3, Vec3};

use crate::scenario::decision::Side;
use crate::scenario::lanes::{Lanes, Place};

/// Nobody drives nearer to a kerb: lanes for cars are wider than 2 m.
const EDGE_M_MIN: f64 = 1.0;
/// Kerbs are no farther from the middle of the lane than this.
const KERB_M_MAX: f64 = 16.0;
/// People stand so far behind the edge of the road.
const BEHIND_M: f64 = 0.8;
/// The least from the middle of a lane to where people begin beside it.
pub(super) const KERB_M_MIN: f64 = EDGE_M_MIN + BEHIND_M;
/// Other carriageways are looked for in such steps.
const STEP_M: f64 = 0.25;
/// Most carriageways that lie beside each other.
const CARRIAGEWAYS_MAX: usize = 4;
/// A road whose lanes lead otherwise by more than this crosses.
const PARALLEL_RAD: f64 = 0.4;
/// Lanes higher or lower than this are another storey's.
const STOREY_M: f32 = 3.0;

/// Where people are beside a road, from the middle of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kerb {
    /// Behind the edge of the road.
    pub stands_m: f64,
    /// Behind the edge of the last lane that is driven on, before shoulders and parked cars.
    pub steps_out_m: f64,
}

/// Where one carriageway ends, from the middle of the lane that it was looked for from.
#[derive(Clone, Copy, Debug)]
struct Edge {
    at_m: f64,
    driven_m: f64,
    /// Whether people walk beyond it.
    has_sidewalk: bool,
}

/// Where people are beside the road of a lane, on a side of its traffic; a carriageway beyond a
/// median is of the same road. `None` where that is too far, or where another road crosses or
/// begins.
pub(super) fn kerb(lanes: Lanes<'_>, over: Place, side: Side) -> Option<Kerb> {
    let mut edge = edge(lanes, over, side);
    for _ in 0..CARRIAGEWAYS_MAX {
        let beyond = Some(edge).filter(|edge| !edge.has_sidewalk);
        let Some(other) = beyond.and_then(|edge| lane_beyond(lanes, over, side, edge.at_m)) else {
            let stands_m = edge.at_m + BEHIND_M;
            let steps_out_m = edge.driven_m + BEHIND_M;
            let fits = steps_out_m >= KERB_M_MIN && stands_m <= KERB_M_MAX;
            return fits.then_some(Kerb { stands_m, steps_out_m });
        };
        let turn_rad = lanes.turn_rad(over, other).abs();
        let along = turn_rad < PARALLEL_RAD;
        if !along && turn_rad < std::f64::consts::PI - PARALLEL_RAD {
            return None;
        }
        let lane_from_other = lanes.pose(over).inverse() * lanes.pose(other);
        let middle_m = -side.sign_right() * f64::from(lane_from_other.translation.y);
        let found = self::edge(lanes, other, if along { side } else { side.opposite() });
        let at_m = middle_m + found.at_m;
        if at_m <= edge.at_m {
            return None;
        }
        edge = Edge { at_m, driven_m: middle_m + found.driven_m, ..found };
    }
    None
}

/// The outer edge of the last lane for vehicles, from the middle of a lane outward. Grass, medians
/// and sidewalks between such lanes are crossed.
fn edge(lanes: Lanes<'_>, from: Place, side: Side) -> Edge {
    let mut at_m = lanes.width_m(from) / 2.0;
    let mut edge = Edge { at_m, driven_m: at_m, has_sidewalk: false };
    let (mut place, mut side) = (from, side);
    while let Some(next) = lanes.beside(place, side) {
        if next.lane.signum() != place.lane.signum() {
            side = side.opposite();
        }
        place = next;
        at_m += lanes.width_m(next);
        match lanes.lane_type(next) {
            LaneType::Sidewalk => edge.has_sidewalk = true,
            LaneType::None | LaneType::Median | LaneType::Border => {}
            LaneType::Shoulder | LaneType::Parking => {
                edge = Edge { at_m, has_sidewalk: false, ..edge };
            }
            _ => edge = Edge { at_m, driven_m: at_m, has_sidewalk: false },
        }
    }
    edge
}

/// The first driving lane beyond the edge of a carriageway, as far as kerbs are looked for.
fn lane_beyond(lanes: Lanes<'_>, over: Place, side: Side, edge_m: f64) -> Option<Place> {
    let world_from_lane = lanes.pose(over);
    let steps = ((KERB_M_MAX - edge_m) / STEP_M).max(0.0) as u32;
    (1..=steps).find_map(|step| {
        let right_m = side.sign_right() * (edge_m + f64::from(step) * STEP_M);
        let beside = world_from_lane * Translation3::new(0.0, -right_m as f32, 0.0);
        let point_m: Vec3 = beside.translation.vector;
        let other = lanes.under(point_m)?;
        let height_m = lanes.pose(other).translation.z - point_m.z;
        (height_m.abs() < STOREY_M).then_some(other)
    })
}

#[cfg(test)]
mod tests;
