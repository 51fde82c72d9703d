//! Which pieces of ground lie at a place, and how high.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3};

use super::piece::{Class, Piece};
use super::surface::closest;

/// Side of the squares pieces are sorted into, in metres.
const CELL_M: f64 = 8.0;
/// A place within this distance of a piece is on it, in metres: less than two steps of the grid.
const ON_PIECE_M: f64 = 1.5e-3;
/// Corners may lie this far beside the piece whose height they take, in metres.
const BESIDE_PIECE_M: f64 = 0.02;

/// The classes of ground at one place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Covers(u8);

impl Covers {
    pub(super) fn has(self, class: Class) -> bool {
        self.0 & (1 << class as u8) != 0
    }

    fn add(&mut self, class: Class) {
        self.0 |= 1 << class as u8;
    }
}

/// Pieces sorted by place.
#[derive(Debug)]
pub(super) struct Cover<'p> {
    pieces: &'p [Piece],
    cells: BTreeMap<[i64; 2], Vec<usize>>,
}

impl<'p> Cover<'p> {
    pub(super) fn new(pieces: &'p [Piece]) -> Self {
        let mut cells: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        for (index, piece) in pieces.iter().enumerate() {
            for cell in cells_of(piece) {
                cells.entry(cell).or_default().push(index);
            }
        }
        Self { pieces, cells }
    }

    /// Squares under the boxes of all pieces, before any of them is sorted.
    pub(super) fn squares(pieces: &[Piece]) -> f64 {
        let side = |low: f64, high: f64| (high - low) / CELL_M + 1.0;
        let under = |piece: &Piece| {
            let (low, high) = box_of(piece);
            side(low[0], high[0]) * side(low[1], high[1])
        };
        pieces.iter().map(under).sum()
    }

    /// Most pieces in one square.
    pub(super) fn fullest(&self) -> usize {
        self.groups().map(<[usize]>::len).max().unwrap_or(0)
    }

    /// The pieces whose boxes share a square, per square.
    pub(super) fn groups(&self) -> impl Iterator<Item = &[usize]> {
        self.cells.values().map(Vec::as_slice)
    }

    pub(super) fn at(&self, place: Point2<f64>) -> Covers {
        let mut covers = Covers::default();
        for piece in self.near(place).filter(|piece| gap_m(piece, place) <= ON_PIECE_M) {
            covers.add(piece.class);
        }
        covers
    }

    /// Height at a place in metres: the highest of the lanes there, else of the crossings, else
    /// of whatever is nearest.
    pub(super) fn height_m(&self, place: Point2<f64>) -> f64 {
        let highest = |wanted: &dyn Fn(&Piece) -> bool, gap_max_m: f64| {
            self.near(place)
                .filter(|piece| wanted(piece))
                .map(|piece| closest(&piece.corners, Point3::new(place.x, place.y, 0.0)))
                .filter(|found| (found.xy() - place).norm() <= gap_max_m)
                .map(|found| found.z)
                .reduce(f64::max)
        };
        highest(&|piece| piece.class != Class::Crosswalk, BESIDE_PIECE_M)
            .or_else(|| highest(&|_| true, BESIDE_PIECE_M))
            .or_else(|| highest(&|_| true, f64::INFINITY))
            .unwrap_or(0.0)
    }

    fn near(&self, place: Point2<f64>) -> impl Iterator<Item = &'p Piece> {
        let around = self.cells.get(&cell([place.x, place.y]));
        let pieces = self.pieces;
        around.into_iter().flatten().filter_map(move |index| pieces.get(*index))
    }
}

fn gap_m(piece: &Piece, place: Point2<f64>) -> f64 {
    (closest(&piece.corners, Point3::new(place.x, place.y, 0.0)).xy() - place).norm()
}

#[allow(clippy::cast_possible_truncation, reason = "places of pieces are limited")]
fn cell(place: [f64; 2]) -> [i64; 2] {
    place.map(|v| (v / CELL_M).floor() as i64)
}

/// The squares a piece reaches into.
fn cells_of(piece: &Piece) -> Vec<[i64; 2]> {
    let (low, high) = box_of(piece);
    let (low, high) = (cell(low), cell(high));
    (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| [x, y])).collect()
}

/// The corners of a piece's box, and a little more.
fn box_of(piece: &Piece) -> ([f64; 2], [f64; 2]) {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for corner in &piece.corners {
        for axis in 0..2 {
            low[axis] = low[axis].min(corner[axis] - BESIDE_PIECE_M);
            high[axis] = high[axis].max(corner[axis] + BESIDE_PIECE_M);
        }
    }
    (low, high)
}
