//! Town01: one lane each way around and between large blocks; every junction is a T.

use super::course::Bend;
use super::plan::{Beside, Control, Plan};
use super::profile::{Extra, Profile};

const STREET: Profile = Profile::street(1, 30);
const WEST: f64 = -200.0;
const EAST: f64 = 200.0;
const SOUTH: f64 = -165.0;
const NORTH: f64 = 165.0;
/// The streets across, from west to east.
const ROWS: [f64; 2] = [-60.0, 50.0];
/// Where the streets between the rows meet them.
const MIDDLE: [f64; 2] = [-110.0, 80.0];
/// Where the streets from the ring to the rows meet both.
const LOWER: f64 = -20.0;
const UPPER: f64 = 10.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [1.0, 4.0] });
    let parked = STREET.with(Extra::Parking);
    let [south_row, north_row] = ROWS;
    let [west, east] = MIDDLE;
    plan.row(south_row, &[WEST, west, LOWER, east, EAST], STREET);
    plan.row(north_row, &[WEST, west, UPPER, east, EAST], STREET);
    plan.column(LOWER, &[SOUTH, south_row], STREET);
    plan.column(west, &ROWS, STREET);
    plan.column(east, &ROWS, parked);
    plan.column(UPPER, &[north_row, NORTH], parked);
    plan.column(WEST, &ROWS, STREET);
    plan.column(EAST, &ROWS, STREET);
    let corners = [
        ([WEST, north_row], [WEST, NORTH], [UPPER, NORTH]),
        ([UPPER, NORTH], [EAST, NORTH], [EAST, north_row]),
        ([EAST, south_row], [EAST, SOUTH], [LOWER, SOUTH]),
        ([LOWER, SOUTH], [WEST, SOUTH], [WEST, south_row]),
    ];
    for (from, at, to) in corners {
        plan.corner(from, Bend { at, radius_m: 16.0 }, to, STREET);
    }
    plan
}
