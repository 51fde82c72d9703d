//! Town07: a village between farm tracks, with a ring of country roads around both that leads over
//! two hills, stop and yield signs, and few lights. Its streets lie where CARLA's do, so that
//! places that programs name by coordinates are on the road.

use super::block::house;
use super::course::{Bend, Pose, direction};
use super::draft::ObjectDraft;
use super::plan::{Beside, Control, End, Loose, Plan};
use super::profile::{Edge, Profile};

type Place = [f64; 2];

/// Straight roads, those around bends, and those around narrow ones.
const COUNTRY: Profile = Profile::two_way(1, Edge::Verge, 40);
const WINDING: Profile = Profile::two_way(1, Edge::Verge, 30);
const NARROW: Profile = Profile::two_way(1, Edge::Verge, 20);
const VILLAGE: Profile = Profile::street(1, 30);
/// Around the village: who drives along the reference line has it to the right.
const OUTER: Profile = VILLAGE.with_left(1, Edge::Verge);
/// Traffic to the village has a lane more, which turns right.
const OUTER_WIDER: Profile = VILLAGE.with_left(2, Edge::Verge);
/// Roads of one direction: past the village's square, and around the island at the end of a track.
const SQUARE: Profile = Profile::one_way(1, Edge::Sidewalk, 20);
const ISLAND: Profile = Profile::one_way(1, Edge::Verge, 20);

/// Junctions of the ring, clockwise from its south-west, ...
const WEST_LOWER: Place = [-201.0, -49.9];
const WEST_MIDDLE: Place = [-200.3, 35.4];
const WEST_UPPER: Place = [-199.9, 161.3];
const NORTH: Place = [-1.5, 240.5];
const EAST_UPPER: Place = [68.0, 1.5];
const EAST_LOWER: Place = [67.5, -60.5];
const SOUTH: Place = [-109.3, -117.1];
/// ... of the farm tracks, ...
const TRACK_LOWER: Place = [-151.3, -50.4];
const TRACK_MIDDLE: Place = [-150.3, 35.0];
const ISLAND_SOUTH: Place = [-149.6, 88.0];
const ISLAND_EAST: Place = [-140.5, 99.0];
/// ... around the village, clockwise from its south-west, ...
const SOUTH_WEST: Place = [-101.7, -52.7];
const MAIN_WEST: Place = [-101.0, 0.6];
const FARM_WEST: Place = [-100.8, 34.6];
const MIDDLE_WEST: Place = [-100.7, 63.5];
const UPPER_WEST: Place = [-101.0, 95.5];
const UPPER_SLANT: Place = [-87.0, 111.0];
const NORTH_SLANT: Place = [-71.1, 160.1];
const NORTH_EAST: Place = [-2.4, 159.4];
const UPPER_EAST: Place = [-2.8, 107.2];
const MIDDLE_EAST: Place = [-3.2, 64.4];
const MAIN_EAST: Place = [-3.7, 1.6];
const SOUTH_EAST: Place = [-4.2, -60.2];
/// ... at both ends of the road past the square, and where the main street gets wider.
const SQUARE_WEST: Place = [-68.3, 107.3];
const SQUARE_EAST: Place = [-25.5, 107.2];
const MAIN_WIDER: Place = [25.0, 1.8];

/// An end of a street: the junction, and where the street begins if not on a line through the
/// junction's middle.
type Start = (Place, Option<Place>);
/// A street past rounded corners.
type Way = (Start, &'static [Bend], Start, Profile);

const fn bend(x: f64, y: f64, radius_m: f64) -> Bend {
    Bend { at: [x, y], radius_m }
}

/// Barns between the farm tracks: where, and half of their lengths in metres.
const BARNS: [(Place, f64); 4] = [
    ([-177.0, -80.0], 13.0),
    ([-130.0, -84.0], 9.0),
    ([-175.0, 62.0], 13.0),
    ([-126.0, 66.0], 9.0),
];
/// How deep barns stand in the ground, in metres, so that none hangs over it.
const BARN_CELLAR_M: f64 = 1.0;
/// Heights on the way over the two hills of the ring: share of the length, metres.
const NORTH_HILL: [[f64; 2]; 6] =
    [[0.088, 1.5], [0.297, 6.3], [0.346, 6.9], [0.403, 6.2], [0.6, 1.6], [0.725, 0.0]];
const EAST_HILL: [[f64; 2]; 5] =
    [[0.102, 1.25], [0.453, 8.6], [0.512, 9.2], [0.57, 8.6], [0.898, 1.5]];

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Yield, Beside::Trees);
    add_controls(&mut plan);
    for ways in [&RING[..], &TRACKS, &STREETS] {
        for (from, bends, to, profile) in ways {
            let first = bends.first().map_or(to.1.unwrap_or(to.0), |bend| bend.at);
            let last = bends.last().map_or(from.1.unwrap_or(from.0), |bend| bend.at);
            let ends = [(from, first), (to, last)].map(|(start, next)| end(&mut plan, start, next));
            let street = plan.connect(ends[0], ends[1], bends, *profile);
            if profile.right.edge == Edge::Sidewalk {
                street.beside = Beside::Houses { storeys: [1.0, 3.0] };
            }
            street.heights = match (from.0, to.0) {
                (NORTH, WEST_UPPER) => NORTH_HILL.to_vec(),
                (EAST_UPPER, NORTH) => EAST_HILL.to_vec(),
                _ => Vec::new(),
            };
            street.climbs_on = true;
        }
    }
    add_barns(&mut plan);
    plan
}

