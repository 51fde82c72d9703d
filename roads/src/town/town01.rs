//! Town01: one lane each way around and between large blocks; every junction is a T. Its streets
//! lie where CARLA's do, so that places that programs name by coordinates are on the road.

use super::course::Bend;
use super::plan::{Beside, Control, EAST, Plan, WEST};
use super::profile::{Extra, Profile};

const STREET: Profile = Profile::street(1, 30);
/// Middle lines of the streets from south to north, from west to east.
const WEST_RING: f64 = 0.0;
const WEST_COLUMN: f64 = 90.4;
const SHORT_COLUMN: f64 = 156.0;
const EAST_COLUMN: f64 = 336.8;
const EAST_RING: f64 = 394.4;
/// Those of the streets from west to east, from south to north.
const ROWS: [f64; 5] = [-328.6, -197.1, -131.5, -57.5, 0.0];
/// Radius of the middle line where the ring turns, in metres.
const CORNER_RADIUS_M: f64 = 16.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [1.0, 4.0] });
    let parked = STREET.with(Extra::Parking);
    let [south, lower, middle, upper, north] = ROWS;
    for row in [south, lower, middle] {
        plan.row(row, &[WEST_COLUMN, EAST_COLUMN], STREET);
    }
    for row in [upper, north] {
        plan.row(row, &[WEST_COLUMN, SHORT_COLUMN, EAST_COLUMN], STREET);
    }
    for column in [WEST_COLUMN, EAST_COLUMN] {
        plan.column(column, &[south, lower], parked);
        plan.column(column, &[lower, middle, upper, north], STREET);
    }
    plan.column(SHORT_COLUMN, &[upper, north], STREET);
    for (column, away, ring) in [(WEST_COLUMN, WEST, WEST_RING), (EAST_COLUMN, EAST, EAST_RING)] {
        let bends = [south, north].map(|row| Bend { at: [ring, row], radius_m: CORNER_RADIUS_M });
        let ends = [south, north].map(|row| (plan.node([column, row]), away));
        plan.connect(ends[0], ends[1], &bends, STREET);
    }
    // Scenarios name CARLA's road 4, which is the row in the middle.
    plan.swap_numbers([3, 4]);
    plan
}
