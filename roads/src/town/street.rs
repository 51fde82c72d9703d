//! Streets between junctions.

use super::course::{course, length_m};
use super::draft::{Cubic, LaneDraft, LaneKind, LinkTo, RoadDraft, SectionDraft};
use super::junction::junction_id;
use super::plan::{Plan, Street, UNEVEN_M};
use super::profile::Profile;

/// Distances from junctions between which parking and bicycle lanes open and close, in metres. A
/// lane section begins at the second; no whole number of metres leads from it to the street's end,
/// see [`UNEVEN_M`].
const EXTRA_OPENS_M: [f64; 2] = [15.0, 30.0 + UNEVEN_M / 2.0];
/// Distance from junctions at which a lane section begins while they open, in metres: each section
/// has some of their area, which Scenic asks for, and where one meets the next they have a width,
/// without which OpenDRIVE 1.7 forbids a link.
const EXTRA_SECTION_M: f64 = 20.0 + UNEVEN_M / 2.0;
/// Shorter streets have none, in metres.
const EXTRA_STREET_MIN_M: f64 = 90.0;
/// Heights that differ by less are the same, in metres.
const LEVEL_M: f64 = 1e-9;

/// The road of one street.
pub(super) fn road(plan: &Plan, street: &Street) -> RoadDraft {
    let (start, end) = (plan.start(&street.from), plan.start(&street.to).reversed());
    let pieces = course(start, &street.bends, end);
    let length_m = length_m(&pieces);
    RoadDraft {
        id: street.id,
        junction: None,
        limit_kmh: street.profile.limit_kmh,
        predecessor: LinkTo::Junction(junction_id(street.from.node)),
        successor: LinkTo::Junction(junction_id(street.to.node)),
        pieces,
        rises: rises(plan, street, length_m),
        centre_line: street.profile.right.median_m == 0.0,
        sections: sections(street.profile, length_m),
        objects: Vec::new(),
        signals: Vec::new(),
        held_by: None,
    }
}

/// Where the extra lane has its full width: from, to.
pub(super) fn extra_range(profile: Profile, length_m: f64) -> Option<[f64; 2]> {
    let extra = profile.right.extra.or(profile.left.and_then(|left| left.extra));
    let from = EXTRA_OPENS_M[1];
    (extra.is_some() && length_m >= EXTRA_STREET_MIN_M).then_some([from, length_m - from])
}

/// The lane sections of a street. No lane begins or ends within it: where an extra lane has no
/// room, it is carried along without width.
fn sections(profile: Profile, length_m: f64) -> Vec<SectionDraft> {
    let extra = extra_range(profile, length_m);
    let shares = extra.map_or_else(Vec::new, |range| extra_shares(range, length_m));
    let mut bounds = vec![0.0];
    if let Some([from, to]) = extra {
        bounds.extend([EXTRA_SECTION_M, from, to, length_m - EXTRA_SECTION_M]);
    }
    bounds.push(length_m);
    let last = bounds.len() - 2;
    (0..)
        .zip(bounds.windows(2))
        .filter_map(|(index, bounds)| {
            let [start_s, end_s] = *bounds else { return None };
            let shares = between(&shares, [start_s, end_s]);
            let goes_on = [index > 0, index < last];
            let lanes = [1, -1].map(|sign| side(profile, sign, &shares, goes_on));
            Some(SectionDraft { start_s, lanes: lanes.concat() })
        })
        .collect()
}

/// The share of its full width that an extra lane has along a street.
fn extra_shares([from, to]: [f64; 2], length_m: f64) -> Vec<Cubic> {
    let [opens, open] = EXTRA_OPENS_M;
    vec![
        Cubic::flat(0.0, 0.0),
        Cubic::smooth(opens, open - opens, [0.0, 1.0]),
        Cubic::flat(from, 1.0),
        Cubic::smooth(to, open - opens, [1.0, 0.0]),
        Cubic::flat(length_m - opens, 0.0),
    ]
}

/// The part of a curve between two places, which counts from the first of them.
fn between(curve: &[Cubic], [start_s, end_s]: [f64; 2]) -> Vec<Cubic> {
    let ends = curve.iter().skip(1).map(|next| next.start_s).chain([f64::INFINITY]);
    curve
        .iter()
        .zip(ends)
        .filter(|(cubic, ends)| cubic.start_s < end_s && *ends > start_s)
        .map(|(cubic, _)| {
            let told = cubic.told_from(cubic.start_s.max(start_s));
            Cubic { start_s: told.start_s - start_s, ..told }
        })
        .collect()
}

/// The lanes of one side of a section, from the middle outward, with links to the sections before
/// and after it where there are some. Without shares, there is no extra lane.
fn side(profile: Profile, sign: i32, shares: &[Cubic], goes_on: [bool; 2]) -> Vec<LaneDraft> {
    let Some(side) = profile.side(sign) else { return Vec::new() };
    (1..)
        .zip(side.lanes(!shares.is_empty()))
        .map(|(number, (kind, width_m, line))| {
            let id = sign * number;
            let [predecessor, successor] = goes_on.map(|goes_on| goes_on.then_some(id));
            let widths = match kind {
                LaneKind::Parking | LaneKind::Biking => {
                    shares.iter().map(|share| share.times(width_m)).collect()
                }
                _ => vec![Cubic::flat(0.0, width_m)],
            };
            LaneDraft { id, kind, widths, line, predecessor, successor }
        })
        .collect()
}

/// Smooth cubics from height to height, level at both ends.
fn rises(plan: &Plan, street: &Street, length_m: f64) -> Vec<Cubic> {
    let mut points = vec![[0.0, plan.height_m(street.from.node)]];
    points.extend(street.heights.iter().map(|[share, height_m]| [share * length_m, *height_m]));
    points.push([length_m, plan.height_m(street.to.node)]);
    if points.iter().all(|[_, height_m]| (height_m - points[0][1]).abs() < LEVEL_M) {
        return vec![Cubic::flat(0.0, points[0][1])];
    }
    let slopes = if street.climbs_on { slopes(&points) } else { vec![0.0; points.len()] };
    points
        .windows(2)
        .zip(slopes.windows(2))
        .filter_map(|(points, slopes)| {
            let [[from_s, from_m], [to_s, to_m]] = *points else { return None };
            let [first, last] = *slopes else { return None };
            Some(Cubic::sloped(from_s, to_s - from_s, [from_m, to_m], [first, last]))
        })
        .collect()
}

/// The slope at each point: the harmonic mean of those before and behind it where both climb or
/// both fall, so that no cubic leaves the heights of its ends; else level.
fn slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let slope = |pair: &[[f64; 2]]| match *pair {
        [[from_s, from_m], [to_s, to_m]] => (to_m - from_m) / (to_s - from_s),
        _ => 0.0,
    };
    let between: Vec<f64> = points.windows(2).map(slope).collect();
    let inner = between.windows(2).map(|pair| match *pair {
        [before, behind] if before * behind > 0.0 => 2.0 * before * behind / (before + behind),
        _ => 0.0,
    });
    [0.0].into_iter().chain(inner).chain([0.0]).collect()
}
