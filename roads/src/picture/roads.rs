//! Lanes by type, the lines between them, their directions, and junctions.

use super::Pixel;
use super::canvas::{Canvas, Paint, Shapes};
use super::lettering;
use crate::Map;
use crate::kinds::{LaneType, MarkType};
use crate::lanes::{lane_pose, lateral, lateral_point};
use crate::mesh::strip::cuts;
use crate::model::{Lane, Road, Section};

/// Names and colours for the key.
pub(super) const KEY: &[(&str, &str)] = &[
    ("driving", DRIVING),
    ("junction", JUNCTION),
    ("parking", PARKING),
    ("shoulder", SHOULDER),
    ("biking", BIKING),
    ("sidewalk", SIDEWALK),
    ("median", MEDIAN),
    ("other", OTHER),
];

const DRIVING: &str = "#8d8f94";
const JUNCTION: &str = "#a3a09a";
const PARKING: &str = "#8199b5";
const SHOULDER: &str = "#b3b1ab";
const BIKING: &str = "#b98d76";
const SIDEWALK: &str = "#e6ddcb";
const MEDIAN: &str = "#a9bd8b";
const OTHER: &str = "#c9b3d1";

/// Distance between the arrows of a lane in metres.
const ARROW_EVERY_M: f64 = 30.0;

fn colour(lane_type: LaneType, in_junction: bool) -> &'static str {
    match lane_type {
        LaneType::Driving | LaneType::Bidirectional if in_junction => JUNCTION,
        LaneType::Driving
        | LaneType::Bidirectional
        | LaneType::Entry
        | LaneType::Exit
        | LaneType::OffRamp
        | LaneType::OnRamp => DRIVING,
        LaneType::Parking => PARKING,
        LaneType::Shoulder | LaneType::Stop => SHOULDER,
        LaneType::Biking => BIKING,
        LaneType::Sidewalk => SIDEWALK,
        LaneType::Median | LaneType::None | LaneType::Border => MEDIAN,
        _ => OTHER,
    }
}

/// Roads from the lowest to the highest, so that bridges cover what they cross.
pub(super) fn draw(map: &Map, canvas: &mut Canvas, pixel: Pixel) {
    let paved = map.model.roads.iter().filter(|road| !road.is_for_nobody());
    let mut roads: Vec<(f64, &Road)> = paved.map(|road| (highest_m(road), road)).collect();
    roads.sort_by(|a, b| a.0.total_cmp(&b.0));
    for level in roads.chunk_by(|a, b| b.0 - a.0 < 0.01) {
        // At one height, connecting roads cover the ends of those between junctions.
        for in_junction in [false, true] {
            let alike = level.iter().map(|(_, road)| *road);
            let alike = alike.filter(|road| road.junction.is_some() == in_junction);
            let alike: Vec<&Road> = alike.collect();
            surfaces(&alike, in_junction, canvas, pixel);
            lines(&alike, in_junction, canvas, pixel);
            arrows(&alike, canvas, pixel);
        }
    }
    junction_ids(map, canvas, pixel);
}

fn highest_m(road: &Road) -> f64 {
    [0.0, 0.25, 0.5, 0.75, 1.0]
        .map(|share| road.elevation.value(share * road.length_m))
        .into_iter()
        .fold(f64::NEG_INFINITY, f64::max)
}

fn sections<'m>(roads: &'m [&'m Road]) -> impl Iterator<Item = (&'m Road, &'m Section)> {
    roads.iter().flat_map(|road| road.sections.iter().map(move |section| (*road, section)))
}

fn surfaces(roads: &[&Road], in_junction: bool, canvas: &mut Canvas, pixel: Pixel) {
    // Sidewalks first: in a junction others run across their corners.
    let order = [SIDEWALK, MEDIAN, OTHER, BIKING, SHOULDER, PARKING, DRIVING, JUNCTION];
    let mut layers = order.map(|colour| (colour, Shapes::default()));
    for (road, section) in sections(roads) {
        let cuts = cuts(road, section);
        for lane in section.lanes.iter().filter(|lane| lane.id != 0) {
            let wanted = colour(lane.lane_type, in_junction);
            let Some((_, shapes)) = layers.iter_mut().find(|(colour, _)| *colour == wanted) else {
                continue;
            };
            shapes.polygon(&outline(road, section, lane, &cuts));
        }
    }
    for (colour, shapes) in &layers {
        // A hair of outline closes the seams between neighbours.
        let paint = Paint { stroke: colour, width_m: pixel.metres(0.15), ..Paint::fill(colour) };
        canvas.paint(shapes, paint);
    }
}

