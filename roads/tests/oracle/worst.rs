//! The largest differences, for people.

use super::checks::{client_point, column, degrees_apart, number, place, rows};
use super::maps::Judged;

/// Over all waypoints of a map.
pub(crate) struct Worst {
    pub(crate) waypoints: usize,
    /// Distance of the lanes' middles; the answers are written to a tenth of a millimetre.
    pub(crate) position_m: f64,
    pub(crate) heading_rad: f64,
}

pub(crate) fn worst(judged: &Judged) -> Worst {
    let mut worst = Worst { waypoints: 0, position_m: 0.0, heading_rad: 0.0 };
    for row in rows(judged, "waypoints") {
        let pose =
            judged.map.lane_pose(&place(row.as_array().expect("a row"))).expect("of this map");
        let found = client_point(&pose.point);
        let off2: f64 =
            (0..3).map(|axis| (found[axis] - number(&row[column::X + axis])).powi(2)).sum();
        let turn_deg = degrees_apart(-pose.heading_rad.to_degrees(), number(&row[column::YAW]));
        worst.waypoints += 1;
        worst.position_m = worst.position_m.max(off2.sqrt());
        worst.heading_rad = worst.heading_rad.max(turn_deg.to_radians());
    }
    worst
}
