//! Cuts lanes into quads: the common base of all road meshes.

use nalgebra::Point3;

use crate::lanes::{lateral, lateral_point};
use crate::model::{Road, Section};

/// Longest quad on a straight road, in metres.
const STRAIGHT_STEP_M: f64 = 50.0;
/// Largest turn within one quad, in radians.
const TURN_STEP_RAD: f64 = 0.1;

/// Road coordinates at which a section is cut, both ends included.
pub(super) fn cuts(road: &Road, section: &Section) -> Vec<f64> {
    let length_m = section.end_s - section.start_s;
    let turned_rad = (0..8)
        .map(|eighth| {
            let at = |k: i32| road.reference(section.start_s + length_m * f64::from(k) / 8.0);
            (at(eighth + 1).heading_rad - at(eighth).heading_rad).abs()
        })
        .fold(0.0, f64::max)
        * 8.0;
    let bends = road.elevation.is_linear()
        && section.lanes.iter().all(|lane| lane.width.is_linear())
        && road.lane_offset.is_linear();
    let step_m = if bends { STRAIGHT_STEP_M } else { 2.0 };
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "lengths are limited to a million metres"
    )]
    let count = (length_m / step_m).max(turned_rad / TURN_STEP_RAD).ceil().clamp(1.0, 1e6) as usize;
    (0..=count).map(|k| section.start_s + length_m * k as f64 / count as f64).collect()
}

/// Inner and outer border of a lane at `s`, at a height above the road.
pub(super) fn borders(
    road: &Road,
    section: &Section,
    lane: i32,
    s: f64,
    height_m: f64,
) -> [Point3<f64>; 2] {
    let lateral = lateral(road, section, lane, s);
    [lateral.inner, lateral.outer].map(|t| lateral_point(road, s, t, height_m))
}
