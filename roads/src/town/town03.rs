//! Town03: a large town with a roundabout, an avenue, hills in the west, and a level square.

use super::block::thing;
use super::course::Bend;
use super::plan::{Beside, Block, Control, EAST, LandUse, Loose, NORTH, Plan, SOUTH, WEST};
use super::profile::{Edge, Extra, Profile};
use super::roundabout;

const STREET: Profile = Profile::street(2, 30);
const AVENUE: Profile = Profile::street(3, 30);
const HILL_ROAD: Profile = Profile::two_way(1, Edge::Verge, 30);
const COLUMNS: [f64; 4] = [-200.0, 0.0, 235.0, 430.0];
const ROWS: [f64; 3] = [-200.0, -30.0, 160.0];
/// Junction in the hills, and its height in metres.
const HILLTOP: [f64; 2] = [-430.0, 40.0];
const HILLTOP_M: f64 = 7.0;
const HILL_RADIUS_M: f64 = 60.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [2.0, 7.0] });
    let [west, centre, avenue, east] = COLUMNS;
    let [south, middle, north] = ROWS;
    plan.row(middle, &[avenue, east], STREET.with(Extra::Parking));
    plan.column(avenue, &ROWS, AVENUE);
    plan.row(south, &[centre, avenue], STREET);
    plan.row(north, &[centre, avenue], STREET);
    let arms = roundabout::build(&mut plan, [centre, middle], &[EAST, NORTH, WEST, SOUTH]);
    let around = [
        ([avenue, middle], WEST),
        ([centre, north], SOUTH),
        ([west, middle], EAST),
        ([centre, south], NORTH),
    ];
    for (arm, (at, leaving_rad)) in arms.into_iter().zip(around) {
        let end = plan.node(at);
        plan.connect(arm, (end, leaving_rad), &[], STREET);
    }
    let corners = [
        ([west, middle], [west, north], [centre, north]),
        ([avenue, north], [east, north], [east, middle]),
        ([east, middle], [east, south], [avenue, south]),
        ([centre, south], [west, south], [west, middle]),
    ];
    for (from, at, to) in corners {
        plan.corner(from, Bend { at, radius_m: 24.0 }, to, STREET);
    }
    add_hills(&mut plan);
    add_square(&mut plan);
    plan
}

fn add_hills(plan: &mut Plan) {
    let [west, centre, ..] = COLUMNS;
    let [south, middle, north] = ROWS;
    let [hill_x, hill_y] = HILLTOP;
    plan.beside = Beside::Trees;
    let top = plan.node_with(HILLTOP, Control::Stop);
    plan.raise(HILLTOP, HILLTOP_M);
    let bend = |x: f64, y: f64| Bend { at: [x, y], radius_m: HILL_RADIUS_M };
    let town = plan.node([west, middle]);
    let between_x = (west + hill_x) / 2.0;
    let over = [bend(between_x + 35.0, middle), bend(between_x - 35.0, hill_y)];
    plan.connect((town, WEST), (top, EAST), &over, HILL_ROAD).heights = vec![[0.5, 2.0]];
    let loops = [(north, north + 150.0, NORTH), (south, south - 110.0, SOUTH)];
    for (row, far_y, leaving_rad) in loops {
        let town = plan.node([centre, row]);
        let around = [bend(centre, far_y), bend(hill_x, far_y)];
        let road = plan.connect((town, leaving_rad), (top, leaving_rad), &around, HILL_ROAD);
        road.heights = vec![[0.3, 0.0], [0.5, 5.0], [0.7, 2.0]];
    }
}

/// A level square with room to drive in all directions, and elsewhere something to run into, 10 m
/// ahead of a car at 30 6 that looks north.
fn add_square(plan: &mut Plan) {
    plan.blocks.push(Block {
        min: [20.0, 196.0],
        max: [175.0, 270.0],
        use_of_land: LandUse::Square,
    });
    plan.loose.push(Loose {
        at: [30.0, 18.0],
        heading_rad: 0.0,
        object: thing("obstacle", "Container", [6.0, 2.5, 3.0], -0.4),
    });
}
