//! The road as short straight pieces: middles of lanes, lines, edges, crossings and stop lines.

use std::sync::OnceLock;

use nalgebra::{Point3, Vector3};
use roads::{LaneMark, Map, MarkType, Waypoint};

use crate::line::StopLine;

/// Pieces along lanes are so long, in metres.
const STEP_M: f64 = 5.0;
/// Longest half of a piece and widest lane that are told of, in metres.
const SIZE_M_MAX: f32 = 50.0;
/// Side of a cell, in metres; each has the pieces that are nearest to its middle.
const CELL_M: f32 = 5.0;
/// Cells of one map; a larger one has larger cells.
const CELLS_MAX: f32 = 1.0e6;
/// Side of a bin that pieces are sorted by, in metres, and bins to either side that are searched.
const BIN_M: f32 = 25.0;
const BINS: i32 = 3;

/// What a piece is; its number stands in the column `kind`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    LaneMiddle = 0,
    /// A line that may be crossed.
    Broken = 1,
    /// A line that may not, or where the road ends.
    Edge = 2,
    Crossing = 3,
    StopLine = 4,
}

/// One piece, seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub x_m: f32,
    pub y_m: f32,
    pub cos: f32,
    pub sin: f32,
    pub half_length_m: f32,
    /// Of the lane; 0 for lines.
    pub width_m: f32,
    pub kind: f32,
}

/// All pieces of a map, and those near each cell.
#[derive(Debug)]
pub(super) struct Roads {
    pieces: Vec<Piece>,
    /// By bin of a grid, positions of pieces; ordered.
    bins: Vec<((i32, i32), u32)>,
    left_m: f32,
    low_m: f32,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// Worked out when first asked for.
    near: Vec<OnceLock<Box<[u32]>>>,
    count: usize,
}

impl Roads {
    /// Those of a map; `count` are told of near a place, at most.
    pub(super) fn new(map: &Map, count: usize) -> Self {
        let mut pieces = lanes(map);
        pieces.extend(crossings(map));
        pieces.extend(StopLine::all(map).iter().map(stop_line));
        let bounds = |of: fn(&Piece) -> f32| {
            let (low, high) = (f32::INFINITY, f32::NEG_INFINITY);
            pieces.iter().map(of).fold((low, high), |(low, high), at| (low.min(at), high.max(at)))
        };
        let ((left_m, right_m), (low_m, high_m)) = match pieces.is_empty() {
            true => ((0.0, 0.0), (0.0, 0.0)),
            false => (bounds(|piece| piece.x_m), bounds(|piece| piece.y_m)),
        };
        let (left_m, low_m) = (left_m - BIN_M, low_m - BIN_M);
        let (wide_m, deep_m) = (right_m + BIN_M - left_m, high_m + BIN_M - low_m);
        let cell_m = CELL_M.max((wide_m * deep_m / CELLS_MAX).sqrt());
        let (columns, rows) = ((wide_m / cell_m) as usize + 1, (deep_m / cell_m) as usize + 1);
        let bin = |(index, piece): (usize, &Piece)| (bin(piece.x_m, piece.y_m), index as u32);
        let mut bins: Vec<_> = pieces.iter().enumerate().map(bin).collect();
        bins.sort_unstable();
        let near = std::iter::repeat_with(OnceLock::new).take(columns * rows).collect();
        Self { pieces, bins, left_m, low_m, cell_m, columns, rows, near, count }
    }

    /// The nearest pieces, the same for all places of a cell, nearest to its middle first.
    pub(super) fn near(&self, x_m: f32, y_m: f32) -> impl Iterator<Item = &Piece> {
        let cell = |from_m: f32, most: usize| ((from_m / self.cell_m).max(0.0) as usize).min(most);
        let column = cell(x_m - self.left_m, self.columns - 1);
        let row = cell(y_m - self.low_m, self.rows - 1);
        let found = self.near[row * self.columns + column].get_or_init(|| {
            let middle = |at: usize, from_m: f32| from_m + (at as f32 + 0.5) * self.cell_m;
            self.search(middle(column, self.left_m), middle(row, self.low_m))
        });
        found.iter().map(|index| &self.pieces[*index as usize])
    }

