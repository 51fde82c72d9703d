//! What stands in a town, by cells of a grid.

use nalgebra::{Isometry3, Vector3};
use roads::Map;

use super::boxes::Outline;

/// Side of a cell, in metres.
const CELL_M: f32 = 8.0;
/// A vehicle reaches at most so far beyond the cell of its middle, in metres.
const REACH_M: f32 = 3.0;
/// Cells of one map; a larger one has larger cells.
const CELLS_MAX: f32 = 4.0e6;

/// Boxes that stand on the ground, by cell.
#[derive(Debug, Default)]
pub(super) struct Obstacles {
    left_m: f32,
    low_m: f32,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// Where the boxes of each cell begin in `boxes`, and at last where they end.
    begins: Vec<u32>,
    boxes: Vec<Outline>,
}

impl Obstacles {
    /// Scenery and posts of a map; those on lanes are left out, as in the tier of rigid bodies.
    pub(super) fn of(map: &Map) -> Self {
        let scenery = map.scenery().iter().map(|item| outline(&item.pose, &item.half_extent_m));
        let posts = map.posts().iter().filter(|post| !post.is_on_lane);
        let posts =
            posts.map(|post| outline(&post.foot, &Vector3::new(post.radius_m, post.radius_m, 1.0)));
        Self::new(scenery.chain(posts).collect())
    }

    fn new(things: Vec<Outline>) -> Self {
        let (mut left_m, mut low_m) = (f32::INFINITY, f32::INFINITY);
        let (mut right_m, mut high_m) = (f32::NEG_INFINITY, f32::NEG_INFINITY);
        for thing in &things {
            let (x_m, y_m) = thing.around_m();
            (left_m, right_m) = (left_m.min(thing.x_m - x_m), right_m.max(thing.x_m + x_m));
            (low_m, high_m) = (low_m.min(thing.y_m - y_m), high_m.max(thing.y_m + y_m));
        }
        if things.is_empty() {
            return Self::default();
        }
        (left_m, low_m) = (left_m - REACH_M, low_m - REACH_M);
        let (wide_m, deep_m) = (right_m + REACH_M - left_m, high_m + REACH_M - low_m);
        let cell_m = CELL_M.max((wide_m * deep_m / CELLS_MAX).sqrt());
        let columns = (wide_m / cell_m) as usize + 1;
        let rows = (deep_m / cell_m) as usize + 1;
        let mut grid =
            Self { left_m, low_m, cell_m, columns, rows, begins: Vec::new(), boxes: Vec::new() };
        let mut cells: Vec<Vec<Outline>> = vec![Vec::new(); columns * rows];
        for thing in things {
            for cell in grid.cells(&thing) {
                cells[cell].push(thing);
            }
        }
        for cell in cells {
            grid.begins.push(grid.boxes.len() as u32);
            grid.boxes.extend(cell);
        }
        grid.begins.push(grid.boxes.len() as u32);
        grid
    }

    /// Cells from which a vehicle may touch a thing.
    fn cells(&self, thing: &Outline) -> Vec<usize> {
        let (x_m, y_m) = thing.around_m();
        let (x_m, y_m) = (x_m + REACH_M, y_m + REACH_M);
        let index = |from_m: f32, most: usize| ((from_m / self.cell_m).max(0.0) as usize).min(most);
        let (most_x, most_y) = (self.columns - 1, self.rows - 1);
        let columns = index(thing.x_m - x_m - self.left_m, most_x)
            ..=index(thing.x_m + x_m - self.left_m, most_x);
        let rows = index(thing.y_m - y_m - self.low_m, most_y)
            ..=index(thing.y_m + y_m - self.low_m, most_y);
        rows.flat_map(|row| columns.clone().map(move |column| row * self.columns + column))
            .collect()
    }

    /// Whether a vehicle touches anything.
    pub(super) fn touch(&self, vehicle: &Outline) -> bool {
        let column = (vehicle.x_m - self.left_m) / self.cell_m;
        let row = (vehicle.y_m - self.low_m) / self.cell_m;
        if self.boxes.is_empty() || !(column >= 0.0 && row >= 0.0) {
            return false;
        }
        let (column, row) = (column as usize, row as usize);
        if column >= self.columns || row >= self.rows {
            return false;
        }
        let cell = row * self.columns + column;
        let range = self.begins[cell] as usize..self.begins[cell + 1] as usize;
        self.boxes[range].iter().any(|thing| thing.touches(vehicle))
    }
}

fn outline(pose: &Isometry3<f64>, half_extent_m: &Vector3<f64>) -> Outline {
    let forward = pose.rotation * Vector3::x();
    let level = forward.xy().norm().max(1.0e-9);
    Outline {
        x_m: pose.translation.x as f32,
        y_m: pose.translation.y as f32,
        cos: (forward.x / level) as f32,
        sin: (forward.y / level) as f32,
        half_length_m: half_extent_m.x as f32,
        half_width_m: half_extent_m.y as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x_m: f32, y_m: f32, half_m: f32) -> Outline {
        Outline { x_m, y_m, cos: 1.0, sin: 0.0, half_length_m: half_m, half_width_m: half_m }
    }

    #[test]
    fn what_touches_in_the_grid_touches_without_it() {
        let things: Vec<Outline> = (0..40u8)
            .map(|index| {
                let at = f32::from(index);
                square((at * 37.0) % 101.0, (at * 53.0) % 89.0, 0.3 + at % 5.0)
            })
            .collect();
        let grid = Obstacles::new(things.clone());
        let mut touching = 0;
        for step in 0..2_000u16 {
            let at = f32::from(step);
            let vehicle = Outline {
                half_length_m: 2.4,
                half_width_m: 1.0,
                ..square((at * 7.3) % 120.0 - 10.0, (at * 11.9) % 110.0 - 10.0, 1.0)
            };
            let wanted = things.iter().any(|thing| thing.touches(&vehicle));
            assert_eq!(grid.touch(&vehicle), wanted, "{vehicle:?}");
            touching += usize::from(wanted);
        }
        assert!(touching > 100 && touching < 1_900, "{touching}");
        assert!(!Obstacles::default().touch(&square(0.0, 0.0, 1.0)));
    }
}
