//! Cuts the mesh into square tiles.

use nalgebra::Point3;

use super::tile::{Side, Tile};
use crate::nav::tree::{Bounds, bounds};
use crate::nav::{Area, CORNERS_MAX, NavMesh};

/// How far the tiles reach beyond the mesh, in metres.
const MARGIN_M: f64 = 1.0;
/// Slices of polygons narrower than this are left out, in metres.
const SLICE_MIN_M: f64 = 1e-4;

/// The lines between tiles. Columns grow with x, rows with the client's y, which is our -y.
pub(super) struct Grid {
    bounds: Bounds,
    per_side: u32,
}

impl Grid {
    pub(super) fn new(mesh: &NavMesh, per_side: u32) -> Self {
        let [low, high] = bounds(mesh.vertices());
        let margin = nalgebra::Vector3::repeat(MARGIN_M);
        Self { bounds: [low - margin, high + margin], per_side }
    }

    /// The corner of the first tile, in the client's axes.
    pub(super) fn origin(&self) -> [f32; 3] {
        let [low, high] = self.bounds;
        super::axes(&Point3::new(low.x, high.y, low.z))
    }

    /// Extent of each tile in x and y.
    #[allow(clippy::cast_possible_truncation, reason = "the format is single precision")]
    pub(super) fn tile_sides(&self) -> [f32; 2] {
        [self.side_m(0) as f32, self.side_m(1) as f32]
    }

    fn side_m(&self, axis: usize) -> f64 {
        (self.bounds[1][axis] - self.bounds[0][axis]) / f64::from(self.per_side)
    }

    /// Where a tile begins, along the direction in which columns or rows grow.
    fn line_m(&self, axis: usize, position: u32) -> f64 {
        let start = if axis == 0 { self.bounds[0].x } else { -self.bounds[1].y };
        // Single precision, so that what is written lies on the line exactly.
        #[allow(clippy::cast_possible_truncation, reason = "this rounding is the purpose")]
        let line = (start + f64::from(position) * self.side_m(axis)) as f32;
        f64::from(line)
    }

    /// Positions of the tiles that a stretch reaches into.
    fn positions(&self, axis: usize, [low, high]: [f64; 2]) -> std::ops::RangeInclusive<u32> {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the value is clamped to the range first"
        )]
        let position = |v: f64| {
            let tiles = (v - self.line_m(axis, 0)) / self.side_m(axis);
            tiles.clamp(0.0, f64::from(self.per_side - 1)) as u32
        };
        // A stretch that ends near a line may round to either side of it.
        position(low - MARGIN_M / 100.0)..=position(high + MARGIN_M / 100.0)
    }

    /// The lines around a tile, by side.
    fn lines(&self, [column, row]: [u32; 2]) -> [(Side, f64); 4] {
        [
            (Side::East, self.line_m(0, column + 1)),
            (Side::South, self.line_m(1, row + 1)),
            (Side::West, self.line_m(0, column)),
            (Side::North, self.line_m(1, row)),
        ]
    }
}

/// All tiles, row by row, those without polygons too.
pub(super) fn cut(mesh: &NavMesh, grid: &Grid) -> Vec<Tile> {
    let per_side = grid.per_side;
    let mut tiles: Vec<Tile> = (0..per_side)
        .flat_map(|row| (0..per_side).map(move |column| [column, row]))
        .map(|at| Tile::new(at, if per_side > 1 { grid.lines(at).to_vec() } else { Vec::new() }))
        .collect();
    for (index, polygon) in (0..).zip(mesh.polygons()) {
        let outline = mesh.outline(index);
        let [low, high] = bounds(&outline);
        for row in grid.positions(1, [-high.y, -low.y]) {
            for column in grid.positions(0, [low.x, high.x]) {
                let tile = tiles.get_mut((row * per_side + column) as usize);
                let Some(tile) = tile else { continue };
                let lines = tile.lines.clone();
                let inside = lines
                    .iter()
                    .fold(outline.clone(), |ring, (side, line)| clip(&ring, *side, *line));
                add(tile, &inside, polygon.area);
            }
        }
    }
    tiles
}

/// Adds a convex ring of any number of corners.
fn add(tile: &mut Tile, ring: &[Point3<f64>], area: Area) {
    let Some((first, rest)) = ring.split_first() else { return };
    let mut from = 0;
    while from + 1 < rest.len() {
        let to = (from + CORNERS_MAX - 1).min(rest.len());
        let mut corners = vec![*first];
        corners.extend(rest.get(from..to).into_iter().flatten());
        tile.add(&corners, area);
        from = to - 1;
    }
}

/// The part of a convex ring on the inner side of a tile's line.
fn clip(ring: &[Point3<f64>], side: Side, line: f64) -> Vec<Point3<f64>> {
    let beyond: Vec<f64> = ring.iter().map(|corner| side.beyond(corner, line)).collect();
    if beyond.iter().all(|m| *m <= 0.0) {
        return ring.to_vec();
    }
    if beyond.iter().all(|m| *m >= -SLICE_MIN_M) {
        return Vec::new();
    }
    let mut inside = Vec::with_capacity(ring.len() + 2);
    let nexts = ring.iter().zip(&beyond).cycle().skip(1);
    for ((corner, out_m), (next, next_out_m)) in ring.iter().zip(&beyond).zip(nexts) {
        if *out_m <= 0.0 {
            inside.push(*corner);
        }
        if (*out_m < 0.0 && *next_out_m > 0.0) || (*out_m > 0.0 && *next_out_m < 0.0) {
            inside.push(crossing(*corner, *next, side, line));
        }
    }
    inside
}

/// Where an edge crosses a line: the same place whichever way the edge runs.
fn crossing(one: Point3<f64>, other: Point3<f64>, side: Side, line: f64) -> Point3<f64> {
    let is_ordered = (one.x, one.y) < (other.x, other.y);
    let (from, to) = if is_ordered { (one, other) } else { (other, one) };
    let (a, b) = (side.beyond(&from, line), side.beyond(&to, line));
    let mut place = from + (to - from) * (a / (a - b));
    side.put_on(&mut place, line);
    place
}
