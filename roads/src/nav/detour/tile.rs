//! One tile of the set.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::{Writer, axes, count};
use crate::nav::bands::WALKER_RADIUS_M;
use crate::nav::convex::edges;
use crate::nav::tree::{Content, Tree, bounds};
use crate::nav::{Area, CORNERS_MAX};

/// Polygons and corners are numbered with 16 bits, one of which marks edges to other tiles.
pub(super) const FULLNESS_MAX: usize = 0x7FFE;

const TILE_MAGIC: u32 = 0x444E_4156;
const TILE_VERSION: u32 = 7;
const NO_LINK: u32 = u32::MAX;
/// An edge on a tile's border; the low bits name the side.
const PORTAL: u16 = 0x8000;
/// Links to other tiles an edge on the border may need.
const LINKS_PER_PORTAL: u32 = 4;
/// Height of a walker in metres.
const WALKER_HEIGHT_M: f32 = 1.8;
/// How high a walker can climb, in metres.
const WALKER_CLIMB_M: f32 = 0.9;
/// An edge is on a tile's border when both its ends are this near, in metres.
const ON_LINE_M: f64 = 1e-3;
/// Steps of the tree's boxes per metre, where their 16 bits suffice.
const TREE_STEPS_PER_M: f32 = 10.0;

/// A side of a tile, by the client's number for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    East = 0,
    /// The client's +y, our -y.
    South = 2,
    West = 4,
    North = 6,
}

impl Side {
    /// How far a point lies outside of a line on this side, in metres.
    pub(super) fn beyond(self, point: &Point3<f64>, line: f64) -> f64 {
        match self {
            Self::East => point.x - line,
            Self::West => line - point.x,
            Self::South => -point.y - line,
            Self::North => line + point.y,
        }
    }

    pub(super) fn put_on(self, point: &mut Point3<f64>, line: f64) {
        match self {
            Self::East | Self::West => point.x = line,
            Self::South | Self::North => point.y = -line,
        }
    }
}

/// The client's number of an area, and its flag.
fn area_and_flag(area: Area) -> (u8, u16) {
    match area {
        Area::Sidewalk => (1, 0x02),
        Area::Crosswalk => (2, 0x04),
        Area::Road => (3, 0x08),
    }
}

/// Polygons of one tile.
pub(super) struct Tile {
    at: [u32; 2],
    /// Where other tiles begin.
    pub(super) lines: Vec<(Side, f64)>,
    vertices: Vec<[f32; 3]>,
    numbers: BTreeMap<[u32; 3], u32>,
    polygons: Vec<(Vec<u32>, Area)>,
    outlines: Vec<Vec<Point3<f64>>>,
}

impl Tile {
    pub(super) fn new(at: [u32; 2], lines: Vec<(Side, f64)>) -> Self {
        Self {
            at,
            lines,
            vertices: Vec::new(),
            numbers: BTreeMap::new(),
            polygons: Vec::new(),
            outlines: Vec::new(),
        }
    }

    pub(super) fn has_polygons(&self) -> bool {
        !self.polygons.is_empty()
    }

    /// Number of polygons.
    pub(super) fn len(&self) -> usize {
        self.polygons.len()
    }

    /// Number of polygons or of corners, whichever is more.
    pub(super) fn fullness(&self) -> usize {
        self.polygons.len().max(self.vertices.len())
    }

    /// Adds a convex polygon of at most [`CORNERS_MAX`] corners.
    pub(super) fn add(&mut self, outline: &[Point3<f64>], area: Area) {
        let mut corners: Vec<u32> = outline.iter().map(|corner| self.number(corner)).collect();
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() >= 3 {
            self.polygons.push((corners, area));
            self.outlines.push(outline.to_vec());
        }
    }

    fn number(&mut self, corner: &Point3<f64>) -> u32 {
        let place = axes(corner);
        // Zero has two signs, which are the same place.
        let key = place.map(|v| (v + 0.0).to_bits());
        *self.numbers.entry(key).or_insert_with(|| {
            self.vertices.push(place);
            count(self.vertices.len() - 1)
        })
    }

    /// The bytes of the tile.
    pub(super) fn data(&self) -> Vec<u8> {
        let neighbours = self.neighbours();
        let links: u32 = neighbours.iter().flatten().map(|n| links_of(*n)).sum();
        let triangles: u32 = self.polygons.iter().map(|(c, _)| count(c.len() - 2)).sum();
        let tree = Tree::new(self.outlines.iter().map(|corners| bounds(corners)));
        let [low, high] = self.extent();
        let steps_per_m = steps_per_m(low, high);
        let mut data = Vec::new();
        let mut w = Writer(&mut data);
        w.u32s(&[TILE_MAGIC, TILE_VERSION, self.at[0], self.at[1], 0, 0]);
        w.u32s(&[count(self.polygons.len()), count(self.vertices.len()), links.max(1)]);
        w.u32s(&[count(self.polygons.len()), 0, triangles, count(tree.nodes.len())]);
        // No links off the mesh; they would be numbered after the polygons.
        w.u32s(&[0, count(self.polygons.len())]);
        w.f32s(&[WALKER_HEIGHT_M, WALKER_RADIUS_M as f32, WALKER_CLIMB_M]);
        w.f32s(&low);
        w.f32s(&high);
        w.f32s(&[steps_per_m]);
        for vertex in &self.vertices {
            w.f32s(vertex);
        }
        self.polygon_records(&neighbours, &mut w);
        // Room for links, which the client makes itself.
        w.u8s(&vec![0; 12 * links.max(1) as usize]);
        self.surface_records(&mut w);
        tree_records(&tree, low, steps_per_m, &mut w);
        data
    }

