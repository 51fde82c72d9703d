//! What carries a road where the land lies far below it: the sides and undersides of bridges, and
//! the walls of the embankments that lead up to them.

use nalgebra::Point3;

use super::pavement::{BANK_M_PER_M, junction_hull, open_edges, turned};
use super::strip::{cuts, pieces};
use super::terrain::{Land, drop_m, skirt_m};
use super::{Material, Sink};
use crate::Map;
use crate::kinds::LaneType;
use crate::lanes::{lateral, lateral_point};
use crate::limits::DECK_PIECES_MAX;
use crate::model::{Lane, Road, Section};

/// A road that lies less above the land is carried by an embankment, in metres.
const EMBANKMENT_MAX_M: f64 = 3.0;
/// How far the walls of an embankment reach into the land, in metres.
const FOOT_M: f64 = 0.3;
/// Thickness of a bridge over a road without much room, and over all others, in metres.
const THICKNESS_M: [f64; 2] = [0.5, 1.6];
/// Room that is left for what drives below, in metres.
const CLEARANCE_M: f64 = 4.5;
/// Longest piece of an underside, in metres: the land below it has squares of ten metres and more.
const STEP_M: f64 = 5.0;
/// Most pieces of an edge that are looked at.
const PIECES_MAX: f64 = 16.0;

/// Adds all of them; nothing on a map whose roads lie level.
pub(super) fn support(map: &Map, land: &Land, sink: &mut impl Sink) {
    let mut support =
        Support { land, skirt_m: skirt_m(map), bank_m: drop_m(map), pieces_left: DECK_PIECES_MAX };
    if support.skirt_m <= support.bank_m {
        return;
    }
    for road in &map.model.roads {
        for section in &road.sections {
            let cuts = finer(&cuts(road, section));
            for lane in section.lanes.iter().filter(|lane| lane.id != 0) {
                support.carry(road, section, lane, &cuts, sink);
            }
        }
    }
    for junction in &map.model.junctions {
        support.carry_floor(&junction_hull(map, junction), sink);
    }
}

/// Whether a road is so high above the land along an edge that its bank does not reach down to it.
pub(super) fn is_raised(land: &Land, skirt_m: f64, [from, to]: [Point3<f64>; 2]) -> bool {
    let count = ((to - from).norm() / STEP_M).ceil().clamp(1.0, PIECES_MAX);
    let shares = std::iter::successors(Some(0.0), |k| Some(k + 1.0)).take_while(|k| *k <= count);
    shares.map(|k| from + (to - from) * (k / count)).any(|place| land.below_m(&place) > skirt_m)
}

/// The cuts of a section and as many between them that none is farther than [`STEP_M`] from the
/// next one.
fn finer(cuts: &[f64]) -> Vec<f64> {
    let mut all = Vec::with_capacity(cuts.len());
    for pair in cuts.windows(2) {
        let [from_s, to_s] = *pair else { continue };
        let count = ((to_s - from_s) / STEP_M).ceil().max(1.0);
        let shares = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
        all.extend(shares.take_while(|k| *k < count).map(|k| from_s + (to_s - from_s) * k / count));
    }
    all.extend(cuts.last());
    all
}

struct Support<'m> {
    land: &'m Land,
    skirt_m: f64,
    bank_m: f64,
    /// How many more are made.
    pieces_left: usize,
}

impl Support<'_> {
    /// The underside of one lane, and the sides where no other lane goes on beside it.
    fn carry(
        &mut self,
        road: &Road,
        section: &Section,
        lane: &Lane,
        cuts: &[f64],
        sink: &mut impl Sink,
    ) {
        let is_mirrored = lane.id > 0;
        let sign = f64::from(lane.id.signum());
        let is_walk = lane.lane_type == LaneType::Sidewalk;
        let [inner_open, outer_open] = open_edges(section, lane);
        // Sidewalks and roads in junctions have no bank.
        let bank_m =
            if is_walk || road.junction.is_some() { 0.0 } else { BANK_M_PER_M * self.bank_m };
        let top_m = if road.junction.is_some() && !is_walk { 0.0 } else { self.skirt_m };
        for ends in pieces(cuts) {
            let edges = ends.map(|s| {
                let at = lateral(road, section, lane.id, s);
                let wider = |is_open: bool| if is_open { sign * bank_m } else { 0.0 };
                [at.inner - wider(inner_open), at.outer + wider(outer_open)]
                    .map(|t| lateral_point(road, s, t, 0.0))
            });
            let [[a, b], [d, c]] = edges;
            if ![a, b, c, d].iter().any(|place| self.land.below_m(place) > self.skirt_m) {
                continue;
            }
            let Some(left) = self.pieces_left.checked_sub(1) else { return };
            self.pieces_left = left;
            let low = [a, d, c, b].map(|place| self.lowered(place));
            sink.quad(Material::Bridge, turned(low, is_mirrored));
            let mut side = |from: Point3<f64>, to: Point3<f64>| {
                let [low_from, low_to] = [from, to].map(|place| self.lowered(place));
                let [top_from, top_to] = [from, to].map(|place| down(place, top_m));
                if low_from.z < top_from.z || low_to.z < top_to.z {
                    let corners = [top_from, low_from, low_to, top_to];
                    sink.quad(Material::Bridge, turned(corners, is_mirrored));
                }
            };
            if outer_open {
                side(b, c);
            }
            if inner_open {
                side(d, a);
            }
        }
    }

    /// The underside of a junction's floor.
    fn carry_floor(&self, hull: &[Point3<f64>], sink: &mut impl Sink) {
        if !hull.iter().any(|place| self.land.below_m(place) > self.skirt_m) {
            return;
        }
        let Some((first, rest)) = hull.split_first() else { return };
        for pair in rest.windows(2) {
            if let [b, c] = pair {
                sink.triangle(Material::Bridge, [*first, *c, *b].map(|place| self.lowered(place)));
            }
        }
    }

    /// Where the underside is below a place on a road.
    fn lowered(&self, place: Point3<f64>) -> Point3<f64> {
        let below_m = self.land.below_m(&place);
        let [thin_m, thick_m] = THICKNESS_M;
        let depth_m = if below_m < EMBANKMENT_MAX_M {
            below_m.max(0.0) + FOOT_M
        } else {
            (below_m - CLEARANCE_M).clamp(thin_m, thick_m)
        };
        down(place, depth_m)
    }
}

fn down(place: Point3<f64>, depth_m: f64) -> Point3<f64> {
    Point3::new(place.x, place.y, place.z - depth_m)
}
