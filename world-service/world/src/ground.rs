//! Height, slope and grip of the ground at a point, from triangles in a uniform grid.
//!
//! Wheels and fallen bodies ask this instead of colliding with a mesh inside the physics engine:
//! the ground is shared by all worlds of a map and never part of a snapshot.

mod alone;
mod face;

use std::ops::Range;

use nalgebra::Vector2;
use schemas::Vec3;

use alone::Alone;
pub(crate) use alone::Known;
use face::{Bounds, EDGE_M, Face, Skin, face};

/// Cells of one ground, so that a long road does not cost gigabytes.
const CELLS_MAX: usize = 1 << 20;
/// Side of a cell unless the ground is too large for it.
const CELL_M: f32 = 2.0;
/// Friction coefficient of a dry tyre where there is no mesh: that of grass.
const OPEN_LAND_FRICTION: f32 = 0.5;

/// Depth under the lowest surface from which nothing comes up by itself.
const BURIED_M: f32 = 1.0;

/// The ground under a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surface {
    /// z of the surface at the queried x and y.
    pub height_m: f32,
    /// Unit, upwards.
    pub normal: Vec3,
    /// Coefficient of a dry tyre on it.
    pub friction: f32,
}

/// Triangles seen from above, findable by x and y.
#[derive(Debug)]
pub(crate) struct Ground {
    faces: Vec<Face>,
    /// By face.
    skins: Vec<Skin>,
    /// Face indices of all cells, one after the other.
    cell_faces: Vec<u32>,
    /// Where each cell's faces start in `cell_faces`; one more than there are cells.
    cell_starts: Vec<u32>,
    alone: Alone,
    /// The highest that the faces of each cell can be inside it.
    cell_tops_m: Vec<f32>,
    origin_m: Vector2<f32>,
    cell_m: f32,
    /// Exact, as sides of cells are powers of two.
    cells_per_m: f32,
    columns: usize,
    rows: usize,
    /// Endless plane where there is no triangle.
    open_land: Surface,
}

