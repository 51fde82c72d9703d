//! The vehicle, eight points of its way ahead, and the distance to its goal: 46 columns.

use super::{Column, View};

/// Columns of the vehicle.
pub(super) const EGO: usize = 13;
/// How far ahead along the way the points are, in metres.
const AHEAD_M: [f32; 8] = [2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 30.0, 40.0];
/// Columns of a point.
const POINT: usize = 4;
/// All of them.
pub(super) const WIDTH: usize = EGO + POINT * AHEAD_M.len() + 1;

pub(super) const BLOCKS: [(&str, usize, usize); 3] =
    [("ego", 1, EGO), ("route", AHEAD_M.len(), POINT), ("goal", 1, 1)];

pub(super) fn columns() -> Vec<Column> {
    let mut columns = ego();
    for ahead_m in AHEAD_M {
        let new = |name: &str, unit, range, scale| {
            Column::new(format!("route.{ahead_m}m.{name}"), unit, range, scale)
        };
        columns.extend([
            new("x", "m", (-100.0, 100.0), 1.0 / 50.0),
            new("y", "m", (-100.0, 100.0), 1.0 / 20.0),
            new("half_width", "m", (0.0, 20.0), 1.0 / 4.0),
            new("curvature", "1/m", (-0.5, 0.5), 10.0),
        ]);
    }
    columns.push(Column::new("goal.distance", "m", (0.0, 10_000.0), 1.0 / 200.0));
    columns
}

/// The vehicle itself.
pub(super) fn ego() -> Vec<Column> {
    let new =
        |name: &str, unit, range, scale| Column::new(format!("ego.{name}"), unit, range, scale);
    vec![
        new("speed", "m/s", (-75.0, 75.0), 1.0 / 15.0),
        new("acceleration.x", "m/s2", (-100.0, 100.0), 1.0 / 10.0),
        new("acceleration.y", "m/s2", (-100.0, 100.0), 1.0 / 10.0),
        new("yaw_rate", "rad/s", (-10.0, 10.0), 1.0),
        new("road_wheel", "rad", (-1.5, 1.5), 1.0 / 0.6),
        new("last.steer", "", (-1.0, 1.0), 1.0),
        new("last.pedal", "", (-1.0, 1.0), 1.0),
        new("length", "m", (0.0, 20.0), 1.0 / 10.0),
        new("width", "m", (0.0, 5.0), 1.0 / 5.0),
        new("limit", "m/s", (0.0, 75.0), 1.0 / 15.0),
        new("offset", "m", (-20.0, 20.0), 1.0 / 2.0),
        new("heading.sin", "", (-1.0, 1.0), 1.0),
        new("heading.cos", "", (-1.0, 1.0), 1.0),
    ]
}

/// Writes values in the columns' units.
pub(super) fn encode(view: &View<'_>, row: &mut [f32]) {
    encode_ego(view, row);
    let View { place, route, .. } = *view;
    for (point, ahead_m) in row[EGO..].chunks_exact_mut(POINT).zip(AHEAD_M) {
        let on_route = route.at(place.at_m + ahead_m);
        let (x_m, y_m) = view.seen(on_route.x_m, on_route.y_m);
        point.copy_from_slice(&[x_m, y_m, on_route.half_width_m, on_route.curvature_per_m]);
    }
    row[EGO + POINT * AHEAD_M.len()] = route.length_m() - place.at_m;
}

/// Writes the vehicle's own columns, which come first.
pub(super) fn encode_ego(view: &View<'_>, row: &mut [f32]) {
    let View { motion, shape, place, last, .. } = *view;
    row[..EGO].copy_from_slice(&[
        motion.speed_mps,
        motion.along_mps2,
        motion.left_mps2,
        motion.yaw_radps,
        motion.road_wheel_rad,
        last.steer,
        last.pedal,
        shape.length_m,
        shape.width_m,
        place.limit_mps,
        place.left_m,
        motion.sin * place.cos - motion.cos * place.sin,
        motion.cos * place.cos + motion.sin * place.sin,
    ]);
}