    fn search(&self, x_m: f32, y_m: f32) -> Box<[u32]> {
        let (column, row) = bin(x_m, y_m);
        let mut found: Vec<(f32, u32)> = Vec::new();
        for column in column - BINS..=column + BINS {
            let from = self.bins.partition_point(|(at, _)| *at < (column, row - BINS));
            let bins = self.bins[from..].iter();
            let within = bins.take_while(|(at, _)| *at <= (column, row + BINS));
            found.extend(within.map(|&(_, index)| {
                let piece = &self.pieces[index as usize];
                let (x, y) = (piece.x_m - x_m, piece.y_m - y_m);
                (x * x + y * y, index)
            }));
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().take(self.count).map(|(_, index)| index).collect()
    }
}

fn bin(x_m: f32, y_m: f32) -> (i32, i32) {
    ((x_m / BIN_M).floor() as i32, (y_m / BIN_M).floor() as i32)
}

/// Middles of driving lanes, and the lines beside them, each once.
fn lanes(map: &Map) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (entry, exit) in map.driving_lanes() {
        let length_m = (exit.s - entry.s).abs();
        let steps = (length_m / STEP_M).ceil().max(1.0);
        let place = |step: f64| {
            let s = entry.s + (exit.s - entry.s) * (step / steps);
            let on = Waypoint { s, ..entry };
            let info = map.lane(&on);
            let pose = map.pose(&on);
            let left = pose.rotation * Vector3::y() * (info.width_m / 2.0);
            let middle = pose.translation.vector;
            ([middle, middle + left, middle - left], info)
        };
        let mut step = 0.0;
        let mut from = place(step);
        while step < steps {
            step += 1.0;
            let to = place(step);
            let between = Waypoint { s: (entry.s + exit.s) / 2.0, ..entry };
            let pair = |at: usize| (from.0[at], to.0[at]);
            pieces.push(piece(pair(0), from.1.width_m as f32, Kind::LaneMiddle));
            // A line between lanes of both directions belongs to the right one of the road.
            if map.left_driving(&between).is_none_or(|beside| beside.lane < 0 && entry.lane > 0)
                || map.left(&between).is_some_and(|beside| beside.lane > 0) && entry.lane < 0
            {
                pieces.push(piece(pair(1), 0.0, kind(from.1.left_mark)));
            }
            pieces.push(piece(pair(2), 0.0, kind(from.1.right_mark)));
            from = to;
        }
    }
    pieces
}

fn kind(mark: Option<LaneMark>) -> Kind {
    match mark.map(|mark| mark.mark_type) {
        Some(MarkType::Broken | MarkType::BrokenBroken) => Kind::Broken,
        _ => Kind::Edge,
    }
}

fn crossings(map: &Map) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for corners in map.crosswalks() {
        let next = corners.iter().skip(1);
        let along = |(from, to): (&Point3<f64>, &Point3<f64>)| {
            piece((from.coords, to.coords), 0.0, Kind::Crossing)
        };
        pieces.extend(corners.iter().zip(next).map(along));
    }
    pieces
}

/// Across its lane.
fn stop_line(line: &StopLine) -> Piece {
    Piece {
        x_m: line.x_m,
        y_m: line.y_m,
        cos: -line.sin,
        sin: line.cos,
        half_length_m: line.half_width_m.min(SIZE_M_MAX),
        width_m: 0.0,
        kind: f32::from(Kind::StopLine as u8),
    }
}

fn piece((from, to): (Vector3<f64>, Vector3<f64>), width_m: f32, kind: Kind) -> Piece {
    let (middle, way) = ((from + to) / 2.0, to - from);
    let length_m = way.xy().norm().max(1.0e-6);
    Piece {
        x_m: middle.x as f32,
        y_m: middle.y as f32,
        cos: (way.x / length_m) as f32,
        sin: (way.y / length_m) as f32,
        half_length_m: (length_m as f32 / 2.0).min(SIZE_M_MAX),
        width_m: width_m.min(SIZE_M_MAX),
        kind: f32::from(kind as u8),
    }
}