fn add_barns(plan: &mut Plan) {
    for (at, half_m) in BARNS {
        let barn = house([2.0 * half_m, 14.0], 2.0);
        let object = ObjectDraft {
            z_offset_m: barn.z_offset_m - BARN_CELLAR_M,
            height_m: barn.height_m + BARN_CELLAR_M,
            ..barn
        };
        plan.loose.push(Loose { at, heading_rad: 0.0, object });
    }
}

/// Who may go first where CARLA's town has lights, and stop signs for all. Where it has yield signs
/// for all, the straight road goes first.
fn add_controls(plan: &mut Plan) {
    for at in [SOUTH_WEST, EAST_LOWER, EAST_UPPER, MAIN_EAST, NORTH] {
        plan.node_with(at, Control::Lights);
    }
    for at in [WEST_LOWER, WEST_MIDDLE, TRACK_MIDDLE, FARM_WEST, MIDDLE_EAST, SOUTH_EAST] {
        plan.node_with(at, Control::AllStop);
    }
    plan.node_with(TRACK_LOWER, Control::Stop);
    plan.node_with(MAIN_WIDER, Control::Free);
}

fn end(plan: &mut Plan, (junction, start): &Start, next: Place) -> End {
    let node = plan.node(*junction);
    let leaves = |from: Place| direction(from, next);
    start.map_or_else(
        || (node, leaves(*junction)).into(),
        |start| End::at(node, Pose::new(start, leaves(start))),
    )
}

const RING: [Way; 9] = [
    ((SOUTH, None), &[bend(-201.5, -107.0, 9.0)], (WEST_LOWER, None), NARROW),
    (
        (WEST_LOWER, None),
        &[bend(-201.6, -34.9, 170.0), bend(-203.7, -12.4, 173.0), bend(-201.1, 17.5, 250.0)],
        (WEST_MIDDLE, None),
        COUNTRY,
    ),
    ((WEST_MIDDLE, None), &[bend(-200.0, 48.2, 100.0)], (WEST_UPPER, None), COUNTRY),
    (
        (NORTH, Some([-16.0, 242.3])),
        &[
            bend(-54.8, 250.2, 32.8),
            bend(-95.4, 173.5, 32.0),
            bend(-136.4, 240.8, 44.3),
            bend(-180.1, 247.8, 18.0),
            bend(-187.3, 246.0, 22.0),
            bend(-199.9, 237.9, 17.6),
        ],
        (WEST_UPPER, None),
        WINDING,
    ),
    (
        (EAST_UPPER, Some([70.5, 7.7])),
        &[
            bend(81.6, 29.1, 21.4),
            bend(55.0, 51.1, 30.3),
            bend(60.5, 87.3, 490.0),
            bend(68.7, 129.2, 37.4),
            bend(44.1, 156.9, 52.9),
            bend(41.8, 198.9, 280.0),
            bend(36.8, 229.2, 27.9),
        ],
        (NORTH, Some([14.8, 238.8])),
        WINDING,
    ),
    (
        (EAST_UPPER, Some([73.0, -3.6])),
        &[bend(83.2, -10.9, 25.6), bend(84.8, -47.0, 29.3)],
        (EAST_LOWER, Some([72.4, -56.4])),
        OUTER,
    ),
    (
        (EAST_LOWER, Some([70.3, -68.2])),
        &[
            bend(74.6, -82.2, 25.0),
            bend(54.5, -103.6, 75.0),
            bend(24.8, -117.2, 99.5),
            bend(-45.5, -124.6, 316.0),
        ],
        (SOUTH, None),
        WINDING,
    ),
    ((NORTH, Some([-1.8, 228.6])), &[], (NORTH_EAST, None), COUNTRY),
    ((WEST_UPPER, None), &[], (NORTH_SLANT, None), COUNTRY),
];

