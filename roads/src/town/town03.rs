//! Town03: a large town with a roundabout, boulevards of three lanes each way around and through
//! it, small streets between them, hills in the west, and a level square. Its streets, but for
//! those in the hills, lie where CARLA's do and within a metre as high, so that places that
//! programs name by coordinates are on the road.

use super::block::thing;
use super::course::{Bend, Pose};
use super::named::NamedWay;
use super::plan::{Beside, Block, Control, EAST, LandUse, Loose, NORTH, Plan, SOUTH, WEST};
use super::profile::{Edge, Extra, Profile};
use super::roundabout;

const LANE: Profile = Profile::street(1, 30);
const STREET: Profile = Profile::street(2, 30);
const BOULEVARD: Profile = Profile::street(3, 30);
const HILL_ROAD: Profile = Profile::two_way(1, Edge::Verge, 30);
const ROUNDABOUT: [f64; 2] = [-0.5, -0.4];

/// Junctions of the boulevards: on the ring, clockwise from its west, ...
const WEST_GATE: [f64; 2] = [-81.4, 1.0];
const NORTH_WEST: [f64; 2] = [-81.6, 138.2];
const NORTH_GATE: [f64; 2] = [4.2, 200.9];
const MARKET: [f64; 2] = [84.5, 198.9];
const NORTH_EAST: [f64; 2] = [153.2, 198.0];
const EAST_GATE: [f64; 2] = [238.6, -2.2];
const SOUTH_EAST: [f64; 2] = [237.2, -61.2];
const SOUTH_GATE: [f64; 2] = [-1.7, -200.6];
const SOUTH_WEST: [f64; 2] = [-81.0, -134.2];
/// ... and inside of it.
const NORTH_CROSS: [f64; 2] = [2.9, 136.4];
const SOUTH_CROSS: [f64; 2] = [-2.0, -132.7];
const FIRST_EAST: [f64; 2] = [79.0, -0.2];
const SECOND_EAST: [f64; 2] = [150.0, -1.2];
/// Junctions of small streets.
const FIRST_UPPER: [f64; 2] = [83.5, 134.8];
const SECOND_UPPER: [f64; 2] = [152.2, 133.2];
const FIRST_LOWER: [f64; 2] = [81.3, 73.8];
const SECOND_LOWER: [f64; 2] = [151.2, 72.0];
const FAR_WEST: [f64; 2] = [-147.3, 1.6];
const FAR_SOUTH_WEST: [f64; 2] = [-147.3, -103.7];
const COURT: [f64; 2] = [169.0, -60.7];
const GARDENS: [f64; 2] = [-2.2, -78.0];
/// How high these four lie, in metres; the streets that lead up to them are as steep as CARLA's.
const UPPER: [[f64; 2]; 4] = [FIRST_UPPER, SECOND_UPPER, FIRST_LOWER, SECOND_LOWER];
const UPPER_M: f64 = 8.0;
/// Heights on the way around the corners in the south-east and in the north-west.
const SOUTH_EAST_RISE: [f64; 2] = [0.48, 2.8];
const NORTH_WEST_RISE: [f64; 2] = [0.36, 0.9];
/// Junction in the hills, and its height in metres.
const HILLTOP: [f64; 2] = [-340.0, 40.0];
const HILLTOP_M: f64 = 7.0;
const HILL_RADIUS_M: f64 = 60.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [2.0, 7.0] });
    add_boulevards(&mut plan);
    add_roundabout(&mut plan);
    add_small_streets(&mut plan);
    add_hills(&mut plan);
    add_square(&mut plan);
    add_named_ways(&mut plan);
    plan
}

