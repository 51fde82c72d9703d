//! Town10HD: a dense inner city inside a ring with wide corners: a street from south to north, an
//! avenue with a strip between its directions, a small street. Its streets lie where CARLA's do, so
//! that places that programs name by coordinates are on the road; the ring's south-eastern arc has
//! a third lane outside of those two.

use super::course::{Bend, Pose, direction};
use super::plan::{Beside, Block, Control, End, LandUse, Plan, UNEVEN_M};
use super::profile::Profile;

const LANE: Profile = Profile::street(1, 30);
const STREET: Profile = Profile::street(2, 30);
const WIDE_STREET: Profile = Profile::street(3, 30);
const AVENUE: Profile = STREET.divided(4.5);

/// Junctions of the ring, clockwise from its north, ...
const NORTH: [f64; 2] = [-47.0, 63.2];
const EAST: [f64; 2] = [104.4, -21.0];
const SOUTH_EAST: [f64; 2] = [104.1, -68.1];
const SOUTH: [f64; 2] = [-46.7, -135.2];
const WEST: [f64; 2] = [-108.7, -20.4];
/// ... and inside of it.
const CENTRE: [f64; 2] = [-47.0, -20.6];
const GATE: [f64; 2] = [41.9, -20.8];
const CORNER: [f64; 2] = [-46.8, -67.9];
const COURT: [f64; 2] = [42.5, -68.1];
/// Where the ring leaves its southern junction for the west, on a bend.
const SOUTH_LEAVES_WEST: [f64; 2] = [-71.7, -134.0];

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Nothing);
    for at in [GATE, CORNER, SOUTH_EAST] {
        plan.node_with(at, Control::Yield);
    }
    plan.node_with(COURT, Control::AllStop);
    add_ring(&mut plan);
    add_inner_streets(&mut plan);
    add_blocks(&mut plan);
    plan
}

/// A street between two junctions; it begins and ends at these distances from their middles.
fn connect(plan: &mut Plan, ends: [([f64; 2], f64); 2], bends: &[Bend], profile: Profile) {
    let [(from, _), (to, _)] = ends;
    let toward =
        [bends.first().map_or(to, |bend| bend.at), bends.last().map_or(from, |bend| bend.at)];
    let [from, to] = [0, 1].map(|index| {
        let (at, reach_m) = ends[index];
        let leaving = Pose::new(at, direction(at, toward[index]));
        End::at(plan.node(at), leaving.ahead(reach_m - UNEVEN_M))
    });
    plan.connect(from, to, bends, profile);
}

fn add_ring(plan: &mut Plan) {
    let bend = |x: f64, y: f64, radius_m: f64| Bend { at: [x, y], radius_m };
    let north_east = [bend(105.1, 62.7, 39.4)];
    let south_east = [bend(81.9, -136.1, 36.3), bend(103.9, -109.4, 48.7)];
    let north_west = [bend(-108.1, 38.5, 46.0), bend(-86.9, 63.6, 34.8)];
    connect(plan, [(NORTH, 19.0), (EAST, 25.0)], &north_east, STREET);
    connect(plan, [(EAST, 21.0), (SOUTH_EAST, 15.0)], &[], STREET);
    connect(plan, [(SOUTH, 18.0), (SOUTH_EAST, 15.0)], &south_east, WIDE_STREET);
    connect(plan, [(WEST, 23.0), (NORTH, 20.0)], &north_west, STREET);
    let south_west = [bend(-87.9, -130.3, 41.8), bend(-109.6, -98.0, 71.6)];
    let toward = direction(SOUTH_LEAVES_WEST, south_west[0].at);
    let from = End::at(plan.node(SOUTH), Pose::new(SOUTH_LEAVES_WEST, toward));
    let arriving = Pose::new(WEST, direction(WEST, south_west[1].at));
    let to = End::at(plan.node(WEST), arriving.ahead(23.0 - UNEVEN_M));
    plan.connect(from, to, &south_west, STREET);
}

fn add_inner_streets(plan: &mut Plan) {
    let straight = [
        (SOUTH, 20.0, CORNER, 15.0, STREET),
        (CORNER, 16.0, CENTRE, 22.0, STREET),
        (CENTRE, 22.0, NORTH, 20.0, STREET),
        (WEST, 20.0, CENTRE, 20.0, AVENUE),
        (CENTRE, 18.0, GATE, 16.0, AVENUE),
        (GATE, 16.0, EAST, 21.0, AVENUE),
        (CORNER, 20.0, COURT, 15.0, LANE),
        (COURT, 16.0, SOUTH_EAST, 18.0, LANE),
        (COURT, 16.0, GATE, 21.0, LANE),
    ];
    for (from, from_m, to, to_m, profile) in straight {
        connect(plan, [(from, from_m), (to, to_m)], &[], profile);
    }
}

/// Land between the streets, as far from them as their rounded corners ask, and rows of houses
/// around the ring.
fn add_blocks(plan: &mut Plan) {
    let inside = [
        // North of the avenue, from west to east.
        (LandUse::Houses, [-94.6, -5.0], [-60.2, 34.0]),
        (LandUse::Row, [-82.6, 34.4], [-60.2, 49.8]),
        (LandUse::Houses, [-33.8, -5.2], [22.0, 49.8]),
        (LandUse::Park, [24.0, -5.2], [75.4, 49.8]),
        (LandUse::Row, [76.0, -5.2], [91.2, 29.0]),
        // South of it, ...
        (LandUse::Houses, [-95.2, -76.0], [-60.2, -36.2]),
        (LandUse::Row, [-95.2, -92.0], [-60.2, -76.8]),
        (LandUse::Row, [-82.0, -116.0], [-60.2, -92.6]),
        (LandUse::Row, [-33.6, -58.6], [31.5, -36.4]),
        (LandUse::Row, [52.0, -58.6], [91.0, -36.2]),
        // ... and of the small street.
        (LandUse::Houses, [-33.8, -118.5], [30.0, -77.8]),
        (LandUse::Houses, [31.0, -118.5], [72.0, -77.8]),
        (LandUse::Row, [73.0, -100.0], [88.2, -77.8]),
    ];
    let outside = [
        ([-120.0, 74.6], [118.0, 98.6]),
        ([118.4, -150.0], [142.4, 74.0]),
        ([-120.0, -174.6], [118.0, -150.6]),
        ([-144.6, -150.0], [-120.6, 74.0]),
    ];
    let outside = outside.map(|(min, max)| (LandUse::Row, min, max));
    let blocks = inside.into_iter().chain(outside);
    plan.blocks.extend(blocks.map(|(use_of_land, min, max)| Block { min, max, use_of_land }));
}
