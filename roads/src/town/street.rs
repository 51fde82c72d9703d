//! Streets between junctions.

use super::course::course;
use super::draft::{LaneDraft, LaneKind, LinkTo, Rise, RoadDraft, SectionDraft};
use super::junction::junction_id;
use super::plan::{Plan, Street};
use super::profile::Profile;

/// Distance of parking and bicycle lanes from junctions, in metres.
const EXTRA_GAP_M: f64 = 20.0;
/// Length over which they open and close, in metres.
const TAPER_M: f64 = 10.0;
/// Shorter streets have none, in metres.
const EXTRA_STREET_MIN_M: f64 = 90.0;
/// Heights that differ by less are the same, in metres.
const LEVEL_M: f64 = 1e-9;

/// The road of one street.
pub(super) fn road(plan: &Plan, street: &Street) -> RoadDraft {
    let (start, end) = (plan.start(&street.from), plan.start(&street.to).reversed());
    let pieces = course(start, &street.bends, end);
    let length_m = pieces.iter().map(|piece| piece.length_m).sum();
    RoadDraft {
        id: street.id,
        junction: None,
        limit_kmh: street.profile.limit_kmh,
        predecessor: LinkTo::Junction(junction_id(street.from.node)),
        successor: LinkTo::Junction(junction_id(street.to.node)),
        pieces,
        rises: rises(plan, street, length_m),
        centre_line: true,
        sections: sections(street.profile, length_m),
        objects: Vec::new(),
        signals: Vec::new(),
        held_by: None,
    }
}

/// Where the extra lane has its full width: from, to.
pub(super) fn extra_range(profile: Profile, length_m: f64) -> Option<[f64; 2]> {
    let extra = profile.right.extra.or(profile.left.and_then(|left| left.extra));
    let from = EXTRA_GAP_M + TAPER_M;
    (extra.is_some() && length_m >= EXTRA_STREET_MIN_M).then_some([from, length_m - from])
}

/// How an extra lane is in one section: its share of the full width at both ends.
type Opening = Option<[f64; 2]>;

fn sections(profile: Profile, length_m: f64) -> Vec<SectionDraft> {
    let layout: Vec<(f64, f64, Opening)> = match extra_range(profile, length_m) {
        None => vec![(0.0, length_m, None)],
        Some([from, to]) => vec![
            (0.0, from - TAPER_M, None),
            (from - TAPER_M, from, Some([0.0, 1.0])),
            (from, to, Some([1.0, 1.0])),
            (to, to + TAPER_M, Some([1.0, 0.0])),
            (to + TAPER_M, length_m, None),
        ],
    };
    let opening = |index: usize| layout.get(index).map(|(_, _, opening)| *opening);
    layout
        .iter()
        .enumerate()
        .map(|(index, (start_s, end_s, open))| {
            let neighbours = [index.checked_sub(1).and_then(opening), opening(index + 1)];
            let lanes = [1, -1].map(|sign| side(profile, sign, *open, neighbours));
            SectionDraft { start_s: *start_s, length_m: end_s - start_s, lanes: lanes.concat() }
        })
        .collect()
}

/// The lanes of one side of a section, from the middle outward, with links to the sections beside
/// it.
fn side(
    profile: Profile,
    sign: i32,
    open: Opening,
    neighbours: [Option<Opening>; 2],
) -> Vec<LaneDraft> {
    let Some(side) = profile.side(sign) else { return Vec::new() };
    let lanes = side.lanes(open.is_some());
    (1..)
        .zip(lanes)
        .map(|(number, (kind, width_m, line))| {
            let is_extra = matches!(kind, LaneKind::Parking | LaneKind::Biking);
            let share = if is_extra { open.unwrap_or([1.0; 2]) } else { [1.0; 2] };
            // The lane of the same kind beyond: outside of the extra lane, numbers shift.
            let link = |beyond: Option<Opening>, share_there: f64| {
                let beyond = beyond?;
                let outside = number > side.driving && !is_extra && side.extra.is_some();
                let shift = i32::from(beyond.is_some()) - i32::from(open.is_some());
                let ends = is_extra && (beyond.is_none() || share_there == 0.0);
                (!ends).then_some(sign * (number + if outside { shift } else { 0 }))
            };
            LaneDraft {
                id: sign * number,
                kind,
                width_m: share.map(|share| share * width_m),
                line,
                predecessor: link(neighbours[0], share[0]),
                successor: link(neighbours[1], share[1]),
            }
        })
        .collect()
}

/// Smooth cubics from height to height, level at each of them.
fn rises(plan: &Plan, street: &Street, length_m: f64) -> Vec<Rise> {
    let mut points = vec![[0.0, plan.height_m(street.from.node)]];
    points.extend(street.heights.iter().map(|[share, height_m]| [share * length_m, *height_m]));
    points.push([length_m, plan.height_m(street.to.node)]);
    if points.iter().all(|[_, height_m]| (height_m - points[0][1]).abs() < LEVEL_M) {
        return vec![Rise { start_s: 0.0, abcd: [points[0][1], 0.0, 0.0, 0.0] }];
    }
    points
        .windows(2)
        .filter_map(|pair| {
            let [[from_s, from_m], [to_s, to_m]] = pair else { return None };
            let (run_m, rise_m) = (to_s - from_s, to_m - from_m);
            let c = 3.0 * rise_m / (run_m * run_m);
            let d = -2.0 * rise_m / (run_m * run_m * run_m);
            Some(Rise { start_s: *from_s, abcd: [*from_m, 0.0, c, d] })
        })
        .collect()
}
