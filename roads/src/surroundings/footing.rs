//! Which land is free: a grid of squares that lanes and things have taken.

use crate::lanes::lateral;
use crate::model::{Model, Object, Road};

/// Side of a square, in metres.
const CELL_M: f64 = 1.0;
/// Most squares of a map; larger maps get larger squares.
const CELLS_MAX: f64 = 32e6;
/// Distance of houses from the nearest lane and from each other, in metres.
const CLEAR_M: f64 = 1.0;
/// Half of the side of the land that a post or a trunk takes, in metres.
const POST_HALF_M: f64 = 0.3;
/// Side of the larger squares in which heights are compared, in metres.
const REGION_M: f64 = 40.0;
/// Longest side of a map that gets surroundings, in metres.
const SIDE_MAX_M: f64 = 50_000.0;
/// Lanes further from their reference line do not count, in metres.
const REACH_MAX_M: f64 = 100.0;
/// Roads that rise by more over the lowest one near them may be bridges, in metres.
const RISE_MAX_M: f64 = 2.5;

/// Free and taken land, and the lowest road around.
pub(super) struct Footing {
    min: [f64; 2],
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// One bit per square.
    taken: Vec<u64>,
    region_columns: usize,
    lowest_m: Vec<f64>,
}

impl Footing {
    /// `None` for a map whose roads lie nowhere, or too far from each other.
    pub(super) fn new(model: &Model) -> Option<Self> {
        let mut min = [f64::INFINITY; 2];
        let mut max = [f64::NEG_INFINITY; 2];
        for road in &model.roads {
            for sample in samples(road) {
                for t in [sample.right_t, sample.left_t] {
                    let at = sample.point(t);
                    min = [min[0].min(at[0]), min[1].min(at[1])];
                    max = [max[0].max(at[0]), max[1].max(at[1])];
                }
            }
        }
        let margin_m = REGION_M;
        let size = [0, 1].map(|k| max[k] - min[k] + 2.0 * margin_m);
        if !size.iter().all(|side_m| *side_m < SIDE_MAX_M) {
            return None;
        }
        let cell_m = CELL_M.max((size[0] * size[1] / CELLS_MAX).sqrt());
        let [columns, rows] = size.map(|side_m| whole(side_m / cell_m) + 1);
        let [region_columns, region_rows] = size.map(|side_m| whole(side_m / REGION_M) + 1);
        let mut footing = Self {
            min: min.map(|v| v - margin_m),
            cell_m,
            columns,
            rows,
            taken: vec![0; columns * rows / 64 + 1],
            region_columns,
            lowest_m: vec![f64::INFINITY; region_columns * region_rows],
        };
        for road in &model.roads {
            for sample in samples(road) {
                footing.cover(&sample);
            }
        }
        Some(footing)
    }

    /// Takes the land across a road.
    fn cover(&mut self, sample: &Sample) {
        let mut t = sample.right_t;
        while t < sample.left_t + CELL_M {
            let at = sample.point(t.min(sample.left_t));
            if let Some(cell) = self.cell(at) {
                self.mark(cell);
            }
            t += CELL_M / 2.0;
        }
        let region = self.region(sample.point(0.0));
        if let Some(lowest_m) = self.lowest_m.get_mut(region) {
            *lowest_m = lowest_m.min(sample.z);
        }
    }

    /// Whether a road lies no higher than those around it, so that the land is as high as the road.
    pub(super) fn is_level(&self, road: &Road, s: f64) -> bool {
        let at = road.reference(s);
        let z = road.elevation.value(s);
        let steps = [-REGION_M, 0.0, REGION_M];
        steps.iter().all(|dx| {
            steps.iter().all(|dy| {
                let region = self.region([at.x + dx, at.y + dy]);
                let lowest_m = self.lowest_m.get(region).copied().unwrap_or(f64::INFINITY);
                z - lowest_m < RISE_MAX_M
            })
        })
    }

