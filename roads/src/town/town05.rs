//! Town05: a grid of wide streets inside a ring road that climbs to a viaduct on every side.

use super::course::Bend;
use super::plan::{Beside, Control, Plan};
use super::profile::{Edge, Extra, Profile};

const STREET: Profile = Profile::street(2, 30);
const AVENUE: Profile = Profile::street(3, 30);
const VIADUCT: Profile = Profile::two_way(2, Edge::HardShoulder, 60);
const WEST: f64 = -230.0;
const EAST: f64 = 165.0;
const SOUTH: f64 = -220.0;
const NORTH: f64 = 240.0;
const ROWS: [f64; 2] = [-80.0, 80.0];
const COLUMN: f64 = -100.0;
/// The avenue from south to north is straight and flat for 460 m.
const AVENUE_X: f64 = 31.5;
/// Distance of the ring road from the grid, in metres.
const OUT: f64 = 120.0;
/// Heights on the way of each side of the ring road.
const VIADUCT_HEIGHTS: [[f64; 2]; 2] = [[0.3, 6.0], [0.7, 6.0]];

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [3.0, 10.0] });
    let [lower, upper] = ROWS;
    plan.row(lower, &[WEST, COLUMN, AVENUE_X, EAST], AVENUE);
    plan.row(upper, &[WEST, COLUMN, AVENUE_X, EAST], STREET.with(Extra::Biking));
    plan.column(COLUMN, &[SOUTH, lower, upper, NORTH], STREET.with(Extra::Parking));
    plan.column(AVENUE_X, &[SOUTH, lower, upper, NORTH], AVENUE);
    plan.column(WEST, &ROWS, STREET);
    plan.column(EAST, &ROWS, STREET);
    plan.row(SOUTH, &[COLUMN, AVENUE_X], STREET);
    plan.row(NORTH, &[COLUMN, AVENUE_X], STREET);
    let corners = [
        ([WEST, upper], [WEST, NORTH], [COLUMN, NORTH]),
        ([AVENUE_X, NORTH], [EAST, NORTH], [EAST, upper]),
        ([EAST, lower], [EAST, SOUTH], [AVENUE_X, SOUTH]),
        ([COLUMN, SOUTH], [WEST, SOUTH], [WEST, lower]),
    ];
    for (from, at, to) in corners {
        plan.corner(from, Bend { at, radius_m: 20.0 }, to, STREET);
    }
    add_ring_road(&mut plan);
    plan
}

fn add_ring_road(plan: &mut Plan) {
    let [lower, upper] = ROWS;
    plan.beside = Beside::Nothing;
    plan.column(AVENUE_X, &[SOUTH - OUT, SOUTH], AVENUE);
    plan.column(AVENUE_X, &[NORTH, NORTH + OUT], AVENUE);
    plan.row(upper, &[WEST - OUT, WEST], STREET);
    plan.row(lower, &[EAST, EAST + OUT], AVENUE);
    let (west, east) = ([WEST - OUT, upper], [EAST + OUT, lower]);
    let (south, north) = ([AVENUE_X, SOUTH - OUT], [AVENUE_X, NORTH + OUT]);
    let sides = [
        (south, [EAST + OUT, SOUTH - OUT], east),
        (east, [EAST + OUT, NORTH + OUT], north),
        (north, [WEST - OUT, NORTH + OUT], west),
        (west, [WEST - OUT, SOUTH - OUT], south),
    ];
    for (from, at, to) in sides {
        let side = plan.corner(from, Bend { at, radius_m: 70.0 }, to, VIADUCT);
        side.heights = VIADUCT_HEIGHTS.to_vec();
    }
}
