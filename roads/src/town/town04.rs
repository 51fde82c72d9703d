//! Town04: a motorway in the shape of an eight with an interchange on each side, a village inside
//! of each, and a country road around.

use super::course::{Bend, Pose};
use super::motorway::{Motorway, TERMINAL_M};
use super::plan::{Beside, Control, EAST, NORTH, Plan, SOUTH, WEST};
use super::profile::{Edge, Profile};

const MOTORWAY: Motorway = Motorway { lanes: 3, limit_kmh: 80 };
const STREET: Profile = Profile::street(1, 40);
const COUNTRY: Profile = Profile::two_way(1, Edge::Verge, 60);
/// With a footpath on one side, so that people can walk from village to village.
const PATH_LEFT: Profile = COUNTRY.edged(Edge::Footpath, Edge::Verge);
const PATH_RIGHT: Profile = COUNTRY.edged(Edge::Verge, Edge::Footpath);
/// Distance of the interchanges from the crossing of the eight, in metres.
const SIDE: f64 = 450.0;
/// Where the diagonals of the eight begin.
const DIAGONAL: [f64; 2] = [150.0, 360.0];
/// Heights of the upper diagonal.
const OVER: [[f64; 2]; 2] = [[0.4, 7.0], [0.6, 7.0]];
/// The villages' streets, for the eastern one.
const VILLAGE_X: [f64; 3] = [150.0, 220.0, 300.0];
const VILLAGE_Y: f64 = 90.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Nothing);
    let bridge = |x: f64| Pose::new([x, 0.0], NORTH);
    let east = MOTORWAY.interchange(&mut plan, bridge(SIDE), STREET, Control::Lights);
    let west = MOTORWAY.interchange(&mut plan, bridge(-SIDE), STREET, Control::Lights);
    let [x, y] = DIAGONAL;
    let bend = |x: f64, y: f64| Bend { at: [x, y], radius_m: 100.0 };
    let lower = [bend(SIDE, y), bend(x, y), bend(-x, -y), bend(-SIDE, -y)];
    let upper = [bend(-SIDE, y), bend(-x, y), bend(x, -y), bend(SIDE, -y)];
    MOTORWAY.connect(&mut plan, &east, &lower, &west, &[]);
    MOTORWAY.connect(&mut plan, &west, &upper, &east, &OVER);
    for sign in [1.0, -1.0] {
        add_village(&mut plan, sign);
    }
    add_country_road(&mut plan);
    plan
}

/// Streets in rectangles; `sign` is -1 for the mirror image in the west.
fn add_village(plan: &mut Plan, sign: f64) {
    plan.beside = Beside::Houses { storeys: [1.0, 3.0] };
    plan.control = Control::Stop;
    let [inner, middle, outer] = VILLAGE_X.map(|x| sign * x);
    let mut xs = [inner, middle, outer, sign * (SIDE - TERMINAL_M)];
    xs.sort_by(f64::total_cmp);
    plan.row(0.0, &xs, STREET);
    plan.column(middle, &[-VILLAGE_Y, 0.0, VILLAGE_Y], STREET);
    for y in [VILLAGE_Y, -VILLAGE_Y] {
        for x in [inner, outer] {
            let bend = Bend { at: [x, y], radius_m: 16.0 };
            plan.corner([x, 0.0], bend, [middle, y], STREET);
        }
    }
}

fn add_country_road(plan: &mut Plan) {
    const OUT: f64 = SIDE + 170.0;
    const FAR: f64 = 520.0;
    plan.beside = Beside::Trees;
    let end = SIDE + TERMINAL_M;
    let (from, to) = (plan.node([end, 0.0]), plan.node([-end, 0.0]));
    let bend = |x: f64, y: f64| Bend { at: [x, y], radius_m: 80.0 };
    for sign in [1.0, -1.0] {
        // Both halves end at the same two junctions: one from a fork beside each interchange.
        let (east, west) = (
            plan.node_with([OUT - 40.0, 0.0], Control::Yield),
            plan.node_with([40.0 - OUT, 0.0], Control::Yield),
        );
        let leaving = if sign > 0.0 { NORTH } else { SOUTH };
        let around = [bend(OUT - 40.0, sign * FAR), bend(40.0 - OUT, sign * FAR)];
        let profile = if sign > 0.0 { PATH_LEFT } else { COUNTRY };
        plan.connect((east, leaving), (west, leaving), &around, profile).heights =
            vec![[0.2, 3.0], [0.4, 0.0], [0.6, 5.0], [0.8, 0.0]];
        if sign > 0.0 {
            plan.connect((from, EAST), (east, WEST), &[], PATH_LEFT);
            plan.connect((to, WEST), (west, EAST), &[], PATH_RIGHT);
        }
    }
}
