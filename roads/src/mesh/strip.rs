//! Cuts roads into quads: the common base of all road meshes.

use nalgebra::Point3;

use crate::geometry::Shape;
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
    let step_m = step_m(road, section);
    let mut cuts: Vec<f64> = Vec::new();
    for pair in borders(road, section).windows(2) {
        if let [from_s, to_s] = pair {
            cut_piece(road, [*from_s, *to_s], step_m, &mut cuts);
        }
    }
    cuts.push(section.end_s);
    cuts
}

/// No fewer than the pieces that [`cuts`] makes of a section, without making them.
pub(crate) fn cuts_max(road: &Road, section: &Section) -> f64 {
    let (from_s, to_s) = (section.start_s, section.end_s);
    let first = road.geometries.partition_point(|geometry| geometry.start_s <= from_s);
    let inside = road.geometries.iter().skip(first.saturating_sub(1));
    let bends = inside.take_while(|geometry| geometry.start_s < to_s).map(|geometry| {
        let end_s = geometry.start_s + geometry.length_m;
        let inside_m = (to_s.min(end_s) - from_s.max(geometry.start_s)).max(0.0);
        let turn_rad = match geometry.shape {
            // All of it may turn within any part, and the sharpest turn counts for the others.
            Shape::Polynomial(_) => f64::from(TURN_SAMPLES) * geometry.turn_max_rad(),
            _ => geometry.turn_max_rad() * inside_m / geometry.length_m,
        };
        by_turn(turn_rad, inside_m)
    });
    let by_length = (to_s - from_s) / step_m(road, section);
    borders(road, section).len() as f64 + by_length + bends.sum::<f64>()
}

/// Where records and geometries begin, and both ends: straight pieces change direction or grade
/// there, so the mesh is always cut.
fn borders(road: &Road, section: &Section) -> Vec<f64> {
    let (from_s, to_s) = (section.start_s, section.end_s);
    let widths = section.lanes.iter().map(|lane| &lane.width);
    let profiles = widths.chain([&road.elevation, &road.lane_offset]);
    let mut borders = vec![from_s, to_s];
    borders.extend(profiles.flat_map(|profile| profile.starts_within(from_s, to_s)));
    let first = road.geometries.partition_point(|geometry| geometry.start_s <= from_s);
    let later = road.geometries.iter().skip(first).map(|geometry| geometry.start_s);
    borders.extend(later.take_while(|s| *s < to_s));
    borders.sort_by(f64::total_cmp);
    borders.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    borders
}

/// Longest quad of a section.
fn step_m(road: &Road, section: &Section) -> f64 {
    let straight = road.level.is_none()
        && road.elevation.is_linear()
        && road.lane_offset.is_linear()
        && section.lanes.iter().all(|lane| lane.width.is_linear());
    if straight { STRAIGHT_STEP_M } else { BENDING_STEP_M }
}

/// Pieces of a bend that keep near enough to it.
fn by_turn(turn_rad: f64, length_m: f64) -> f64 {
    // A chord of length c on a bend of curvature k lies c² k / 8 inside of it.
    let by_sagitta = (turn_rad * length_m / (8.0 * SAGITTA_MAX_M)).sqrt();
    by_sagitta.max(turn_rad / TURN_STEP_RAD)
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
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the value is clamped to a positive range before the conversion"
    )]
    let count =
        (length_m / step_m).max(by_turn(turn_rad, length_m)).ceil().clamp(1.0, 1e6) as usize;
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