/// The ring and what leads into it from its middle.
fn add_boulevards(plan: &mut Plan) {
    plan.node_with(NORTH_WEST, Control::Stop);
    let straight = [
        (WEST_GATE, NORTH_WEST),
        (NORTH_GATE, MARKET),
        (MARKET, NORTH_EAST),
        (EAST_GATE, SOUTH_EAST),
        (SOUTH_WEST, WEST_GATE),
        (NORTH_CROSS, NORTH_GATE),
        (SOUTH_CROSS, SOUTH_GATE),
        (FIRST_EAST, SECOND_EAST),
        (SECOND_EAST, EAST_GATE),
    ];
    for (from, to) in straight {
        plan.line(from, to, BOULEVARD);
    }
    let corners = [
        (NORTH_WEST, [-81.8, 203.0], 30.0, NORTH_GATE),
        (NORTH_EAST, [243.2, 199.0], 35.0, EAST_GATE),
        (SOUTH_EAST, [235.6, -197.6], 56.0, SOUTH_GATE),
        (SOUTH_GATE, [-81.4, -199.6], 30.0, SOUTH_WEST),
    ];
    for (from, at, radius_m, to) in corners {
        let street = plan.corner(from, Bend { at, radius_m }, to, BOULEVARD);
        if from == SOUTH_EAST {
            street.heights = vec![SOUTH_EAST_RISE];
        }
    }
}

fn add_roundabout(plan: &mut Plan) {
    plan.node_with(GARDENS, Control::Yield);
    let arms = roundabout::build(plan, ROUNDABOUT, &[EAST, NORTH, WEST, SOUTH]);
    let around = [(FIRST_EAST, WEST), (NORTH_CROSS, SOUTH), (WEST_GATE, EAST), (GARDENS, NORTH)];
    for (arm, (at, leaving_rad)) in arms.into_iter().zip(around) {
        let end = plan.node(at);
        plan.connect(arm, (end, leaving_rad), &[], STREET);
    }
    plan.line(GARDENS, SOUTH_CROSS, STREET);
}

fn add_small_streets(plan: &mut Plan) {
    let small = [
        (FIRST_UPPER, Control::Stop),
        (SECOND_UPPER, Control::AllStop),
        (FIRST_LOWER, Control::Stop),
        (SECOND_LOWER, Control::Yield),
        (FAR_WEST, Control::Stop),
        (FAR_SOUTH_WEST, Control::Stop),
        (COURT, Control::Stop),
    ];
    for (at, control) in small {
        plan.node_with(at, control);
    }
    for at in UPPER {
        plan.raise(at, UPPER_M);
    }
    let parked = LANE.with(Extra::Parking);
    let straight = [
        (MARKET, FIRST_UPPER),
        (FIRST_UPPER, FIRST_LOWER),
        (FIRST_LOWER, FIRST_EAST),
        (NORTH_EAST, SECOND_UPPER),
        (SECOND_UPPER, SECOND_LOWER),
        (SECOND_LOWER, SECOND_EAST),
        (FIRST_LOWER, SECOND_LOWER),
        (FIRST_UPPER, SECOND_UPPER),
        (NORTH_CROSS, FIRST_UPPER),
        (NORTH_WEST, NORTH_CROSS),
        (FAR_WEST, WEST_GATE),
        (FAR_SOUTH_WEST, FAR_WEST),
        (SOUTH_WEST, SOUTH_CROSS),
        (COURT, SOUTH_EAST),
    ];
    for (from, to) in straight {
        plan.line(from, to, parked);
    }
    let corners = [
        (NORTH_WEST, [-147.3, 138.8], 40.0, FAR_WEST),
        (FAR_SOUTH_WEST, [-147.3, -134.4], 15.0, SOUTH_WEST),
        (SOUTH_CROSS, [169.0, -130.6], 39.0, COURT),
    ];
    for (from, at, radius_m, to) in corners {
        let street = plan.corner(from, Bend { at, radius_m }, to, parked);
        if from == NORTH_WEST {
            street.heights = vec![NORTH_WEST_RISE];
        }
    }
    let ends = [COURT, GARDENS].map(|at| plan.node(at));
    let bends = [[70.0, -60.7], [40.0, -78.0]].map(|at| Bend { at, radius_m: 25.0 });
    plan.connect((ends[0], WEST), (ends[1], EAST), &bends, parked);
}

