//! Surfaces of lanes, kerbs, junction areas and paved land.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use super::kerbs::{CROSSED_DROP_M, Kerbs};
use super::strip::pieces;
use super::terrain::{Land, drop_m, skirt_m};
use super::{Material, Sink, deck};
use crate::Map;
use crate::kinds::LaneType;
use crate::lanes::{lateral, lateral_point};
use crate::model::{Junction, Lane, Object, Road, Section};

/// Width of the stones along a sidewalk's inner edge, in metres.
const STONE_M: f64 = 0.2;
/// Width of the bank from a road without kerb down to the land, for each metre of height: flat
/// enough for a wheel that leaves the road to come back.
pub(super) const BANK_M_PER_M: f64 = 5.0;
/// Junction areas whose heights differ by less are one level floor, in metres.
const LEVEL_M: f64 = 1e-3;
/// Corners of a junction's floor that bulge by less lie on a line, in square metres: coordinates of
/// four bytes turn such triangles over.
const FLAT_M2: f64 = 1e-3;
/// How far below the connecting roads the floor of a sloping junction lies, in metres.
const SLOPING_DROP_M: f64 = 0.05;

/// Whether kerb stones get faces of their own, which only a camera needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Detail {
    Ground,
    Picture,
}

/// How a map is paved.
#[derive(Clone, Copy, Debug)]
struct Style<'m> {
    detail: Detail,
    kerbs: &'m Kerbs,
    land: Option<&'m Land>,
    /// How far below the road its sides reach, in metres.
    skirt_m: f64,
    /// How far below the road its banks end, in metres.
    bank_m: f64,
}

impl Style<'_> {
    /// How deep the side of a road goes on below its bank; `None` where the land is met there.
    fn below_bank_m(self) -> Option<f64> {
        (self.skirt_m > self.bank_m).then_some(-self.skirt_m)
    }

    /// What the bank along an edge of a road is made of.
    fn bank(self, edge: [Point3<f64>; 2]) -> Material {
        let is_raised = |land| deck::is_raised(land, self.skirt_m, edge);
        if self.land.is_some_and(is_raised) { Material::Bridge } else { Material::Grass }
    }
}

/// All that is paved.
pub(super) fn pave(map: &Map, land: Option<&Land>, detail: Detail, sink: &mut impl Sink) {
    let kerbs = map.kerbs();
    let style = Style { detail, kerbs, land, skirt_m: skirt_m(map), bank_m: drop_m(map) };
    for road in &map.model.roads {
        let is_paved = !road.is_for_nobody();
        for section in road.sections.iter().filter(|_| is_paved) {
            let cuts = kerbs.cuts(road, section);
            for lane in section.lanes.iter().filter(|lane| lane.id != 0) {
                if lane.lane_type == LaneType::Sidewalk {
                    sidewalk(road, section, lane, &cuts, style, sink);
                } else {
                    lane_surface(road, section, lane, &cuts, style, sink);
                }
            }
        }
        for object in road.objects.iter().filter(|object| object.object_type == "patch") {
            patch(road, object, style.skirt_m, sink);
        }
    }
    for junction in &map.model.junctions {
        junction_floor(&junction_hull(map, junction), sink);
    }
}

fn material(lane_type: LaneType) -> Material {
    match lane_type {
        LaneType::Sidewalk => Material::Sidewalk,
        LaneType::None | LaneType::Median | LaneType::Border => Material::Grass,
        _ => Material::Asphalt,
    }
}

/// A sidewalk with its kerb stones and its outer edge.
fn sidewalk(
    road: &Road,
    section: &Section,
    lane: &Lane,
    cuts: &[f64],
    style: Style<'_>,
    sink: &mut impl Sink,
) {
    let sign = f64::from(lane.id.signum());
    for ends in pieces(cuts) {
        // Lateral places of the inner edge, of the stones' other edge and of the outer edge.
        let edges = ends.map(|s| {
            let at = lateral(road, section, lane.id, s);
            let wide = (at.outer - at.inner).abs() > STONE_M;
            [at.inner, if wide { at.inner + sign * STONE_M } else { at.outer }, at.outer]
        });
        let height_m = |end: usize| {
            let [inner, _, outer] = edges[end];
            style.kerbs.height_m(road, ends[end], [inner, outer])
        };
        let (top, foot, deep) = ([height_m(0), height_m(1)], [0.0; 2], [-style.skirt_m; 2]);
        let mut band = |material, [t, u]: [usize; 2], [low, high]: [[f64; 2]; 2]| {
            let point =
                |end: usize, edge: usize, z| lateral_point(road, ends[end], edges[end][edge], z);
            let corners = [
                point(0, t, low[0]),
                point(0, u, high[0]),
                point(1, u, high[1]),
                point(1, t, low[1]),
            ];
            sink.quad(material, turned(corners, sign > 0.0));
        };
        if style.detail == Detail::Picture {
            band(Material::Curb, [0, 1], [top; 2]);
            band(Material::Sidewalk, [1, 2], [top; 2]);
        } else {
            band(Material::Sidewalk, [0, 2], [top; 2]);
        }
        band(Material::Curb, [0, 0], [foot, top]);
        band(Material::Curb, [2, 2], [top, deep]);
    }
}

