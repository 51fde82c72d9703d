//! Town02: a small town with one lane each way; every junction is a T. Its streets lie where
//! CARLA's do, so that places that programs name by coordinates are on the road.

use super::course::Bend;
use super::plan::{Beside, Control, EAST, NORTH, Plan, SOUTH, WEST};
use super::profile::{Extra, Profile};

const STREET: Profile = Profile::street(1, 30);
/// Middle lines of the streets from south to north, from west to east.
const WEST_RING: f64 = -5.4;
const WEST_COLUMN: f64 = 43.9;
const EAST_COLUMN: f64 = 134.1;
const EAST_RING: f64 = 191.7;
/// Those of the streets from west to east, from south to north.
const SOUTH_RING: f64 = -304.5;
const LOWER_ROW: f64 = -238.9;
const UPPER_ROW: f64 = -189.6;
const NORTH_RING: f64 = -107.5;
/// Radius of the middle line where the ring turns, in metres.
const CORNER_RADIUS_M: f64 = 14.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [1.0, 4.0] });
    plan.row(UPPER_ROW, &[WEST_RING, WEST_COLUMN, EAST_COLUMN, EAST_RING], STREET);
    plan.row(LOWER_ROW, &[WEST_COLUMN, EAST_COLUMN, EAST_RING], STREET);
    plan.column(WEST_COLUMN, &[SOUTH_RING, LOWER_ROW, UPPER_ROW], STREET);
    plan.column(EAST_COLUMN, &[LOWER_ROW, UPPER_ROW], STREET);
    plan.column(EAST_RING, &[LOWER_ROW, UPPER_ROW], STREET);
    add_ring(&mut plan);
    plan
}

/// The ring, from the T in its south to both ends of the upper row.
fn add_ring(plan: &mut Plan) {
    let parked = STREET.with(Extra::Parking);
    let corner = |column, row| Bend { at: [column, row], radius_m: CORNER_RADIUS_M };
    let [south, west, east, lower_east] = [
        [WEST_COLUMN, SOUTH_RING],
        [WEST_RING, UPPER_ROW],
        [EAST_RING, UPPER_ROW],
        [EAST_RING, LOWER_ROW],
    ]
    .map(|at| plan.node(at));
    let north = [corner(WEST_RING, NORTH_RING), corner(EAST_RING, NORTH_RING)];
    plan.connect((west, NORTH), (east, NORTH), &north, parked);
    plan.connect((south, WEST), (west, SOUTH), &[corner(WEST_RING, SOUTH_RING)], STREET);
    plan.connect((south, EAST), (lower_east, SOUTH), &[corner(EAST_RING, SOUTH_RING)], STREET);
}
