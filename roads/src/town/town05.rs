//! Town05: a grid of wide streets inside a ring road that climbs to a viaduct in the west. Its
//! streets lie where CARLA's do, so that places that programs name by coordinates are on the road.

use super::course::{Bend, Pose, direction};
use super::plan::{Beside, Control, EAST, End, NORTH, Plan, SOUTH, UNEVEN_M, WEST};
use super::profile::{Edge, Extra, Profile};

const STREET: Profile = Profile::street(2, 30);
const AVENUE: Profile = Profile::street(3, 30);
const LANE: Profile = Profile::street(1, 30).with(Extra::Parking);
/// Width of the strip between the directions of the ring road, in metres.
const MEDIAN_M: f64 = 3.5;
const RING_ROAD: Profile = Profile::two_way(3, Edge::HardShoulder, 60).divided(MEDIAN_M);
/// Middle lines of the streets from south to north, from west to east.
const WEST_STREET: f64 = -270.5;
const COLUMNS: [f64; 3] = [-189.8, -126.2, -49.3];
const EAST_STREET: f64 = 101.6;
const EAST_LANE: f64 = 153.3;
/// Those of the streets from west to east, from south to north.
const ROWS: [f64; 3] = [-89.8, -0.6, 89.7];
const SOUTH_STREET: f64 = -149.3;
const NORTH_STREET: f64 = 140.6;
/// Junctions of the avenue, from south to north: with the ring road, the lane in the east, the
/// rows, that lane, the ring road. It is straight but for a bend of 1.5
/// degrees.
const AVENUE_AT: [[f64; 2]; 7] = [
    [29.8, -198.2],
    [29.8, -142.8],
    [29.8, ROWS[0]],
    [29.8, ROWS[1]],
    [31.6, ROWS[2]],
    [33.1, 147.5],
    [34.4, 197.0],
];
/// Which of them are with the lane.
const LANE_AT: [usize; 2] = [1, 5];
/// How far those reach along the avenue and along the lane, in metres: kerbs of 6 m lie between.
const LANE_REACH_M: [f64; 2] = [10.0 - UNEVEN_M, 17.0 - UNEVEN_M];
const AVENUE_BEND: Bend = Bend { at: [29.8, 28.0], radius_m: 500.0 };
/// The ring road, west and east.
const RING: [f64; 2] = [-236.7, 200.2];
const RING_RADIUS_M: f64 = 98.0;
/// Heights on the western half of the ring road, those of CARLA's within a metre.
const VIADUCT_HEIGHTS: [[f64; 2]; 5] =
    [[0.03, 0.0], [0.14, 8.2], [0.42, 10.0], [0.863, 10.0], [0.987, 0.0]];

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Houses { storeys: [3.0, 10.0] });
    let [first, second, third] = COLUMNS;
    let [lower, middle, upper] = ROWS;
    for (row, avenue) in ROWS.into_iter().zip(&AVENUE_AT[2..]) {
        plan.row(row, &[first, second, third, avenue[0]], STREET);
    }
    plan.row(middle, &[AVENUE_AT[3][0], EAST_STREET], STREET);
    plan.column(first, &ROWS, STREET);
    plan.column(second, &[SOUTH_STREET, lower, middle, upper, NORTH_STREET], STREET);
    plan.column(third, &ROWS, STREET);
    let corner = |x: f64, y: f64, radius_m: f64| Bend { at: [x, y], radius_m };
    plan.corner([first, upper], corner(first, NORTH_STREET, 30.0), [second, NORTH_STREET], STREET);
    plan.corner([first, lower], corner(first, SOUTH_STREET, 31.5), [second, SOUTH_STREET], STREET);
    plan.corner([third, lower], corner(third, SOUTH_STREET, 38.5), [second, SOUTH_STREET], STREET);
    add_avenue(&mut plan);
    add_outer_streets(&mut plan);
    add_ring_road(&mut plan);
    plan
}