fn add_hills(plan: &mut Plan) {
    let [hill_x, hill_y] = HILLTOP;
    plan.beside = Beside::Trees;
    let top = plan.node_with(HILLTOP, Control::Stop);
    plan.raise(HILLTOP, HILLTOP_M);
    let bend = |x: f64, y: f64| Bend { at: [x, y], radius_m: HILL_RADIUS_M };
    let [town_x, town_y] = FAR_WEST;
    let town = plan.node(FAR_WEST);
    let between_x = (town_x + hill_x) / 2.0;
    let over = [bend(between_x + 35.0, town_y), bend(between_x - 35.0, hill_y)];
    plan.connect((town, WEST), (top, EAST), &over, HILL_ROAD).heights = vec![[0.5, 2.0]];
    let [gate_x, gate_y] = NORTH_GATE;
    let around = [bend(gate_x, gate_y + 150.0), bend(hill_x, gate_y + 150.0)];
    let gate = plan.node(NORTH_GATE);
    let heights = vec![[0.3, 0.0], [0.5, 5.0], [0.7, 2.0]];
    plan.connect((gate, NORTH), (top, NORTH), &around, HILL_ROAD).heights = heights;
    let gate = plan.node(FAR_SOUTH_WEST);
    let around = [bend(hill_x, FAR_SOUTH_WEST[1])];
    plan.connect((gate, WEST), (top, SOUTH), &around, HILL_ROAD).heights = vec![[0.4, 0.0]];
}

/// A level square with room to drive in all directions, and elsewhere something to run into, 10 m
/// ahead of a car at 30 6 that looks north.
fn add_square(plan: &mut Plan) {
    plan.blocks.push(Block {
        min: [20.0, 214.0],
        max: [175.0, 275.0],
        use_of_land: LandUse::Square,
    });
    plan.loose.push(Loose {
        at: [30.0, 18.0],
        heading_rad: 0.0,
        object: thing("obstacle", "Container", [6.0, 2.5, 3.0], -0.4),
    });
}

/// What background traffic of CARLA's programs asks for: five roads on the roundabout and three
/// around the crossing between the two ways into a filling station. Ours lie on the roundabout's
/// island and on the grass behind that crossing.
fn add_named_ways(plan: &mut Plan) {
    let [x, y] = ROUNDABOUT;
    let [gate_x, gate_y] = SOUTH_GATE;
    let arm = |east: f64, north: f64| [x + east, y + north];
    let [east, north, west, south] =
        [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].map(|[e, n]| arm(20.0 * e, 20.0 * n));
    let behind_gate = |east: f64, south: f64| [gate_x + east, gate_y - south];
    let ways = [
        (1100, -5, east, (arm(14.0, -8.65), NORTH), 17.3),
        (1206, -5, east, (arm(11.0, -3.65), NORTH), 7.3),
        (1624, -5, north, (arm(13.15, 12.0), WEST), 26.3),
        (1655, -5, west, (arm(-14.0, 4.65), SOUTH), 9.3),
        (1772, 3, south, (arm(-8.65, -14.0), EAST), 17.3),
        (1031, -1, SOUTH_GATE, (behind_gate(6.0, 15.5), WEST), 12.3),
        (100, -1, SOUTH_GATE, (behind_gate(9.5, 16.0), WEST), 19.3),
        (1959, -1, SOUTH_GATE, (behind_gate(11.5, 16.5), WEST), 23.3),
    ];
    for (number, lane, junction, (at, heading_rad), length_m) in ways {
        let (node, start) = (plan.node(junction), Pose::new(at, heading_rad));
        let through = junction != SOUTH_GATE;
        plan.named.push(NamedWay { number, lane, node, through, start, length_m });
    }
}
