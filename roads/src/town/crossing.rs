//! Crosswalks in the middle of long streets.

use super::draft::{ObjectDraft, RoadDraft};
use super::junction::CROSSWALK_OVERLAP_M;
use super::plan::Street;
use super::profile::{Edge, Extra, Side};
use super::street::extra_range;

/// Shorter streets are crossed at their ends, in metres.
const STREET_MIN_M: f64 = 100.0;
/// Half of the width of a crosswalk, in metres.
const HALF_M: f64 = 1.5;
/// Posts, trees and benches keep this far away from its middle, in metres.
const CLEAR_M: f64 = 4.0;

/// Paints a crosswalk in the middle of a street with one lane each way, if it is long and straight
/// there, and removes what stands in the walkers' way.
pub(super) fn add(street: &Street, road: &mut RoadDraft) {
    let length_m = road.length_m();
    let middle_s = length_m / 2.0;
    let narrow = |side: Side| side.driving == 1 && side.edge == Edge::Sidewalk;
    let (Some(left), right) = (street.profile.left, street.profile.right) else { return };
    if length_m < STREET_MIN_M || !narrow(left) || !narrow(right) || !is_straight(road, middle_s) {
        return;
    }
    let widened = extra_range(street.profile, length_m).is_some();
    let reach_m = |side: Side| {
        let extra_m = side.extra.filter(|_| widened).map_or(0.0, Extra::width_m);
        side.kerb_m() + extra_m + CROSSWALK_OVERLAP_M
    };
    let (v0, v1) = (-reach_m(right), reach_m(left));
    road.objects.retain(|object| (object.s - middle_s).abs() > CLEAR_M);
    road.objects.push(ObjectDraft {
        object_type: "crosswalk",
        name: "SimpleCrosswalk",
        s: middle_s,
        t: 0.0,
        z_offset_m: 0.0,
        heading_rad: 0.0,
        length_m: v1 - v0,
        width_m: 2.0 * HALF_M,
        height_m: 0.0,
        outline: [[-1.0, v0], [1.0, v0], [1.0, v1], [-1.0, v1], [-1.0, v0]]
            .map(|[side, v]| [side * HALF_M, v])
            .to_vec(),
    });
}

/// Whether the road is straight at `s` and for the clear length around it.
fn is_straight(road: &RoadDraft, s: f64) -> bool {
    let mut start_s = 0.0;
    road.pieces.iter().any(|piece| {
        let range = start_s + CLEAR_M..=start_s + piece.length_m - CLEAR_M;
        start_s += piece.length_m;
        piece.curvature == 0.0 && range.contains(&s)
    })
}