/// Any other lane, and the banks beside it.
fn lane_surface(
    road: &Road,
    section: &Section,
    lane: &Lane,
    cuts: &[f64],
    style: Style<'_>,
    sink: &mut impl Sink,
) {
    let material = material(lane.lane_type);
    let crossed = material == Material::Grass && road.junction.is_some();
    let height_m = if crossed { -CROSSED_DROP_M } else { 0.0 };
    let sign = f64::from(lane.id.signum());
    let [inner_edge, outer_edge] =
        if road.junction.is_some() { [false; 2] } else { open_edges(section, lane) };
    let bank_width_m = BANK_M_PER_M * style.bank_m;
    let borders = |s: f64| {
        let at = lateral(road, section, lane.id, s);
        [at.inner, at.outer]
    };
    for [from_s, to_s] in pieces(cuts) {
        let ([inner0, outer0], [inner1, outer1]) = (borders(from_s), borders(to_s));
        let point = |s: f64, t: f64, z: f64| lateral_point(road, s, t, z);
        let mut band = |material, [t0, t1]: [f64; 2], [u0, u1]: [f64; 2], z: [f64; 2]| {
            let corners = [
                point(from_s, t0, z[0]),
                point(from_s, u0, z[1]),
                point(to_s, u1, z[1]),
                point(to_s, t1, z[0]),
            ];
            sink.quad(material, turned(corners, sign > 0.0));
        };
        band(material, [inner0, inner1], [outer0, outer1], [height_m; 2]);
        if outer_edge {
            let [foot0, foot1] = [outer0, outer1].map(|t| t + sign * bank_width_m);
            let bank = style.bank([point(from_s, foot0, 0.0), point(to_s, foot1, 0.0)]);
            band(bank, [outer0, outer1], [foot0, foot1], [0.0, -style.bank_m]);
            if let Some(deep_m) = style.below_bank_m() {
                band(bank, [foot0, foot1], [foot0, foot1], [-style.bank_m, deep_m]);
            }
        }
        if inner_edge {
            let [foot0, foot1] = [inner0, inner1].map(|t| t - sign * bank_width_m);
            let bank = style.bank([point(from_s, foot0, 0.0), point(to_s, foot1, 0.0)]);
            band(bank, [foot0, foot1], [inner0, inner1], [-style.bank_m, 0.0]);
            if let Some(deep_m) = style.below_bank_m() {
                band(bank, [foot0, foot1], [foot0, foot1], [deep_m, -style.bank_m]);
            }
        }
    }
}

/// Whether no other lane of its road lies beside a lane's inner and its outer border.
pub(super) fn open_edges(section: &Section, lane: &Lane) -> [bool; 2] {
    let outer = lane.id + lane.id.signum();
    let across = section.lanes.iter().any(|other| other.id.signum() == -lane.id.signum());
    [lane.id.abs() == 1 && !across, section.lane(outer).is_none()]
}

/// Corners given for the right side of a road; the left side is its mirror image.
pub(super) fn turned([a, b, c, d]: [Point3<f64>; 4], mirrored: bool) -> [Point3<f64>; 4] {
    if mirrored { [a, d, c, b] } else { [a, b, c, d] }
}

/// The convex hull of the ends of the lanes of a junction's connecting roads.
pub(super) fn junction_hull(map: &Map, junction: &Junction) -> Vec<Point3<f64>> {
    let mut corners: Vec<Point3<f64>> = Vec::new();
    for road in junction.connecting_roads.iter().filter_map(|id| map.model.road(*id)) {
        for section in &road.sections {
            for lane in section
                .lanes
                .iter()
                .filter(|lane| lane.id != 0 && material(lane.lane_type) == Material::Asphalt)
            {
                for s in pieces(&[section.start_s, section.end_s]).flatten() {
                    let at = lateral(road, section, lane.id, s);
                    corners.extend([at.inner, at.outer].map(|t| lateral_point(road, s, t, 0.0)));
                }
            }
        }
    }
    convex_hull(corners, FLAT_M2)
}

/// Fills the area between a junction's connecting roads.
///
/// The hull passes below raised sidewalks at the corners, where nobody sees it.
fn junction_floor(hull: &[Point3<f64>], sink: &mut impl Sink) {
    let [low, high] =
        hull.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], corner| {
            [low.min(corner.z), high.max(corner.z)]
        });
    let sink_m = if high - low < LEVEL_M { 0.0 } else { SLOPING_DROP_M };
    let Some((first, rest)) = hull.split_first() else { return };
    let lowered = |p: &Point3<f64>| Point3::new(p.x, p.y, p.z - sink_m);
    for pair in rest.windows(2) {
        if let [b, c] = pair {
            sink.triangle(Material::Asphalt, [first, b, c].map(lowered));
        }
    }
}

/// Corners of the convex hull seen from above, counter-clockwise (Andrew's monotone chain). Left
/// out are those whose triangle with their neighbours has no more than half of `flat_m2`.
pub(crate) fn convex_hull(mut points: Vec<Point3<f64>>, flat_m2: f64) -> Vec<Point3<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let turns_left = |a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>| {
        (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > flat_m2
    };
    let half = |points: &mut dyn Iterator<Item = &Point3<f64>>| {
        let mut chain: Vec<Point3<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain.as_slice() {
                if turns_left(a, b, point) {
                    break;
                }
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}

/// A paved or planted rectangle of land, a step above the ground.
fn patch(road: &Road, object: &Object, skirt_m: f64, sink: &mut impl Sink) {
    let material = if object.name.contains("Lawn") { Material::Grass } else { Material::Sidewalk };
    let foot = lateral_point(road, object.s, object.t, object.z_offset_m);
    let pose = Isometry3::from_parts(
        Translation3::from(foot.coords),
        UnitQuaternion::from_euler_angles(
            0.0,
            0.0,
            road.reference(object.s).heading_rad + object.heading_rad,
        ),
    );
    let (x, y) = (object.length_m / 2.0, object.width_m / 2.0);
    let ring =
        |z: f64| [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| pose * Point3::new(x, y, z));
    let (top, foot) = (ring(object.height_m), ring(-skirt_m));
    sink.quad(material, top);
    for (k, next) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
        sink.quad(Material::Curb, [foot[k], foot[next], top[next], top[k]]);
    }
}
