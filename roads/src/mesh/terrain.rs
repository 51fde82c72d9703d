//! The land around the roads.

use nalgebra::Point3;

use super::{Material, Sink};
use crate::Map;
use crate::kinds::LaneTypes;

/// How far the land lies below the roads, in metres, so that it never shows through them.
pub(super) const DROP_M: f64 = 0.05;
/// The same where roads climb, in metres: the land is made of coarse triangles there.
const HILL_DROP_M: f64 = 0.4;
/// Most squares of land along each side of a map.
const SQUARES_MAX: f64 = 96.0;
/// Side of a square of land in hills and on the flat, at least, in metres.
const SIDE_MIN_M: [f64; 2] = [10.0, 64.0];

/// Adds land under the whole map and `margin_m` beyond.
pub(super) fn spread(map: &Map, margin_m: f64, sink: &mut impl Sink) {
    let Some((min, max)) = map.bounds() else { return };
    let level = max.z - min.z < 1e-3;
    let (low, high) = (min.xy().map(|v| v - margin_m), max.xy().map(|v| v + margin_m));
    let size = high - low;
    let side_min_m = SIDE_MIN_M[usize::from(level)];
    let count = |length_m: f64| (length_m / side_min_m).ceil().clamp(1.0, SQUARES_MAX);
    let (columns, rows) = (count(size.x), count(size.y));
    let corner = |column: f64, row: f64| {
        let (x, y) = (low.x + size.x * column / columns, low.y + size.y * row / rows);
        let z = if level { min.z - DROP_M } else { height_m(map, x, y, min.z) };
        Point3::new(x, y, z)
    };
    let steps = |count: f64| {
        std::iter::successors(Some(0.0), move |k| Some(k + 1.0)).take_while(move |k| *k < count)
    };
    let mut below: Vec<Point3<f64>> =
        steps(columns + 1.0).map(|column| corner(column, 0.0)).collect();
    for row in steps(rows) {
        let above: Vec<Point3<f64>> =
            steps(columns + 1.0).map(|column| corner(column, row + 1.0)).collect();
        for (lower, upper) in below.windows(2).zip(above.windows(2)) {
            if let ([a, b], [d, c]) = (lower, upper) {
                sink.quad(Material::Grass, [*a, *b, *c, *d]);
            }
        }
        below = above;
    }
}

/// The land follows the nearest road.
fn height_m(map: &Map, x: f64, y: f64, otherwise_m: f64) -> f64 {
    map.nearest(Point3::new(x, y, otherwise_m), LaneTypes::ANY)
        .and_then(|place| map.lane_pose(&place))
        .map_or(otherwise_m, |pose| pose.point.z)
        - HILL_DROP_M
}
