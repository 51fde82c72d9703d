//! Where one speed limit holds all around, so that who is told it need not search for it again.

use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::Point3;

use crate::chords::Chord;
use crate::kinds::LaneTypes;
use crate::map::Map;

/// Side and height of a cell, in metres; sides are longer on maps with too many cells.
const CELL_M: f64 = 3.0;
const CELL_HEIGHT_M: f64 = 3.0;
const CELLS_MAX: f64 = 131_072.0;
/// How much farther away than computed something may be, in metres.
const ROUNDING_M: f64 = 1.0e-3;
/// What stands for a cell of which nothing is known.
const UNKNOWN: u64 = 0;

/// Cells of a map seen from above. Each is known at one height, that of who asked first; a bridge
/// and the road below it are not known both.
#[derive(Debug)]
pub(super) struct LimitCells {
    low_m: [f64; 2],
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// By cell: the limit as [`About::bits`] in the lower half, the height in cells in the upper.
    known: Vec<AtomicU64>,
}

/// What holds on the driving lanes of which one is the nearest to some place of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
enum About {
    /// All of them lead through junctions.
    Junctions,
    /// The same on all that do not, in metres per second.
    Limit(f32),
    /// Not the same, or none.
    Several,
}

impl About {
    fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Junctions, about) | (about, Self::Junctions) => about,
            (a, b) if a == b => a,
            _ => Self::Several,
        }
    }

    /// No limit is one of these two numbers.
    fn bits(self) -> u32 {
        match self {
            Self::Junctions => f32::INFINITY.to_bits(),
            Self::Limit(limit_mps) => limit_mps.to_bits(),
            Self::Several => f32::NAN.to_bits(),
        }
    }

    fn of_bits(bits: u32) -> Self {
        match f32::from_bits(bits) {
            f32::INFINITY => Self::Junctions,
            limit_mps if limit_mps.is_nan() => Self::Several,
            limit_mps => Self::Limit(limit_mps),
        }
    }
}

impl LimitCells {
    /// - **Domain:** the box around all lanes of a map; none for one without lanes.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "sides are not negative, and there are at most so many cells"
    )]
    pub(super) fn new(bounds: Option<(Point3<f64>, Point3<f64>)>) -> Self {
        let (low, high) = bounds.unwrap_or_default();
        let [length_m, width_m] = [high.x - low.x, high.y - low.y];
        let least_m = length_m.max(width_m) / CELLS_MAX;
        let cell_m = CELL_M.max((length_m * width_m / CELLS_MAX).sqrt()).max(least_m);
        let [columns, rows] = [length_m, width_m].map(|side_m| (side_m / cell_m) as usize + 1);
        let known = (0..columns * rows).map(|_| AtomicU64::new(UNKNOWN)).collect();
        Self { low_m: [low.x, low.y], cell_m, columns, rows, known }
    }

    /// What holds around a place, if that can be known.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a column and a row are compared before, and heights of maps are small"
    )]
    fn about(&self, map: &Map, point: &Point3<f64>) -> About {
        let column = (point.x - self.low_m[0]) / self.cell_m;
        let row = (point.y - self.low_m[1]) / self.cell_m;
        // Most maps are flat, and the middle of a storey is there.
        let storey = (point.z / CELL_HEIGHT_M).round();
        let is_within =
            column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        if !is_within {
            return About::Several;
        }
        let cell = row as usize * self.columns + column as usize;
        let Some(known) = self.known.get(cell) else { return About::Several };
        let height = u64::from(storey as i32 as u32) << 32;
        let bits = known.load(Ordering::Relaxed);
        if bits == UNKNOWN {
            let middle =
                |place: f64, axis: usize| self.low_m[axis] + (place.floor() + 0.5) * self.cell_m;
            let z = storey * CELL_HEIGHT_M;
            let about = self.search(map, &Point3::new(middle(column, 0), middle(row, 1), z));
            known.store(height | u64::from(about.bits()), Ordering::Relaxed);
            return about;
        }
        let is_as_high = bits >> 32 == height >> 32;
        if is_as_high { About::of_bits(bits as u32) } else { About::Several }
    }

    /// What holds on all driving lanes that may be the nearest to some place of a cell.
    fn search(&self, map: &Map, middle: &Point3<f64>) -> About {
        let types = LaneTypes::DRIVING;
        let Some((_, _, nearest2)) = map.index.nearest_within(middle, types, f64::INFINITY) else {
            return About::Several;
        };
        // A corner is so far from the middle, and the lane that is the nearest to the middle is
        // farther from the corner by as much at most; whatever is nearer is within twice that.
        let corner_m =
            (0.5 * self.cell_m * self.cell_m + 0.25 * CELL_HEIGHT_M * CELL_HEIGHT_M).sqrt();
        let within_m = nearest2.sqrt() + 2.0 * corner_m + ROUNDING_M;
        let mut about = About::Junctions;
        map.index.each_within(middle, types, within_m, |chord| {
            about = about.with(map.about_chord(chord));
        });
        about
    }
}

impl Map {
    /// Whether a limit, in metres per second, surely holds on the driving lane that is nearest to a
    /// place, or that lane leads through a junction. Where it may not hold, a search tells.
    ///
    /// **Cost:** some nanoseconds, or two searches for who is first in a part of the map.
    #[must_use]
    pub fn surely_holds(&self, limit_mps: f32, point: &Point3<f64>) -> bool {
        match self.speed_limits().cells.about(self, point) {
            About::Junctions => true,
            About::Limit(known_mps) => known_mps == limit_mps,
            About::Several => false,
        }
    }

    #[allow(clippy::cast_possible_truncation, reason = "as vehicles are told limits")]
    fn about_chord(&self, chord: &Chord) -> About {
        let [from_s, to_s] = chord.ends_s();
        let ends = (self.waypoint_on(chord.lane, from_s), self.waypoint_on(chord.lane, to_s));
        let (Some(from), Some(to)) = ends else { return About::Several };
        if self.is_in_junction(&from) {
            return About::Junctions;
        }
        let limit_mps = self.speed_limit_along_mps([&from, &to]);
        limit_mps.map_or(About::Several, |limit_mps| About::Limit(limit_mps as f32))
    }
}
