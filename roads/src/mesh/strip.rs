//! Cuts roads into quads: the common base of all road meshes.

use nalgebra::Point3;

use crate::lanes::lateral_point;
use crate::model::{Road, Section};

/// Longest quad on a straight, evenly sloped road, in metres.
const STRAIGHT_STEP_M: f64 = 50.0;
/// Longest quad where a width, an offset or a grade bends, in metres.
const BENDING_STEP_M: f64 = 2.0;
/// How far an edge may cut a bend short, in metres.
const SAGITTA_MAX_M: f64 = 0.02;
/// Largest turn within one quad, in radians.
const TURN_STEP_RAD: f64 = 0.16;
/// Parts in which a piece is searched for its sharpest turn.
const TURN_SAMPLES: u32 = 4;

/// Road coordinates at which a section is cut, both ends included.
pub(crate) fn cuts(road: &Road, section: &Section) -> Vec<f64> {
    let widths = section.lanes.iter().flat_map(|lane| &lane.width.0);
    let records = road.elevation.0.iter().chain(&road.lane_offset.0).chain(widths);
    // Straight pieces change direction or grade at their borders, so these are always cut.
    let mut borders: Vec<f64> = road
        .geometries
        .iter()
        .map(|geometry| geometry.start_s)
        .chain(records.map(|record| record.start_s))
        .filter(|s| *s > section.start_s && *s < section.end_s)
        .chain([section.start_s, section.end_s])
        .collect();
    borders.sort_by(f64::total_cmp);
    borders.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    let straight = road.elevation.is_linear()
        && road.lane_offset.is_linear()
        && section.lanes.iter().all(|lane| lane.width.is_linear());
    let step_m = if straight { STRAIGHT_STEP_M } else { BENDING_STEP_M };
    let mut cuts: Vec<f64> = Vec::new();
    for pair in borders.windows(2) {
        if let [from_s, to_s] = pair {
            cut_piece(road, [*from_s, *to_s], step_m, &mut cuts);
        }
    }
    cuts.push(section.end_s);
    cuts
}

/// Adds the cuts of one piece but for its end.
fn cut_piece(road: &Road, [from_s, to_s]: [f64; 2], step_m: f64, cuts: &mut Vec<f64>) {
    let length_m = to_s - from_s;
    // The end belongs to the next piece, which may point elsewhere.
    let heading = |k: u32| {
        let share = f64::from(k) / f64::from(TURN_SAMPLES);
        road.reference(from_s + (length_m - 1e-6) * share).heading_rad
    };
    let sharpest_rad =
        (0..TURN_SAMPLES).map(|k| (heading(k + 1) - heading(k)).abs()).fold(0.0, f64::max);
    let turn_rad = sharpest_rad * f64::from(TURN_SAMPLES);
    // A chord of length c on a bend of curvature k lies c² k / 8 inside of it.
    let by_sagitta = (turn_rad * length_m / (8.0 * SAGITTA_MAX_M)).sqrt();
    let by_turn = by_sagitta.max(turn_rad / TURN_STEP_RAD);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the value is clamped to a positive range before the conversion"
    )]
    let count = (length_m / step_m).max(by_turn).ceil().clamp(1.0, 1e6) as usize;
    cuts.extend((0..count).map(|k| from_s + length_m * k as f64 / count as f64));
}

/// The stretches between cuts. Each ends just before the next begins, for at a cut the road may
/// jump: a record of the lane offset, for example, may move all lanes where a section ends.
pub(crate) fn pieces(cuts: &[f64]) -> impl Iterator<Item = [f64; 2]> {
    const END_GAP_M: f64 = 1e-7;
    cuts.windows(2).filter_map(|pair| Some([*pair.first()?, pair.last()? - END_GAP_M]))
}

/// The points at two lateral places, at a height above the road.
pub(super) fn across(road: &Road, s: f64, t: [f64; 2], height_m: f64) -> [Point3<f64>; 2] {
    t.map(|t| lateral_point(road, s, t, height_m))
}
