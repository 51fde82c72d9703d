//! Flat convex pieces of ground, with corners on a grid so that neighbours meet exactly.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::mesh::convex_hull;

/// Steps of the grid per metre.
const GRID_PER_M: f64 = 1000.0;
/// Corners nearer than this to an earlier one become that one, in metres.
const WELD_M: f64 = 0.05;
/// Corners are only the same when their heights differ by less, in metres.
const STOREY_M: f64 = 1.0;
/// Corners on a line bulge by less, in square metres; others bulge by a step of the grid at least.
const FLAT_M2: f64 = 1e-9;
/// Pieces further away from the origin are left out, in metres; the grid is 32 bits wide.
const PLACE_ABS_MAX_M: f64 = 1e6;

/// What a piece of ground comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    /// Where vehicles drive or stand.
    Road,
    /// Sidewalk lanes without the borders that a walker's body takes.
    Sidewalk,
    /// A pedestrian crossing.
    Crosswalk,
    /// The step from the road onto the sidewalk.
    Kerb,
}

/// One piece; its corners are counter-clockwise and convex seen from above.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) class: Class,
    /// Position of its road in the model.
    pub(super) road: u32,
    /// In metres, x and y on the grid.
    pub(super) corners: Vec<Point3<f64>>,
}

/// A place on the grid.
pub(super) type GridPoint = [i32; 2];

/// The place on the grid nearest to a point that lies within [`PLACE_ABS_MAX_M`].
#[allow(clippy::cast_possible_truncation, reason = "a thousand times the largest place fits")]
pub(super) fn grid_point(point: &Point3<f64>) -> GridPoint {
    [point.x, point.y].map(|v| (v * GRID_PER_M).round() as i32)
}

/// The inverse of [`grid_point`], for points between the grid's as well.
pub(super) fn metres(grid: [f64; 2]) -> [f64; 2] {
    grid.map(|v| v / GRID_PER_M)
}

/// Collects pieces; each corner snaps to a corner that is already near.
#[derive(Debug, Default)]
pub(super) struct Weld {
    pieces: Vec<Piece>,
    corners: BTreeMap<[i64; 2], Vec<Point3<f64>>>,
}

impl Weld {
    /// Number of pieces so far.
    pub(super) fn len(&self) -> usize {
        self.pieces.len()
    }

    pub(super) fn into_pieces(self) -> Vec<Piece> {
        self.pieces
    }

    /// Adds the convex hull of some corners; nothing when it has no area or no place.
    pub(super) fn add(&mut self, class: Class, road: u32, corners: &[Point3<f64>]) {
        // Written so that a place that is no number is left out, too.
        let near = |p: &Point3<f64>| p.coords.iter().all(|v| v.abs() < PLACE_ABS_MAX_M);
        if !corners.iter().all(near) {
            return;
        }
        let corners =
            convex_hull(corners.iter().map(|corner| self.snap(corner)).collect(), FLAT_M2);
        if corners.len() >= 3 {
            self.pieces.push(Piece { class, road, corners });
        }
    }

    #[allow(clippy::cast_possible_truncation, reason = "places are limited")]
    fn snap(&mut self, point: &Point3<f64>) -> Point3<f64> {
        let cell = [point.x, point.y].map(|v| (v / WELD_M).floor() as i64);
        for dx in -1..=1 {
            for dy in -1..=1 {
                let around = self.corners.get(&[cell[0] + dx, cell[1] + dy]);
                let near = around.into_iter().flatten().find(|known| {
                    (known.xy() - point.xy()).norm() < WELD_M
                        && (known.z - point.z).abs() < STOREY_M
                });
                if let Some(known) = near {
                    return Point3::new(known.x, known.y, point.z);
                }
            }
        }
        let [x, y] = metres(grid_point(point).map(f64::from));
        let rounded = Point3::new(x, y, point.z);
        self.corners.entry(cell).or_default().push(rounded);
        rounded
    }
}
