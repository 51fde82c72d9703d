//! Lets borders that pass through each other's corners share them.

use std::collections::BTreeMap;

use super::piece::GridPoint;

/// A corner this near to a line is on it, in grid steps: rounding puts it beside the line.
const ON_LINE_STEPS: f64 = 2.0;
/// Side of the squares corners are sorted into, in grid steps.
const CELL_STEPS: i32 = 4_000;

/// The same closed lines, with a corner wherever one passes a corner of another.
pub(super) fn split_at_corners(lines: &[Vec<GridPoint>]) -> Vec<Vec<GridPoint>> {
    let mut corners: BTreeMap<GridPoint, Vec<GridPoint>> = BTreeMap::new();
    for corner in lines.iter().flatten() {
        corners.entry(cell(*corner)).or_default().push(*corner);
    }
    for around in corners.values_mut() {
        around.sort_unstable();
        around.dedup();
    }
    lines.iter().map(|line| split(line, &corners)).collect()
}

fn cell(point: GridPoint) -> GridPoint {
    point.map(|v| v.div_euclid(CELL_STEPS))
}

fn split(line: &[GridPoint], corners: &BTreeMap<GridPoint, Vec<GridPoint>>) -> Vec<GridPoint> {
    let mut result = Vec::with_capacity(line.len());
    for (from, to) in line.iter().zip(line.iter().cycle().skip(1)) {
        result.push(*from);
        let mut passed: Vec<(f64, GridPoint)> = cells_along(*from, *to)
            .filter_map(|cell| corners.get(&cell))
            .flatten()
            .filter_map(|corner| Some((rate_on(*from, *to, *corner)?, *corner)))
            .collect();
        passed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        passed.dedup();
        result.extend(passed.into_iter().map(|(_, corner)| corner));
    }
    result
}

/// The squares around an edge.
fn cells_along(from: GridPoint, to: GridPoint) -> impl Iterator<Item = GridPoint> {
    const REACH: i32 = ON_LINE_STEPS as i32 + 1;
    let range = |axis: usize| {
        let (low, high) = (from[axis].min(to[axis]) - REACH, from[axis].max(to[axis]) + REACH);
        low.div_euclid(CELL_STEPS)..=high.div_euclid(CELL_STEPS)
    };
    let ys = range(1);
    range(0).flat_map(move |x| ys.clone().map(move |y| [x, y]))
}

/// Where on an edge, between its ends, a corner lies; `None` for a corner beside it.
fn rate_on(from: GridPoint, to: GridPoint, corner: GridPoint) -> Option<f64> {
    if corner == from || corner == to {
        return None;
    }
    let along = [0, 1].map(|axis| f64::from(to[axis]) - f64::from(from[axis]));
    let offset = [0, 1].map(|axis| f64::from(corner[axis]) - f64::from(from[axis]));
    let length2 = along[0] * along[0] + along[1] * along[1];
    let rate = (along[0] * offset[0] + along[1] * offset[1]) / length2;
    let aside = (along[0] * offset[1] - along[1] * offset[0]).abs();
    let inside = rate > 0.0 && rate < 1.0;
    (inside && aside <= ON_LINE_STEPS * length2.sqrt()).then_some(rate)
}