impl Ground {
    /// - **Domain:** `triangles` with the friction coefficient of a dry tyre on them; walls and
    ///   degenerate ones are left out.
    pub(crate) fn new(triangles: impl IntoIterator<Item = ([Vec3; 3], f32)>) -> Self {
        let (mut faces, mut skins, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
        for (face, skin, corners) in triangles.into_iter().filter_map(face) {
            faces.push(face);
            skins.push(skin);
            bounds.push(corners);
        }
        let (low, high) = around(&bounds);
        let size = high - low;
        let cell_m = cell_side_m(size.x, size.y);
        let columns = cells_along(size.x, cell_m);
        let rows = cells_along(size.y, cell_m);
        let mut ground = Self {
            open_land: Surface { height_m: low.z, normal: Vec3::z(), friction: OPEN_LAND_FRICTION },
            faces,
            skins,
            cell_faces: Vec::new(),
            cell_starts: Vec::new(),
            alone: Alone::default(),
            cell_tops_m: Vec::new(),
            origin_m: low.xy(),
            cell_m,
            cells_per_m: cell_m.recip(),
            columns,
            rows,
        };
        ground.fill_cells(&bounds);
        ground
    }

    /// The highest surface at (x, y) that is not above `point.z`.
    ///
    /// - **Cost:** about 20 ns on a street.
    pub(crate) fn below(&self, point: Vec3) -> Surface {
        let highest = self.cell_index(point).and_then(|cell| self.highest(cell, point));
        highest.map_or(self.open_land, |(height_m, entry)| {
            self.surface(height_m, self.cell_faces[entry])
        })
    }

    /// The height of the highest face of a cell at a point that is not above it, and its entry in
    /// the list.
    #[inline]
    fn highest(&self, cell: usize, point: Vec3) -> Option<(f32, usize)> {
        let mut best: Option<(f32, usize)> = None;
        let entries = self.entries(cell);
        for (entry, index) in entries.clone().zip(&self.cell_faces[entries]) {
            let Some(height_m) = self.faces[*index as usize].height_at_m(point) else { continue };
            if height_m <= point.z && best.is_none_or(|(best_m, _)| best_m < height_m) {
                best = Some((height_m, entry));
            }
        }
        best
    }

    fn surface(&self, height_m: f32, face: u32) -> Surface {
        let (normal, friction) = self.skins[face as usize];
        Surface { height_m, normal, friction }
    }

    /// Whether there is surely no ground above a point, found faster than the ground itself.
    pub(crate) fn is_all_below(&self, point: Vec3) -> bool {
        let top_m = self.cell_index(point).map_or(f32::NEG_INFINITY, |cell| self.cell_tops_m[cell]);
        point.z > top_m.max(self.open_land.height_m)
    }

    /// Whether a point lies so deep that there is no ground for it. Programs wait with actors down
    /// there until they put them on the road.
    pub(crate) fn buries(&self, point: Vec3) -> bool {
        point.z < self.open_land.height_m - BURIED_M
    }

    /// Where the faces of a cell are in the list of all.
    fn entries(&self, cell: usize) -> Range<usize> {
        self.cell_starts[cell] as usize..self.cell_starts[cell + 1] as usize
    }

    fn cell_index(&self, point: Vec3) -> Option<usize> {
        let cells = self.cells(point);
        self.holds(cells).then(|| self.cell_at(cells))
    }

    /// From the origin to a point, in cells.
    fn cells(&self, point: Vec3) -> Vector2<f32> {
        (point.xy() - self.origin_m) * self.cells_per_m
    }

    fn holds(&self, cells: Vector2<f32>) -> bool {
        let most = Vector2::new(self.columns as f32, self.rows as f32);
        cells.x >= 0.0 && cells.y >= 0.0 && cells.x < most.x && cells.y < most.y
    }

    fn cell_at(&self, cells: Vector2<f32>) -> usize {
        cells.y as usize * self.columns + cells.x as usize
    }

    /// Two passes: count the faces of each cell, then place them.
    fn fill_cells(&mut self, bounds: &[Bounds]) {
        let mut starts = vec![0u32; self.columns * self.rows + 1];
        for (face, corners) in self.faces.iter().zip(bounds) {
            self.for_cells_of(face, corners, |cell| starts[cell + 1] += 1);
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut cell_faces = vec![0u32; starts.last().copied().unwrap_or(0) as usize];
        let mut tops_m = vec![f32::NEG_INFINITY; self.columns * self.rows];
        for (index, (face, corners)) in self.faces.iter().zip(bounds).enumerate() {
            self.for_cells_of(face, corners, |cell| {
                cell_faces[next[cell] as usize] = index as u32;
                next[cell] += 1;
                let top_m = self.top_m(face, cell).min(corners.1.z) + EDGE_M;
                tops_m[cell] = tops_m[cell].max(top_m);
            });
        }
        self.cell_tops_m = tops_m;
        self.cell_starts = starts;
        self.alone = Alone::unknown(cell_faces.len());
        self.cell_faces = cell_faces;
    }

    /// The highest that the plane of a face is inside a cell.
    fn top_m(&self, face: &Face, cell: usize) -> f32 {
        let corners_m = self.corners_m(cell).map(|xy_m| face.height_m(xy_m.push(0.0)));
        corners_m.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }

    fn corners_m(&self, cell: usize) -> [Vector2<f32>; 4] {
        let low = Vector2::new((cell % self.columns) as f32, (cell / self.columns) as f32);
        self.square_m(low, 1.0)
    }

    /// Corners of a square, its low corner and its side given in cells.
    fn square_m(&self, low: Vector2<f32>, side: f32) -> [Vector2<f32>; 4] {
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
            .map(|(x, y)| self.origin_m + (low + Vector2::new(x, y) * side) * self.cell_m)
    }

    /// Calls for the cells of which a face may cover a point.
    fn for_cells_of(&self, face: &Face, (low, high): &Bounds, mut visit: impl FnMut(usize)) {
        let index = |coordinate: f32, origin: f32, count: usize| {
            (((coordinate - origin) / self.cell_m).max(0.0) as usize).min(count - 1)
        };
        let columns = index(low.x - EDGE_M, self.origin_m.x, self.columns)
            ..=index(high.x + EDGE_M, self.origin_m.x, self.columns);
        for row in index(low.y - EDGE_M, self.origin_m.y, self.rows)
            ..=index(high.y + EDGE_M, self.origin_m.y, self.rows)
        {
            for column in columns.clone() {
                let cell = row * self.columns + column;
                if face.may_cover(&self.corners_m(cell)) {
                    visit(cell);
                }
            }
        }
    }
}

/// The box around all faces.
fn around(bounds: &[Bounds]) -> Bounds {
    bounds
        .iter()
        .copied()
        .reduce(|(low, high), (l, h)| (low.inf(&l), high.sup(&h)))
        .unwrap_or((Vec3::zeros(), Vec3::zeros()))
}

fn cells_along(size_m: f32, cell_m: f32) -> usize {
    (size_m / cell_m) as usize + 1
}

fn cell_side_m(size_x_m: f32, size_y_m: f32) -> f32 {
    let mut side_m = CELL_M;
    while cells_along(size_x_m, side_m).saturating_mul(cells_along(size_y_m, side_m)) > CELLS_MAX {
        side_m *= 2.0;
    }
    side_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f32, high: f32, z: f32, slope: f32) -> [([Vec3; 3], f32); 2] {
        let at = |x: f32, y: f32| Vec3::new(x, y, z + slope * x);
        [
            ([at(low, low), at(high, low), at(high, high)], 1.0),
            ([at(low, low), at(high, high), at(low, high)], 1.0),
        ]
    }

    #[test]
    fn the_highest_surface_below_the_point_counts() {
        let bridge = square(-10.0, 10.0, 0.0, 0.0).into_iter().chain(square(-5.0, 5.0, 6.0, 0.0));
        let ground = Ground::new(bridge);
        assert_eq!(ground.below(Vec3::new(1.0, 2.0, 7.0)).height_m, 6.0);
        assert_eq!(ground.below(Vec3::new(1.0, 2.0, 3.0)).height_m, 0.0);
        assert_eq!(ground.below(Vec3::new(8.0, 2.0, 7.0)).height_m, 0.0);
    }

    #[test]
    fn nothing_is_above_a_point_over_all_of_its_cell() {
        let ground = Ground::new(square(-50.0, 50.0, 0.0, 0.1));
        for x in [-49.9f32, -3.7, 0.0, 12.34, 49.9, 80.0] {
            let surface = ground.below(Vec3::new(x, 0.1, 20.0));
            let at = |above_m: f32| Vec3::new(x, 0.1, surface.height_m + above_m);
            assert!(!ground.is_all_below(at(-0.01)), "{x}");
            assert!(ground.is_all_below(at(0.1 * CELL_M + 0.02)), "{x}");
        }
    }

    #[test]
    fn a_slope_has_its_height_and_normal_everywhere() {
        let ground = Ground::new(square(-50.0, 50.0, 0.0, 0.1));
        for x in [-49.9f32, -3.7, 0.0, 12.34, 49.9] {
            let surface = ground.below(Vec3::new(x, 0.1, 20.0));
            assert!((surface.height_m - 0.1 * x).abs() < 1.0e-4, "{surface:?} at {x}");
            assert!((surface.normal.x + 0.1 * surface.normal.z).abs() < 1.0e-5);
        }
    }

    #[test]
    fn cells_hold_all_faces_that_cover_a_point_in_them() {
        let random = |at: u32| {
            let mixed = at.wrapping_mul(0x9e37_79b1) ^ (at >> 5);
            ((mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 8) as f32 / 16_777_216.0
        };
        for origin_m in [0.0, -3_000.0, 20_000.0] {
            let place = |at: u32, reach_m: f32| {
                let [x, y, z] = [0, 1, 2].map(|axis| random(3 * at + axis));
                Vec3::new(origin_m + reach_m * x, origin_m - reach_m * y, 9.0 * z)
            };
            let triangles = (0..400).map(|at| {
                let middle = place(at, 90.0);
                let off = |corner: u32| place(1_000 + 3 * at + corner, 14.0);
                let base = Vec3::new(origin_m, origin_m, 0.0);
                ([0, 1, 2].map(|corner| middle + off(corner) - base), 1.0)
            });
            let ground = Ground::new(triangles);
            for point in (9_000..13_000).map(|at| place(at, 104.0) + Vec3::z() * 3.0) {
                let covering = ground.faces.iter().filter_map(|face| face.height_at_m(point));
                let below = covering.filter(|z| *z <= point.z);
                let highest_m = below.fold(f32::NEG_INFINITY, f32::max);
                let wanted_m =
                    if highest_m.is_finite() { highest_m } else { ground.open_land.height_m };
                assert_eq!(ground.below(point).height_m, wanted_m, "{point:?}");
            }
        }
    }

    #[test]
    fn there_is_no_gap_on_the_seam_of_two_triangles() {
        let ground = Ground::new(square(0.0, 7.0, 3.0, 0.0));
        for step in 0..=700 {
            let along = step as f32 * 0.01;
            assert_eq!(ground.below(Vec3::new(along, along, 5.0)).height_m, 3.0, "{along}");
        }
    }

    #[test]
    fn outside_the_mesh_lies_open_land_at_its_lowest_height() {
        let ground = Ground::new(square(0.0, 10.0, -2.0, 0.0));
        assert_eq!(ground.below(Vec3::new(1.0e6, -5.0, 50.0)).height_m, -2.0);
        assert_eq!(Ground::new([]).below(Vec3::new(3.0, 4.0, 5.0)).height_m, 0.0);
    }

    #[test]
    fn a_huge_ground_stays_within_the_cell_limit() {
        let ground = Ground::new(square(-50_000.0, 50_000.0, 0.0, 0.0));
        assert!(ground.columns * ground.rows <= CELLS_MAX);
        assert_eq!(ground.below(Vec3::new(-49_000.0, 49_000.0, 1.0)).height_m, 0.0);
    }
}
