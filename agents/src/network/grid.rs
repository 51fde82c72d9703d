//! Which lanes pass near a point.

use schemas::Vec3;

use super::{Lane, LaneId, floor};

/// Side of a cell; lane points are nearer to each other than this.
const CELL_M: f32 = 8.0;

/// Lanes by the cells that their points lie in, ordered by cell, then by lane.
#[derive(Debug, Default)]
pub(super) struct Grid {
    cells: Vec<([i32; 2], LaneId)>,
}

impl Grid {
    pub(super) fn new(lanes: &[Lane]) -> Self {
        let mut cells: Vec<([i32; 2], LaneId)> = (0..)
            .zip(lanes)
            .flat_map(|(id, lane)| {
                lane.points.iter().map(move |point| (cell(point.point_m.x, point.point_m.y), id))
            })
            .collect();
        cells.sort_unstable();
        cells.dedup();
        Self { cells }
    }

    /// Adds the lanes with points in the cells within `radius_m`; some more than once.
    pub(super) fn lanes(&self, point_m: &Vec3, radius_m: f32, found: &mut Vec<LaneId>) {
        let low = cell(point_m.x - radius_m - 2.0, point_m.y - radius_m - 2.0);
        let high = cell(point_m.x + radius_m + 2.0, point_m.y + radius_m + 2.0);
        for x in low[0]..=high[0] {
            let first = self.cells.partition_point(|(cell, _)| *cell < [x, low[1]]);
            let column = self.cells.get(first..).unwrap_or_default();
            let within = column.iter().take_while(|(cell, _)| *cell <= [x, high[1]]);
            found.extend(within.map(|(_, lane)| *lane));
        }
    }
}

fn cell(x_m: f32, y_m: f32) -> [i32; 2] {
    // Coordinates are bounded far below 2³¹ cells; the conversion stops there for others.
    [floor(x_m / CELL_M), floor(y_m / CELL_M)]
}
