//! Town02: a small town with one lane each way; every junction is a T.

use super::course::Bend;
use super::plan::{Beside, Control, Plan};
use super::profile::{Extra, Profile};

const STREET: Profile = Profile::street(1, 30);
const WEST: f64 = -100.0;
const EAST: f64 = 100.0;
const SOUTH: f64 = -95.0;
const NORTH: f64 = 95.0;
/// The streets across, from west to east.
const ROWS: [f64; 2] = [-30.0, 35.0];
/// Where the streets from the ring to the rows meet both.
const LOWER: f64 = -25.0;
const UPPER: f64 = 30.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [1.0, 4.0] });
    let parked = STREET.with(Extra::Parking);
    let [south_row, north_row] = ROWS;
    plan.row(south_row, &[WEST, LOWER, EAST], STREET);
    plan.row(north_row, &[WEST, UPPER, EAST], parked);
    plan.column(LOWER, &[SOUTH, south_row], STREET);
    plan.column(UPPER, &[north_row, NORTH], STREET);
    plan.column(WEST, &ROWS, STREET);
    plan.column(EAST, &ROWS, STREET);
    let corners = [
        ([WEST, north_row], [WEST, NORTH], [UPPER, NORTH]),
        ([UPPER, NORTH], [EAST, NORTH], [EAST, north_row]),
        ([EAST, south_row], [EAST, SOUTH], [LOWER, SOUTH]),
        ([LOWER, SOUTH], [WEST, SOUTH], [WEST, south_row]),
    ];
    for (from, at, to) in corners {
        plan.corner(from, Bend { at, radius_m: 14.0 }, to, parked);
    }
    plan
}