const TRACKS: [Way; 10] = [
    ((WEST_LOWER, None), &[], (TRACK_LOWER, None), COUNTRY),
    ((TRACK_LOWER, None), &[], (SOUTH_WEST, Some([-110.7, -50.7])), COUNTRY),
    ((WEST_MIDDLE, None), &[], (TRACK_MIDDLE, None), COUNTRY),
    ((TRACK_MIDDLE, None), &[], (FARM_WEST, None), COUNTRY),
    ((TRACK_LOWER, None), &[], (TRACK_MIDDLE, None), COUNTRY),
    ((TRACK_MIDDLE, None), &[], (ISLAND_SOUTH, Some([-149.7, 79.6])), COUNTRY),
    (
        (SOUTH_WEST, Some([-102.4, -62.7])),
        &[bend(-103.4, -74.2, 350.0), bend(-108.0, -105.3, 25.0)],
        (SOUTH, None),
        COUNTRY,
    ),
    (
        (UPPER_WEST, Some([-107.4, 99.3])),
        &[bend(-109.4, 100.1, 9.6)],
        (ISLAND_EAST, Some([-133.9, 98.8])),
        NARROW,
    ),
    // Their left borders lie around the island.
    (
        (ISLAND_SOUTH, Some([-144.7, 90.9])),
        &[bend(-143.3, 91.9, 7.5)],
        (ISLAND_EAST, Some([-142.4, 93.5])),
        ISLAND,
    ),
    (
        (ISLAND_EAST, Some([-143.0, 102.8])),
        &[bend(-146.0, 107.1, 8.3), bend(-156.5, 105.4, 8.3), bend(-159.7, 95.4, 8.3)],
        (ISLAND_SOUTH, Some([-156.0, 91.7])),
        ISLAND,
    ),
];

const STREETS: [Way; 21] = [
    ((SOUTH_WEST, Some([-101.4, -43.7])), &[bend(-101.2, -38.4, 200.0)], (MAIN_WEST, None), OUTER),
    ((MAIN_WEST, None), &[], (FARM_WEST, None), OUTER),
    ((FARM_WEST, None), &[], (MIDDLE_WEST, Some([-100.7, 55.1])), OUTER),
    ((MIDDLE_WEST, Some([-100.6, 72.2])), &[], (UPPER_WEST, Some([-100.6, 86.3])), OUTER),
    ((UPPER_WEST, Some([-97.2, 99.8])), &[], (UPPER_SLANT, Some([-95.7, 101.6])), OUTER),
    (
        (UPPER_SLANT, Some([-84.2, 120.2])),
        &[bend(-81.9, 125.2, 90.0), bend(-77.4, 139.2, 450.0)],
        (NORTH_SLANT, None),
        OUTER,
    ),
    ((NORTH_SLANT, None), &[], (NORTH_EAST, None), OUTER),
    ((NORTH_EAST, None), &[], (UPPER_EAST, None), OUTER),
    ((UPPER_EAST, None), &[], (MIDDLE_EAST, None), OUTER),
    ((MIDDLE_EAST, None), &[], (MAIN_EAST, Some([-3.6, 14.2])), OUTER),
    ((MAIN_EAST, Some([5.5, 1.7])), &[], (MAIN_WIDER, Some([19.0, 1.8])), OUTER_WIDER),
    (
        (MAIN_WIDER, Some([31.1, 1.9])),
        &[bend(34.6, 1.9, 150.0)],
        (EAST_UPPER, Some([56.9, 1.3])),
        OUTER,
    ),
    (
        (EAST_LOWER, Some([60.2, -61.9])),
        &[bend(56.9, -62.6, 27.8), bend(27.4, -61.7, 400.0), bend(19.2, -61.6, 180.0)],
        (SOUTH_EAST, None),
        OUTER,
    ),
    ((SOUTH_EAST, None), &[], (SOUTH_WEST, Some([-91.2, -55.3])), OUTER),
    ((SOUTH_EAST, None), &[], (MAIN_EAST, Some([-3.8, -7.6])), VILLAGE),
    ((MAIN_WEST, None), &[], (MAIN_EAST, Some([-12.2, 1.5])), VILLAGE),
    ((MIDDLE_WEST, Some([-90.8, 63.6])), &[], (MIDDLE_EAST, None), VILLAGE),
    ((UPPER_SLANT, Some([-76.4, 107.4])), &[], (SQUARE_WEST, Some([-74.2, 107.4])), VILLAGE),
    ((SQUARE_WEST, Some([-57.7, 107.3])), &[], (SQUARE_EAST, Some([-34.8, 107.3])), VILLAGE),
    ((SQUARE_EAST, Some([-16.4, 107.2])), &[], (UPPER_EAST, None), VILLAGE),
    // Its left border.
    (
        (SQUARE_WEST, Some([-66.4, 97.6])),
        &[
            bend(-65.9, 95.1, 10.5),
            bend(-61.9, 90.0, 7.8),
            bend(-30.0, 90.0, 7.4),
            bend(-25.5, 95.0, 8.7),
        ],
        (SQUARE_EAST, Some([-25.5, 98.4])),
        SQUARE,
    ),
];
