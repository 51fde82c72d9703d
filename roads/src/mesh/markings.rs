//! Paint on the road: lane lines, stop lines and crosswalks.

use nalgebra::Point3;

use super::strip::{across, cuts, pieces};
use super::{Material, Sink};
use crate::Map;
use crate::crosswalks::corners;
use crate::kinds::{MarkColor, MarkType};
use crate::lanes::lateral;
use crate::model::{Lane, Mark, Object, Road, Section};

/// Height of paint above the road, in metres: enough for a depth buffer to tell them apart.
const PAINT_M: f64 = 0.015;
/// Length of a dash and of the gap after it, in metres.
const DASH_M: [f64; 2] = [3.0, 4.5];
/// Distance of the middles of double lines, in metres.
const DOUBLE_M: f64 = 0.3;
/// Width of a stripe of a crosswalk, and of the gap after it, in metres.
const STRIPE_M: f64 = 0.5;
/// Width of lines that do not say theirs, in metres.
const LINE_M: f64 = 0.12;

/// Paints everything the map describes.
pub(super) fn paint(map: &Map, sink: &mut impl Sink) {
    for road in &map.model.roads {
        for section in &road.sections {
            let cuts = cuts(road, section);
            for lane in &section.lanes {
                lane_lines(road, section, lane, &cuts, sink);
            }
        }
        for object in &road.objects {
            if object.is_crosswalk() {
                crosswalk(road, object, sink);
            } else if object.object_type == "roadMark" {
                flat(road, object, Material::MarkingWhite, sink);
            }
        }
    }
}

fn lane_lines(
    road: &Road,
    section: &Section,
    lane: &Lane,
    section_cuts: &[f64],
    sink: &mut impl Sink,
) {
    for (index, mark) in lane.marks.iter().enumerate() {
        let end_s = lane.marks.get(index + 1).map_or(section.end_s, |next| next.start_s);
        let from_s = mark.start_s.clamp(section.start_s, section.end_s);
        let to_s = end_s.clamp(section.start_s, section.end_s);
        for (shift, dashed) in lines(mark.mark_type) {
            let line = Line { road, section, lane, mark, shift: *shift };
            if *dashed {
                line.dashes(from_s, to_s, sink);
            } else {
                line.solid(section_cuts, from_s, to_s, sink);
            }
        }
    }
}

/// The lines of a mark: how far each is shifted in double distances, and whether it is broken.
fn lines(mark_type: MarkType) -> &'static [(f64, bool)] {
    match mark_type {
        MarkType::Broken => &[(0.0, true)],
        MarkType::Solid => &[(0.0, false)],
        MarkType::SolidSolid => &[(-0.5, false), (0.5, false)],
        MarkType::SolidBroken => &[(-0.5, false), (0.5, true)],
        MarkType::BrokenSolid => &[(-0.5, true), (0.5, false)],
        MarkType::BrokenBroken => &[(-0.5, true), (0.5, true)],
        _ => &[],
    }
}

struct Line<'m> {
    road: &'m Road,
    section: &'m Section,
    lane: &'m Lane,
    mark: &'m Mark,
    shift: f64,
}

impl Line<'_> {
    fn solid(&self, section_cuts: &[f64], from_s: f64, to_s: f64, sink: &mut impl Sink) {
        let first = section_cuts.partition_point(|s| *s <= from_s);
        let inside = section_cuts.get(first..).unwrap_or_default();
        let inside = inside.iter().copied().take_while(|s| *s < to_s);
        let cuts: Vec<f64> = [from_s].into_iter().chain(inside).chain([to_s]).collect();
        for [from_s, to_s] in pieces(&cuts) {
            self.piece(from_s, to_s, sink);
        }
    }

    fn dashes(&self, from_s: f64, to_s: f64, sink: &mut impl Sink) {
        let mut at = from_s;
        while at < to_s {
            self.piece(at, (at + DASH_M[0]).min(to_s), sink);
            at += DASH_M[0] + DASH_M[1];
        }
    }

    fn piece(&self, from_s: f64, to_s: f64, sink: &mut impl Sink) {
        if to_s - from_s < 1e-3 {
            return;
        }
        let material = match self.mark.color {
            MarkColor::Yellow => Material::MarkingYellow,
            _ => Material::MarkingWhite,
        };
        let width_m = if self.mark.width_m > 0.0 { self.mark.width_m } else { LINE_M };
        let edges = |s: f64| {
            let middle =
                lateral(self.road, self.section, self.lane.id, s).outer + self.shift * DOUBLE_M;
            across(self.road, s, [middle - width_m / 2.0, middle + width_m / 2.0], PAINT_M)
        };
        let ([right0, left0], [right1, left1]) = (edges(from_s), edges(to_s));
        sink.quad(material, [right0, right1, left1, left0]);
    }
}

/// Four corners, counter-clockwise.
fn four_corners(road: &Road, object: &Object) -> Option<[Point3<f64>; 4]> {
    let corners = corners(road, object, &object.corners, PAINT_M);
    let [a, b, c, d, ..] = corners.as_slice() else { return None };
    let turns_left = (b - a).cross(&(c - a)).z > 0.0;
    Some(if turns_left { [*a, *b, *c, *d] } else { [*a, *d, *c, *b] })
}

fn flat(road: &Road, object: &Object, material: Material, sink: &mut impl Sink) {
    if let Some(corners) = four_corners(road, object) {
        sink.quad(material, corners);
    }
}

/// Stripes a crosswalk may have, whichever of its sides is the longer one.
pub(crate) fn stripes(object: &Object) -> f64 {
    let longest_m =
        object.corners.iter().map(|[u, v, z]| u.hypot(*v).hypot(*z)).fold(0.0, f64::max);
    2.0 * longest_m / (2.0 * STRIPE_M)
}

/// Stripes along the shorter side of the crossing, which is the way the cars go.
fn crosswalk(road: &Road, object: &Object, sink: &mut impl Sink) {
    let Some([a, b, c, d]) = four_corners(road, object) else { return };
    let [a, b, c, d] =
        if (b - a).norm_squared() > (d - a).norm_squared() { [a, b, c, d] } else { [b, c, d, a] };
    let long_m = (b - a).norm();
    let mut at_m = STRIPE_M / 2.0;
    while at_m + STRIPE_M < long_m {
        let [from, to] = [at_m / long_m, (at_m + STRIPE_M) / long_m];
        let near = |share: f64| a + (b - a) * share;
        let far = |share: f64| d + (c - d) * share;
        sink.quad(Material::Crosswalk, [near(from), near(to), far(to), far(from)]);
        at_m += 2.0 * STRIPE_M;
    }
}
