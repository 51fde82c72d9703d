//! Cuts lanes into flat pieces of walkable ground.

use nalgebra::Point3;

use super::piece::{Class, Weld};
use crate::Map;
use crate::kinds::{LaneType, LaneTypes};
use crate::lanes::{lateral, lateral_point};
use crate::limits;
use crate::mesh::kerbs::Kerbs;
use crate::mesh::strip::pieces;
use crate::model::{Road, Section};

/// Radius of a walker: how far the middle of one keeps from both borders of a sidewalk, in metres.
pub(super) const WALKER_RADIUS_M: f64 = 0.3;
/// Most of a narrow sidewalk's width that either border may take, as a share.
const BORDER_SHARE_MAX: f64 = 0.25;
/// Longest piece along a road, in metres. Searches go over the middles of edges: with long pieces
/// the short way over a street would look long.
const PIECE_MAX_M: f64 = 6.0;
/// Large maps are cut into about so many pieces of this length and more.
const FINE_PIECES_MAX: f64 = 20_000.0;
/// How far a patch over the joint between two roads reaches to both sides, in metres.
const PATCH_M: f64 = 0.1;

/// What lanes are to someone on foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    Walk,
    Drive,
    Neither,
}

fn lane_use(lane_type: LaneType) -> Use {
    match lane_type {
        LaneType::Sidewalk => Use::Walk,
        traffic if LaneTypes::TRAFFIC.contains(traffic) => Use::Drive,
        _ => Use::Neither,
    }
}

/// Neighbouring lanes of one use, as one strip.
#[derive(Clone, Copy, Debug)]
struct Band {
    lane_use: Use,
    /// The lane at its left border, seen along s.
    left: i32,
    /// The lane at its right border.
    right: i32,
}

impl Band {
    /// Lateral places of the left and the right border.
    fn borders(self, road: &Road, section: &Section, s: f64) -> [f64; 2] {
        let left = lateral(road, section, self.left, s);
        let right = lateral(road, section, self.right, s);
        [
            if self.left > 0 { left.outer } else { left.inner },
            if self.right > 0 { right.inner } else { right.outer },
        ]
    }
}

/// The bands of a section from left to right.
fn bands(section: &Section) -> Vec<Band> {
    let mut bands: Vec<Band> = Vec::new();
    for lane in section.lanes.iter().rev().filter(|lane| lane.id != 0) {
        let lane_use = lane_use(lane.lane_type);
        match bands.last_mut() {
            Some(last) if last.lane_use == lane_use => last.right = lane.id,
            _ => bands.push(Band { lane_use, left: lane.id, right: lane.id }),
        }
    }
    bands
}

/// Adds the ground of every road that has a sidewalk, and of those that join two such roads.
///
/// Stops at [`limits::NAV_PIECES_MAX`], which the caller asks about.
pub(super) fn cut(map: &Map, weld: &mut Weld) {
    let roads = &map.model.roads;
    let has_sidewalk = |road: &Road| {
        let lanes = road.sections.iter().flat_map(|section| &section.lanes);
        lanes.into_iter().any(|lane| lane.lane_type == LaneType::Sidewalk)
    };
    let along_sidewalk: Vec<bool> = roads.iter().map(has_sidewalk).collect();
    let walkable = |id: u32| {
        map.model.road_index(id).and_then(|index| along_sidewalk.get(index)).copied() == Some(true)
    };
    let length_m = roads.iter().map(|road| road.length_m).sum::<f64>();
    let piece_max_m = PIECE_MAX_M.max(length_m / FINE_PIECES_MAX);
    for (index, road) in (0..).zip(roads) {
        let joins =
            road.junction.is_some() && (walkable(road.predecessor) || walkable(road.successor));
        if walkable(road.id) || joins {
            for section in &road.sections {
                cut_section(map.kerbs(), index, road, section, piece_max_m, weld);
            }
            patch_ends(index, road, weld);
        }
        if weld.len() > limits::NAV_PIECES_MAX {
            return;
        }
    }
}