    /// Per edge: one more than the polygon beyond it, or the side of the tile it lies on, or 0.
    fn neighbours(&self) -> Vec<Vec<u16>> {
        let mut owner: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        for (index, (corners, _)) in self.polygons.iter().enumerate() {
            for edge in edges(corners) {
                owner.entry(edge).or_insert(index);
            }
        }
        let beyond = |(from, to)| match owner.get(&(to, from)) {
            Some(index) => short(index + 1),
            None => self.side_of([from, to]).map_or(0, |side| PORTAL | side as u16),
        };
        self.polygons.iter().map(|(corners, _)| edges(corners).map(beyond).collect()).collect()
    }

    /// The side of the tile on which an edge lies.
    fn side_of(&self, ends: [u32; 2]) -> Option<Side> {
        let on_line = |side: Side, line: f64| {
            ends.iter().filter_map(|end| self.vertices.get(*end as usize)).all(|[x, z, y]| {
                let place = Point3::new(f64::from(*x), -f64::from(*y), f64::from(*z));
                side.beyond(&place, line).abs() < ON_LINE_M
            })
        };
        self.lines.iter().find(|(side, line)| on_line(*side, *line)).map(|(side, _)| *side)
    }

    /// Smallest and largest corner of a box around everything, with room for walkers.
    fn extent(&self) -> [[f32; 3]; 2] {
        let start = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let [low, high] = self.vertices.iter().fold(start, |[mut low, mut high], vertex| {
            for axis in 0..3 {
                low[axis] = low[axis].min(vertex[axis]);
                high[axis] = high[axis].max(vertex[axis]);
            }
            [low, high]
        });
        [low.map(|v| v - 1.0), [high[0] + 1.0, high[1] + 1.0 + WALKER_HEIGHT_M, high[2] + 1.0]]
    }

    fn polygon_records(&self, neighbours: &[Vec<u16>], w: &mut Writer<'_>) {
        for ((corners, area), beyond) in self.polygons.iter().zip(neighbours) {
            let (area, flag) = area_and_flag(*area);
            let padding = vec![0; CORNERS_MAX - corners.len()];
            w.u32s(&[NO_LINK]);
            w.u16s(&corners.iter().map(|corner| short(*corner as usize)).collect::<Vec<_>>());
            w.u16s(&padding);
            w.u16s(beyond);
            w.u16s(&padding);
            w.u16s(&[flag]);
            w.u8s(&[byte(corners.len()), area]);
        }
    }

    /// The surface within each polygon: a fan of triangles around its first corner.
    fn surface_records(&self, w: &mut Writer<'_>) {
        let mut first = 0;
        for (corners, _) in &self.polygons {
            let triangles = byte(corners.len() - 2);
            w.u32s(&[0, first]);
            w.u8s(&[0, triangles, 0, 0]);
            first += u32::from(triangles);
        }
        for (corners, _) in &self.polygons {
            let last = byte(corners.len() - 1);
            for corner in 2..=last {
                // Two bits per edge, 1 for edges of the polygon itself: the client only finds the
                // nearest border, which it must, with these set.
                let first_edge = u8::from(corner == 2);
                let last_edge = u8::from(corner == last) << 4;
                w.u8s(&[0, corner - 1, corner, first_edge | 1 << 2 | last_edge]);
            }
        }
    }
}

/// Boxes in steps from the tile's lowest corner, rounded outward.
fn tree_records(tree: &Tree, low: [f32; 3], steps_per_m: f32, w: &mut Writer<'_>) {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the conversion stops at the ends of the range, which the steps keep to"
    )]
    let step = |v: f32| v as u16;
    for ([box_low, box_high], content) in &tree.nodes {
        let (a, b) = (axes(box_low), axes(box_high));
        for axis in 0..3 {
            w.u16s(&[step(((a[axis].min(b[axis]) - low[axis]) * steps_per_m).floor())]);
        }
        for axis in 0..3 {
            w.u16s(&[step(((a[axis].max(b[axis]) - low[axis]) * steps_per_m).ceil())]);
        }
        w.u32s(&[match content {
            Content::Item(item) => *item,
            Content::Subtree(size) => size.wrapping_neg(),
        }]);
    }
}

/// As many steps per metre as fit into 16 bits over the longest side.
fn steps_per_m(low: [f32; 3], high: [f32; 3]) -> f32 {
    const STEPS_MAX: f32 = 65_000.0;
    let longest_m = (0..3).map(|axis| high[axis] - low[axis]).fold(1.0, f32::max);
    TREE_STEPS_PER_M.min(STEPS_MAX / longest_m)
}

fn links_of(neighbour: u16) -> u32 {
    match neighbour {
        0 => 0,
        portal if portal & PORTAL != 0 => LINKS_PER_PORTAL,
        _ => 1,
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a tile's numbers are limited to 15 bits")]
fn short(number: usize) -> u16 {
    number as u16
}

#[allow(clippy::cast_possible_truncation, reason = "polygons have few corners")]
fn byte(number: usize) -> u8 {
    number as u8
}