/// The avenue, and where it meets the ring road.
fn add_avenue(plan: &mut Plan) {
    for (index, pair) in AVENUE_AT.windows(2).enumerate() {
        let [from, to] = *pair else { continue };
        let bends = if index == 3 { &[AVENUE_BEND][..] } else { &[] };
        let first = bends.first().map_or(to, |bend| bend.at);
        let last = bends.last().map_or(from, |bend| bend.at);
        let [from, to] = [(index, first), (index + 1, last)]
            .map(|(index, toward)| avenue_end(plan, index, toward, LANE_REACH_M[0]));
        plan.connect(from, to, bends, AVENUE);
    }
}

/// The end of a street at a junction of the avenue, by its place and by where the street leads;
/// where the lane joins, it begins at the given distance from the middle.
fn avenue_end(plan: &mut Plan, index: usize, toward: [f64; 2], reach_m: f64) -> End {
    let at = AVENUE_AT[index];
    let (node, leaving) = (plan.node(at), Pose::new(at, direction(at, toward)));
    if LANE_AT.contains(&index) {
        End::at(node, leaving.ahead(reach_m))
    } else {
        (node, leaving.heading_rad).into()
    }
}

/// What lies around the grid: streets in the west and the east, and the lane behind the latter.
fn add_outer_streets(plan: &mut Plan) {
    let [lower, middle, upper] = ROWS;
    let [first, second, third] = COLUMNS;
    let bend = |x: f64, y: f64, radius_m: f64| Bend { at: [x, y], radius_m };
    let biking = STREET.with(Extra::Biking);
    let west = plan.node_with([WEST_STREET, middle], Control::Yield);
    let east = plan.node([EAST_STREET, middle]);
    let far = plan.node_with([EAST_LANE, middle], Control::Yield);
    plan.row(middle, &[WEST_STREET, first], STREET);
    plan.row(middle, &[EAST_STREET, EAST_LANE], LANE);
    let [lower_first, upper_first] = [lower, upper].map(|y| plan.node([first, y]));
    let north = [bend(WEST_STREET, upper, 34.0)];
    let south = [bend(-250.5, lower, 49.0), bend(WEST_STREET, -80.5, 17.0)];
    plan.connect((upper_first, WEST), (west, NORTH), &north, biking);
    plan.connect((lower_first, WEST), (west, SOUTH), &south, biking);
    let avenue = AVENUE_AT.map(|at| plan.node(at));
    for (row, leaving_rad) in [(2, SOUTH), (4, NORTH)] {
        let corner = bend(EAST_STREET, AVENUE_AT[row][1], 45.0);
        plan.connect((avenue[row], EAST), (east, leaving_rad), &[corner], STREET);
    }
    let north = [bend(80.0, 148.6, 190.0), bend(EAST_LANE, 131.4, 49.0)];
    let south = [bend(94.2, -145.2, 140.0), bend(EAST_LANE, -119.3, 49.5)];
    for (index, leaving_rad, bends) in [(5, NORTH, north), (1, SOUTH, south)] {
        let from = avenue_end(plan, index, bends[0].at, LANE_REACH_M[1]);
        plan.connect(from, (far, leaving_rad), &bends, LANE);
    }
    // The corner in the north of the third column is so wide that it begins within the junction.
    let (column, street) = (plan.node([third, upper]), plan.node([second, NORTH_STREET]));
    let (start, turn) = ([-50.7, 109.6], bend(-58.4, NORTH_STREET, 40.0));
    let start = End::at(column, Pose::new(start, direction(start, turn.at)));
    plan.connect(start, (street, EAST), &[turn], STREET);
}

fn add_ring_road(plan: &mut Plan) {
    plan.beside = Beside::Nothing;
    let [south, .., north] = AVENUE_AT;
    let nodes = [south, north].map(|at| plan.node(at));
    let [west, east] =
        RING.map(|x| [south[1], north[1]].map(|y| Bend { at: [x, y], radius_m: RING_RADIUS_M }));
    plan.connect((nodes[0], EAST), (nodes[1], EAST), &east, RING_ROAD);
    plan.connect((nodes[0], WEST), (nodes[1], WEST), &west, RING_ROAD).heights =
        VIADUCT_HEIGHTS.to_vec();
}