fn cut_section(
    kerbs: &Kerbs,
    index: u32,
    road: &Road,
    section: &Section,
    piece_max_m: f64,
    weld: &mut Weld,
) {
    let bands = bands(section);
    let cuts = refined(&kerbs.cuts(road, section), piece_max_m);
    let use_of = |position: Option<usize>| {
        position.and_then(|position| bands.get(position)).map(|band| band.lane_use)
    };
    for (position, band) in bands.iter().enumerate() {
        let beside = [use_of(position.checked_sub(1)), use_of(Some(position + 1))];
        for [from_s, to_s] in pieces(&cuts) {
            let ends = [from_s, to_s].map(|s| (s, band.borders(road, section, s)));
            // How high the left and the right border are, as shares of the kerb's height.
            let mut strip = |class, across: &dyn Fn([f64; 2]) -> [f64; 2], raised: [f64; 2]| {
                let corners = ends.map(|(s, borders)| {
                    let [left, right] = across(borders);
                    let kerb_m = match band.lane_use {
                        Use::Walk => kerbs.height_m(road, s, borders),
                        _ => 0.0,
                    };
                    [(s, left, raised[0] * kerb_m), (s, right, raised[1] * kerb_m)]
                });
                let [[left0, right0], [left1, right1]] = corners;
                let ring = [right0, right1, left1, left0];
                weld.add(class, index, &ring.map(|(s, t, z)| lateral_point(road, s, t, z)));
            };
            match band.lane_use {
                Use::Neither => {}
                Use::Drive => strip(Class::Road, &|borders| borders, [0.0; 2]),
                Use::Walk => {
                    strip(Class::Sidewalk, &narrowed, [1.0; 2]);
                    if beside[0] == Some(Use::Drive) {
                        strip(Class::Kerb, &|b| [b[0], narrowed(b)[0]], [0.0, 1.0]);
                    }
                    if beside[1] == Some(Use::Drive) {
                        strip(Class::Kerb, &|b| [narrowed(b)[1], b[1]], [1.0, 0.0]);
                    }
                }
            }
        }
    }
}

/// The same cuts and as many more as pieces of this length need.
fn refined(cuts: &[f64], piece_max_m: f64) -> Vec<f64> {
    let mut refined = Vec::with_capacity(cuts.len());
    for pair in cuts.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let count = ((to - from) / piece_max_m).ceil().max(1.0);
        let steps = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
        refined.extend(steps.take_while(|k| *k < count).map(|k| from + (to - from) * k / count));
    }
    refined.extend(cuts.last());
    refined
}

/// Where the middle of a walker may be between the borders of a sidewalk.
fn narrowed([left, right]: [f64; 2]) -> [f64; 2] {
    let margin_m = WALKER_RADIUS_M.min((left - right) * BORDER_SHARE_MAX);
    [left - margin_m, right + margin_m]
}

/// Covers the joints at a road's ends: roads of different widths share no corners there, and
/// rounding would leave slits between them.
fn patch_ends(index: u32, road: &Road, weld: &mut Weld) {
    let ends = [(road.sections.first(), 0.0), (road.sections.last(), road.length_m)];
    for (section, s) in ends {
        let Some(section) = section else { continue };
        let (sin, cos) = road.reference(s).heading_rad.sin_cos();
        for band in bands(section).into_iter().filter(|band| band.lane_use == Use::Drive) {
            let [left, right] = band.borders(road, section, s);
            let (left, right) = (left - PATCH_M / 2.0, right + PATCH_M / 2.0);
            let corner = |t: f64, along_m: f64| {
                let at = lateral_point(road, s, t, 0.0);
                Point3::new(at.x + along_m * cos, at.y + along_m * sin, at.z)
            };
            if left > right {
                let ring = [
                    corner(right, -PATCH_M),
                    corner(right, PATCH_M),
                    corner(left, PATCH_M),
                    corner(left, -PATCH_M),
                ];
                weld.add(Class::Road, index, &ring);
            }
        }
    }
}