    /// Takes the land of a thing beside a road; false, and nothing taken, where it is not free.
    pub(super) fn take(&mut self, road: &Road, thing: &Object) -> bool {
        let reference = road.reference(thing.s);
        let (sin, cos) = reference.heading_rad.sin_cos();
        let middle = [reference.x - thing.t * sin, reference.y + thing.t * cos];
        let (sin, cos) = (reference.heading_rad + thing.heading_rad).sin_cos();
        // A tree takes the land of its trunk; the crown may hang over a road.
        let reach = if thing.object_type == "building" {
            [thing.length_m, thing.width_m].map(|side_m| side_m / 2.0 + CLEAR_M)
        } else {
            [POST_HALF_M; 2]
        };
        let mut cells = Vec::new();
        for u in steps(reach[0], self.cell_m) {
            for v in steps(reach[1], self.cell_m) {
                let at = [middle[0] + u * cos - v * sin, middle[1] + u * sin + v * cos];
                match self.cell(at) {
                    Some(cell) if !self.is_taken(cell) => cells.push(cell),
                    _ => return false,
                }
            }
        }
        cells.into_iter().for_each(|cell| self.mark(cell));
        true
    }

    /// The square at a place; `None` off the grid.
    fn cell(&self, at: [f64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|k| (at[k] - self.min[k]) / self.cell_m);
        let inside = x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64;
        inside.then(|| whole(y) * self.columns + whole(x))
    }

    fn region(&self, at: [f64; 2]) -> usize {
        let [x, y] = [0, 1].map(|k| whole(((at[k] - self.min[k]) / REGION_M).max(0.0)));
        y * self.region_columns + x.min(self.region_columns - 1)
    }

    fn is_taken(&self, cell: usize) -> bool {
        self.taken.get(cell / 64).is_none_or(|word| word & (1 << (cell % 64)) != 0)
    }

    fn mark(&mut self, cell: usize) {
        if let Some(word) = self.taken.get_mut(cell / 64) {
            *word |= 1 << (cell % 64);
        }
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "coordinates of a map are within a million metres, and the value is not negative"
)]
fn whole(value: f64) -> usize {
    value as usize
}

/// From `-reach` to `reach`, at most half a square apart, both ends included.
fn steps(reach: f64, cell_m: f64) -> impl Iterator<Item = f64> {
    let count = (2.0 * reach / (cell_m / 2.0)).ceil().max(1.0);
    (0..=whole(count)).map(move |k| -reach + 2.0 * reach * k as f64 / count)
}

/// A road at one place: its reference line, and the outermost borders of its lanes.
struct Sample {
    x: f64,
    y: f64,
    z: f64,
    sin: f64,
    cos: f64,
    right_t: f64,
    left_t: f64,
}

impl Sample {
    fn point(&self, t: f64) -> [f64; 2] {
        [self.x - t * self.sin, self.y + t * self.cos]
    }
}

fn samples(road: &Road) -> impl Iterator<Item = Sample> {
    let count = whole(road.length_m / CELL_M) + 1;
    (0..=count).filter_map(move |k| {
        let s = road.length_m * k as f64 / count as f64;
        let section = road.sections.get(road.section_index(s))?;
        let border = |lane: Option<&crate::model::Lane>| {
            let outer = lane.map_or(0.0, |lane| lateral(road, section, lane.id, s).outer);
            outer.clamp(-REACH_MAX_M, REACH_MAX_M)
        };
        let at = road.reference(s);
        let (sin, cos) = at.heading_rad.sin_cos();
        let (first, last) = (border(section.lanes.first()), border(section.lanes.last()));
        let (right_t, left_t) = (first.min(last), first.max(last));
        let place = [at.x, at.y, right_t, left_t];
        place.iter().all(|v| v.is_finite() && v.abs() < 2e6).then(|| Sample {
            x: at.x,
            y: at.y,
            z: road.elevation.value(s),
            sin,
            cos,
            right_t,
            left_t,
        })
    })
}