/// The last place of a section that is not yet the next one's.
fn within(section: &Section, s: f64) -> f64 {
    s.min(section.end_s - 1e-6).max(section.start_s)
}

fn point(road: &Road, s: f64, t: f64) -> [f64; 2] {
    let point = lateral_point(road, s, t, 0.0);
    [point.x, point.y]
}

fn outline(road: &Road, section: &Section, lane: &Lane, cuts: &[f64]) -> Vec<[f64; 2]> {
    let edge = |s: &f64, outer: bool| {
        let s = within(section, *s);
        let at = lateral(road, section, lane.id, s);
        point(road, s, if outer { at.outer } else { at.inner })
    };
    let there = cuts.iter().map(|s| edge(s, false));
    there.chain(cuts.iter().rev().map(|s| edge(s, true))).collect()
}

fn lines(roads: &[&Road], in_junction: bool, canvas: &mut Canvas, pixel: Pixel) {
    let (mut solid, mut broken) = (Shapes::default(), Shapes::default());
    for (road, section) in sections(roads).filter(|_| !in_junction) {
        let cuts = cuts(road, section);
        for lane in &section.lanes {
            let shapes = match lane.marks.first().map(|mark| mark.mark_type) {
                Some(MarkType::Broken | MarkType::BrokenBroken) => &mut broken,
                Some(MarkType::Solid | MarkType::SolidSolid | MarkType::Curb) => &mut solid,
                Some(MarkType::SolidBroken | MarkType::BrokenSolid) => &mut solid,
                _ => continue,
            };
            let edge = |s: &f64| {
                let s = within(section, *s);
                point(road, s, lateral(road, section, lane.id, s).outer)
            };
            shapes.polyline(&cuts.iter().map(edge).collect::<Vec<_>>());
        }
    }
    let line = Paint::line("#f4f4f2", pixel.metres(0.4));
    canvas.paint(&solid, line);
    canvas.paint(&broken, Paint { dash_m: 3.0, ..line });
}

fn arrows(roads: &[&Road], canvas: &mut Canvas, pixel: Pixel) {
    let (reach_m, half_m) = (pixel.metres(2.2).min(1.6), pixel.metres(1.6).min(1.1));
    let mut shapes = Shapes::default();
    for (road, section) in sections(roads) {
        let length_m = section.end_s - section.start_s;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a lane is shorter than a million metres"
        )]
        let count = (length_m / ARROW_EVERY_M).round().max(1.0) as u32;
        let driving = section.lanes.iter().filter(|lane| lane.lane_type == LaneType::Driving);
        for lane in driving.filter(|lane| lane.id != 0 && length_m > 6.0) {
            for k in 0..count {
                let s = section.start_s + length_m * (f64::from(k) + 0.5) / f64::from(count);
                let pose = lane_pose(road, section, lane.id, s);
                let (sin, cos) = pose.heading_rad.sin_cos();
                let at = |ahead: f64, left: f64| {
                    [
                        pose.point.x + ahead * cos - left * sin,
                        pose.point.y + ahead * sin + left * cos,
                    ]
                };
                shapes.polyline(&[at(-reach_m, half_m), at(reach_m, 0.0), at(-reach_m, -half_m)]);
            }
        }
    }
    canvas.paint(&shapes, Paint::line("#e9e9ff", pixel.metres(0.7)));
}

/// The id in the middle of every junction.
fn junction_ids(map: &Map, canvas: &mut Canvas, pixel: Pixel) {
    let height_m = pixel.metres(6.0);
    let mut shapes = Shapes::default();
    for junction in &map.model.junctions {
        let roads: Vec<&Road> =
            junction.connecting_roads.iter().filter_map(|id| map.model.road(*id)).collect();
        if roads.is_empty() {
            continue;
        }
        let mut middle = [0.0; 2];
        for road in &roads {
            let at = road.reference(road.length_m / 2.0);
            middle[0] += at.x / roads.len() as f64;
            middle[1] += at.y / roads.len() as f64;
        }
        let id = junction.id.to_string();
        let start = [middle[0] - lettering::width(&id, height_m) / 2.0, middle[1] - height_m / 2.0];
        shapes.text(&id, start, height_m);
    }
    canvas.paint(&shapes, Paint::line("#5c3a00", pixel.metres(1.0)));
}
