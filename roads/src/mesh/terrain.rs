//! The land around the roads.

use nalgebra::Point3;

use super::{Material, Sink};
use crate::Map;
use crate::kinds::LaneTypes;
use crate::lanes::{lane_pose, parts};

/// How far the land lies below the roads, in metres, so that it never shows through them.
const DROP_M: f64 = 0.05;
/// The same where roads climb, in metres: the land is made of coarse triangles there.
const HILL_DROP_M: f64 = 0.4;
/// A road that lies lower than another beside it by more is one that a bridge crosses, in metres.
const BRIDGE_M: f64 = 1.2;
/// How far beside a road that a bridge crosses the land stays low, in metres: more than a square's
/// diagonal, so that no slope reaches onto the road.
const BRIDGE_SIDE_M: f64 = 18.0;
/// Between roads that are less steep above each other no bridge leads over the lower one: the land
/// climbs with a road, from one to the other.
const SLOPE_MAX: f64 = 0.4;
/// Most squares of land along each side of a map.
const SQUARES_MAX: f64 = 96.0;
/// Side of a square of land in hills and on the flat, at least, in metres.
const SIDE_MIN_M: [f64; 2] = [10.0, 64.0];
/// Distance of the places on lanes that the land is kept below, in metres.
const LANE_STEP_M: f64 = 3.0;
/// Maps whose roads differ less in height are flat, in metres.
const LEVEL_M: f64 = 1e-3;

fn is_level(map: &Map) -> bool {
    map.bounds().is_none_or(|(min, max)| max.z - min.z < LEVEL_M)
}

/// How far the land lies below the roads beside them, in metres.
pub(super) fn drop_m(map: &Map) -> f64 {
    if is_level(map) { DROP_M } else { HILL_DROP_M }
}

/// How far below the road its sides must reach to meet the land, in metres.
pub(super) fn skirt_m(map: &Map) -> f64 {
    // On a slope the land is lower still beside a road that bends.
    if is_level(map) { DROP_M } else { 4.0 * HILL_DROP_M }
}

/// Heights of the land at the crossings of a grid.
#[derive(Debug)]
pub(super) struct Land {
    xs: Vec<f64>,
    ys: Vec<f64>,
    /// Row by row.
    zs: Vec<f64>,
}

impl Land {
    /// The land under the whole map and `margin_m` beyond; `None` for a map without lanes.
    pub(super) fn new(map: &Map, margin_m: f64) -> Option<Self> {
        let (min, max) = map.bounds()?;
        let level = is_level(map);
        let side_min_m = SIDE_MIN_M[usize::from(level)];
        let xs = lines([min.x, max.x], margin_m, side_min_m);
        let ys = lines([min.y, max.y], margin_m, side_min_m);
        if level {
            let zs = vec![min.z - DROP_M; xs.len() * ys.len()];
            return Some(Self { xs, ys, zs });
        }
        let zs = ys.iter().flat_map(|y| xs.iter().map(|x| height_m(map, *x, *y, min.z)));
        let zs: Vec<f64> = zs.collect();
        let mut land = Self { xs, ys, zs };
        for entry in map.table.lanes.iter().filter(|entry| entry.lane_id != 0) {
            let Some((road, section, lane)) = parts(&map.model, entry) else { continue };
            let mut s = entry.start_s;
            while s < entry.end_s {
                land.keep_below(&lane_pose(road, section, lane.id, s).point);
                s += LANE_STEP_M;
            }
        }
        Some(land)
    }

    /// Adds all of it.
    pub(super) fn spread(&self, sink: &mut impl Sink) {
        for row in 1..self.ys.len() {
            for column in 1..self.xs.len() {
                if let Some(corners) = self.square(column, row) {
                    sink.quad(Material::Grass, corners);
                }
            }
        }
    }

    /// How far a place lies above the land; 0 beside all of it.
    pub(super) fn below_m(&self, place: &Point3<f64>) -> f64 {
        let column = self.xs.partition_point(|x| *x <= place.x);
        let row = self.ys.partition_point(|y| *y <= place.y);
        let Some([a, b, c, d]) = self.square(column, row) else { return 0.0 };
        let u = (place.x - a.x) / (b.x - a.x);
        let v = (place.y - a.y) / (d.y - a.y);
        // The square is drawn as two triangles, parted by the line from a to c.
        let z = if u > v {
            a.z + u * (b.z - a.z) + v * (c.z - b.z)
        } else {
            a.z + u * (c.z - d.z) + v * (d.z - a.z)
        };
        place.z - z
    }

    /// Corners of the square before two lines of the grid, counter-clockwise.
    fn square(&self, column: usize, row: usize) -> Option<[Point3<f64>; 4]> {
        let corner = |column: usize, row: usize| {
            let z = *self.zs.get(row * self.xs.len() + column)?;
            Some(Point3::new(*self.xs.get(column)?, *self.ys.get(row)?, z))
        };
        let (left, below) = (column.checked_sub(1)?, row.checked_sub(1)?);
        Some([
            corner(left, below)?,
            corner(column, below)?,
            corner(column, row)?,
            corner(left, row)?,
        ])
    }

    /// Lowers the corners of the square around a place on a lane, so that none of the land rises
    /// through it, also where another road passes above.
    fn keep_below(&mut self, place: &Point3<f64>) {
        let column = self.xs.partition_point(|x| *x <= place.x);
        let row = self.ys.partition_point(|y| *y <= place.y);
        let width = self.xs.len();
        for row in [row.saturating_sub(1), row] {
            for column in [column.saturating_sub(1), column] {
                if let Some(z) = self.zs.get_mut(row * width + column) {
                    *z = z.min(place.z - HILL_DROP_M);
                }
            }
        }
    }
}

/// Coordinates of the lines between squares: even among the roads, wide in the margin.
fn lines([low, high]: [f64; 2], margin_m: f64, side_min_m: f64) -> Vec<f64> {
    let length_m = high - low;
    let count = (length_m / side_min_m).ceil().clamp(1.0, SQUARES_MAX);
    let steps = std::iter::successors(Some(0.0), |k| Some(k + 1.0)).take_while(|k| *k <= count);
    let inner = steps.map(|k| low + length_m * k / count);
    let margin = [0.1, 0.35, 1.0].map(|share| share * margin_m);
    let before = margin.into_iter().rev().map(|m| low - m);
    before.chain(inner).chain(margin.into_iter().map(|m| high + m)).collect()
}

/// The land follows the nearest road, but where a bridge leads over another road, that one.
fn height_m(map: &Map, x: f64, y: f64, low_m: f64) -> f64 {
    let road = |x: f64, y: f64| {
        map.nearest(Point3::new(x, y, low_m), LaneTypes::ANY)
            .and_then(|place| map.lane_pose(&place))
            .map_or(Point3::new(x, y, low_m), |pose| pose.point)
    };
    let here = road(x, y);
    if here.z - low_m < BRIDGE_M {
        return here.z - HILL_DROP_M;
    }
    let is_crossed = |other: &Point3<f64>| {
        here.z - other.z > BRIDGE_M.max(SLOPE_MAX * (here - other).xy().norm())
    };
    let around = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]]
        .map(|way| way.map(|step| f64::from(step) * BRIDGE_SIDE_M))
        .map(|[dx, dy]| road(x + dx, y + dy));
    let crossed = around.iter().filter(|other| is_crossed(other)).map(|other| other.z);
    crossed.fold(here.z, f64::min) - HILL_DROP_M
}
