//! The map as a grid of square cells, as nuScenes has its maps.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Point3;
use roads::Map;
use serde_json::{Value, json};

use crate::convert::{MAP_FRAME, pose, time};

/// Side of a cell, and longer on maps of more cells than are told.
const CELL_M: f64 = 0.5;
const CELLS_MAX: f64 = 4_000_000.0;
/// Between two places on a lane of which cells are filled.
const STEP_M: f64 = 0.5;
/// What a cell is.
const LANE: u8 = 1;
const CROSSING: u8 = 2;
/// Of where one may drive.
const FREE: u8 = 255;
/// The type of a field, as Foxglove counts them.
const UINT8: u8 = 1;

/// The cells of a map.
pub(crate) struct Grid {
    /// Its corner with the smallest x and y.
    corner: Point3<f64>,
    cell_m: f64,
    columns: usize,
    /// Row after row.
    cells: Vec<u8>,
}

impl Grid {
    /// `None` for a map without lanes.
    pub(crate) fn of(map: &Map) -> Option<Self> {
        const MARGIN_M: f64 = 10.0;
        let (min, max) = map.bounds()?;
        let size = [max.x - min.x, max.y - min.y].map(|side_m| side_m + 2.0 * MARGIN_M);
        let cell_m = CELL_M.max((size[0] * size[1] / CELLS_MAX).sqrt());
        let [columns, rows] = size.map(|side_m| (side_m / cell_m).ceil() as usize + 1);
        let corner = Point3::new(min.x - MARGIN_M, min.y - MARGIN_M, 0.0);
        let mut grid = Self { corner, cell_m, columns, cells: vec![0; columns * rows] };
        grid.fill_lanes(map);
        grid.fill_crossings(map);
        Some(grid)
    }

    fn fill_lanes(&mut self, map: &Map) {
        for (from, to) in map.driving_lanes() {
            let length_m = (to.s - from.s).abs();
            let steps = (length_m / STEP_M.max(self.cell_m)).ceil().max(1.0) as u32;
            for step in 0..=steps {
                let share = f64::from(step) / f64::from(steps);
                let here = roads::Waypoint { s: from.s + (to.s - from.s) * share, ..from };
                let (at, half_m) = (map.pose(&here), map.lane(&here).width_m / 2.0);
                let across = (half_m / self.cell_m * 2.0).ceil() as i32;
                for side in -across..=across {
                    let side_m = half_m * f64::from(side) / f64::from(across.max(1));
                    self.fill(&(at * Point3::new(0.0, side_m, 0.0)), LANE);
                }
            }
        }
    }

    fn fill_crossings(&mut self, map: &Map) {
        for corners in map.crosswalks() {
            let Some((first, rest)) = corners.split_first() else { continue };
            for [one, other] in rest.array_windows() {
                self.fill_triangle([first, one, other]);
            }
        }
    }

    /// Fills a triangle, cell by cell along lines from one corner.
    fn fill_triangle(&mut self, [a, b, c]: [&Point3<f64>; 3]) {
        let cell_m = self.cell_m;
        let steps = |from: &Point3<f64>, to: &Point3<f64>| {
            ((to - from).norm() / cell_m * 2.0).ceil().max(1.0) as u32
        };
        let along = steps(b, c);
        for step in 0..=along {
            let end = b + (c - b) * (f64::from(step) / f64::from(along));
            let inwards = steps(a, &end);
            for step in 0..=inwards {
                let at = a + (end - a) * (f64::from(step) / f64::from(inwards));
                self.fill(&at, CROSSING);
            }
        }
    }

    fn fill(&mut self, at: &Point3<f64>, kind: u8) {
        let [column, row] = [at.x - self.corner.x, at.y - self.corner.y]
            .map(|way_m| (way_m / self.cell_m).max(0.0) as usize);
        if column < self.columns
            && let Some(cell) = self.cells.get_mut(row * self.columns + column)
        {
            *cell = kind;
        }
    }

    /// What each cell is: 0 nothing, 1 a lane, 2 a crossing.
    pub(crate) fn kinds(&self, now: u64) -> Value {
        self.message("kind", &self.cells, now)
    }

    /// 255 where one may drive.
    pub(crate) fn drivable(&self, now: u64) -> Value {
        let free = |cell: &u8| if *cell == 0 { 0 } else { FREE };
        let cells: Vec<u8> = self.cells.iter().map(free).collect();
        self.message("drivable", &cells, now)
    }

    fn message(&self, field: &str, cells: &[u8], now: u64) -> Value {
        let corner = schemas::Pose::translation(self.corner.x as f32, self.corner.y as f32, 0.0);
        json!({
            "timestamp": time(now),
            "frame_id": MAP_FRAME,
            "pose": pose(&corner),
            "column_count": self.columns,
            "cell_size": {"x": self.cell_m, "y": self.cell_m},
            "row_stride": self.columns,
            "cell_stride": 1,
            "fields": [{"name": field, "offset": 0, "type": UINT8}],
            "data": STANDARD.encode(cells),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_on_lanes_are_drivable_and_those_away_from_all_lanes_are_not() {
        let map = Map::parse("Town02", &roads::town::build("Town02").unwrap()).unwrap();
        let grid = Grid::of(&map).unwrap();
        let at = |point: &Point3<f64>| {
            let [column, row] = [point.x - grid.corner.x, point.y - grid.corner.y]
                .map(|way_m| (way_m / grid.cell_m) as usize);
            grid.cells[row * grid.columns + column]
        };
        for (from, to) in map.driving_lanes() {
            for place in [from, to] {
                assert_ne!(at(&map.pose(&place).translation.vector.into()), 0);
            }
        }
        for crossing in map.crosswalks() {
            let middle: nalgebra::Vector3<f64> =
                crossing[1..].iter().map(|corner| corner.coords).sum::<nalgebra::Vector3<f64>>()
                    / (crossing.len() - 1) as f64;
            assert_eq!(at(&middle.into()), CROSSING);
        }
        // About as many cells as lanes have room for; lanes of junctions lie over each other.
        let lanes_m2: f64 = map
            .driving_lanes()
            .iter()
            .map(|(from, to)| (to.s - from.s).abs() * map.lane(from).width_m)
            .sum();
        let filled = grid.cells.iter().filter(|cell| **cell == LANE).count() as f64;
        let filled_m2 = filled * grid.cell_m * grid.cell_m;
        assert!((0.5..1.2).contains(&(filled_m2 / lanes_m2)), "{filled_m2} {lanes_m2}");
        let told = grid.drivable(0);
        let data = STANDARD.decode(told["data"].as_str().unwrap()).unwrap();
        assert_eq!(data.len(), grid.cells.len());
        assert!(data.iter().zip(&grid.cells).all(|(told, cell)| (*told == FREE) == (*cell > 0)));
    }
}
