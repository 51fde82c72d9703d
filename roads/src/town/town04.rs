//! Town04: a motorway in the shape of an eight that crosses itself in a cloverleaf, a village in
//! its north-eastern loop, and two country roads as short cuts. Its roads lie where CARLA's do, so
//! that places that programs name by coordinates are on the road.

use super::course::{Bend, Pose, direction};
use super::named::NamedWay;
use super::one_way::OneWay;
use super::plan::{Beside, Control, EAST, End, NORTH, Plan, SOUTH, UNEVEN_M, WEST};
use super::profile::{Edge, Profile};

/// Width of the strip between the motorway's directions, in metres.
const MEDIAN_M: f64 = 7.0;
const MOTORWAY: Profile = motorway(80);
/// Around the wide bends in the west and the narrow one in the east.
const WEST_MOTORWAY: Profile = motorway(70);
const EAST_MOTORWAY: Profile = motorway(50);
const LOOP: Profile = Profile::one_way(1, Edge::Verge, 50);
const COUNTRY: Profile = Profile::one_way(2, Edge::Verge, 60);
const STREET: Profile = Profile::street(1, 30);
/// The motorway's middle lines from south to north, and from west to east.
const WEST_X: f64 = -498.8;
const CROSSING: [f64; 2] = [-0.2, -21.8];
const EAST_X: f64 = 397.4;
const NORTH_Y: f64 = 380.2;
/// Bends that end at a junction.
const SOUTH_BEND: Bend = Bend { at: [-78.7, -420.0], radius_m: 198.0 };
const EAST_BEND: Bend = Bend { at: [358.3, -26.7], radius_m: 53.0 };
/// Height of the motorway from west to east where it crosses the other, in metres.
const BRIDGE_M: f64 = 10.0;
/// How far the village's streets begin from the motorway's middle, in metres.
const VILLAGE_REACH_M: f64 = 26.0 - UNEVEN_M;
/// How far junctions with those streets reach along the motorway, in metres.
const VILLAGE_GATE_M: f64 = 14.0;
/// The village's main street.
const MAIN_STREET_Y: f64 = 171.3;

const fn motorway(limit_kmh: u32) -> Profile {
    Profile::two_way(4, Edge::HardShoulder, limit_kmh).divided(MEDIAN_M)
}

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Free, Beside::Nothing);
    let gates = Gates::new(&mut plan);
    add_motorway(&mut plan, &gates);
    add_loops(&mut plan, &gates);
    add_country_roads(&mut plan, &gates);
    add_village(&mut plan, &gates);
    add_named_ways(&mut plan);
    plan
}

fn bend(x: f64, y: f64, radius_m: f64) -> Bend {
    Bend { at: [x, y], radius_m }
}

/// A junction of the motorway: where the middle line arrives and where it goes on, both looking
/// away from the junction.
struct Gate {
    node: usize,
    ends: [Pose; 2],
}

impl Gate {
    fn new(plan: &mut Plan, at: [f64; 2], ends: [Pose; 2], control: Control) -> Self {
        Self { node: plan.node_with(at, control), ends }
    }

    /// A junction that reaches equally far both ways along a straight line.
    fn straight(
        plan: &mut Plan,
        at: [f64; 2],
        along_rad: f64,
        half_m: f64,
        control: Control,
    ) -> Self {
        let along = Pose::new(at, along_rad);
        let ends = [along.reversed(), along].map(|end| end.ahead(half_m - UNEVEN_M));
        Self::new(plan, at, ends, control)
    }

    fn end(&self, which: usize) -> End {
        End::at(self.node, self.ends[which])
    }
}

/// The motorway's junctions in the order in which one comes through them from the south.
struct Gates {
    south: Gate,
    /// The cloverleaf's on the motorway from south to north.
    lower: Gate,
    upper: Gate,
    village_west: Gate,
    north: Gate,
    village_north: Gate,
    village_east: Gate,
    village_south: Gate,
    east: Gate,
    /// The cloverleaf's on the motorway from east to west.
    right: Gate,
    left: Gate,
    west: Gate,
}

impl Gates {
    fn new(plan: &mut Plan) -> Self {
        let [x, y] = CROSSING;
        let village = |plan: &mut Plan, at: [f64; 2], along_rad: f64| {
            Gate::straight(plan, at, along_rad, VILLAGE_GATE_M, Control::Yield)
        };
        let free = Control::Free;
        let pose = |x: f64, y: f64, heading_deg: f64| Pose::new([x, y], heading_deg.to_radians());
        let toward = |at: [f64; 2], bend: Bend| Pose::new(at, direction(at, bend.at));
        let south = [toward([-22.5, -314.3], SOUTH_BEND), pose(-7.9, -279.1, 73.0)];
        let north = [pose(x, 219.9, -90.0), pose(5.0, 264.3, 74.0)];
        let east = [pose(395.6, 15.5, 77.0), toward([372.2, -17.4], EAST_BEND)];
        let right = [toward([128.3, -22.2], EAST_BEND), pose(66.3, y, 180.0)];
        let gates = Self {
            south: Gate::new(plan, [-15.0, -297.0], south, free),
            lower: Gate::straight(plan, [x, -109.7], NORTH, 31.7, free),
            upper: Gate::straight(plan, [x, 73.0], NORTH, 26.0, free),
            village_west: village(plan, [x, MAIN_STREET_Y], NORTH),
            north: Gate::new(plan, [1.0, 242.0], north, free),
            village_north: village(plan, [205.0, NORTH_Y], EAST),
            village_east: village(plan, [EAST_X, MAIN_STREET_Y], SOUTH),
            village_south: village(plan, [EAST_X, 67.0], SOUTH),
            east: Gate::new(plan, [386.0, -4.0], east, free),
            right: Gate::new(plan, [97.3, y], right, free),
            left: Gate::straight(plan, [-94.2, y], WEST, 26.6, free),
            west: Gate::straight(plan, [-384.0, y], WEST, 27.0, Control::Lights),
        };
        for gate in [&gates.right, &gates.left] {
            plan.raise(plan.at(gate.node), BRIDGE_M);
        }
        gates
    }
}

/// The motorway's streets, in the order of its junctions.
fn add_motorway(plan: &mut Plan, gates: &Gates) {
    let north_east = [bend(EAST_X, NORTH_Y, 147.0)];
    let west = [bend(WEST_X, CROSSING[1], 74.0), bend(WEST_X, -420.0, 180.0), SOUTH_BEND];
    let stretches: [(&Gate, &[Bend], &Gate, Profile); 12] = [
        (&gates.south, &[], &gates.lower, MOTORWAY),
        (&gates.lower, &[], &gates.upper, MOTORWAY),
        (&gates.upper, &[], &gates.village_west, MOTORWAY),
        (&gates.village_west, &[], &gates.north, MOTORWAY),
        (&gates.north, &[], &gates.village_north, MOTORWAY),
        (&gates.village_north, &north_east, &gates.village_east, MOTORWAY),
        (&gates.village_east, &[], &gates.village_south, MOTORWAY),
        (&gates.village_south, &[], &gates.east, EAST_MOTORWAY),
        (&gates.east, &[EAST_BEND], &gates.right, EAST_MOTORWAY),
        (&gates.right, &[], &gates.left, MOTORWAY),
        (&gates.left, &[], &gates.west, MOTORWAY),
        (&gates.west, &west, &gates.south, WEST_MOTORWAY),
    ];
    for (from, bends, to, profile) in stretches {
        plan.connect(from.end(1), to.end(0), bends, profile);
    }
}

/// The cloverleaf's loops: out to the right, and around to the right.
fn add_loops(plan: &mut Plan, gates: &Gates) {
    let Gates { lower, upper, right, left, .. } = gates;
    let north_west = [bend(-122.1, 26.3, 49.0), bend(-119.0, 98.4, 55.5), bend(-48.1, 101.5, 48.5)];
    let north_east = [bend(48.1, 105.5, 54.0), bend(134.9, 105.7, 55.5), bend(133.8, 28.6, 56.0)];
    let south_east =
        [bend(131.3, -72.6, 52.0), bend(130.5, -144.7, 57.0), bend(50.3, -148.5, 54.0)];
    let south_west =
        [bend(-49.3, -148.5, 52.0), bend(-128.7, -143.1, 55.5), bend(-126.7, -69.6, 53.5)];
    let loops = [
        ((left, [-110.2, 11.4]), north_west, (upper, [-33.6, 90.0])),
        ((upper, [32.5, 91.8]), north_east, (right, [121.1, 13.1])),
        ((right, [120.9, -58.3]), south_east, (lower, [33.5, -134.2])),
        ((lower, [-32.8, -134.5]), south_west, (left, [-113.9, -54.7])),
    ];
    for ((from, start), bends, (to, end)) in loops {
        let (from, to) = ((from.node, start), (to.node, end));
        OneWay { from, bends: &bends, to, profile: LOOP }.add(plan);
    }
}

/// Short cuts for those who would else take a loop to the right.
fn add_country_roads(plan: &mut Plan, gates: &Gates) {
    plan.beside = Beside::Trees;
    let south_east = [
        bend(84.8, -230.7, 287.0),
        bend(217.8, -188.1, 500.0),
        bend(327.8, -140.6, 248.0),
        bend(388.7, -85.6, 118.0),
    ];
    let north_west = [
        bend(-43.8, 216.8, 400.0),
        bend(-94.4, 156.9, 342.0),
        bend(-221.8, 83.0, 283.0),
        bend(-369.9, 80.3, 79.5),
    ];
    let roads = [
        ((&gates.south, [23.1, -292.9]), south_east, (&gates.east, [396.2, -40.7])),
        ((&gates.north, [-35.1, 228.5]), north_west, (&gates.west, [-378.8, 11.5])),
    ];
    for ((from, start), bends, (to, end)) in roads {
        let (from, to) = ((from.node, start), (to.node, end));
        OneWay { from, bends: &bends, to, profile: COUNTRY }.add(plan);
    }
}

/// The village: where its streets cross, from north to south and from west to east.
struct Village {
    north: [[f64; 2]; 2],
    upper: [[f64; 2]; 3],
    main: [[f64; 2]; 6],
    south: [[f64; 2]; 2],
}

const VILLAGE: Village = Village {
    north: [[203.6, 309.4], [256.8, 309.4]],
    upper: [[202.1, 248.1], [256.8, 248.1], [313.4, 248.1]],
    main: [
        [60.4, MAIN_STREET_Y],
        [130.1, MAIN_STREET_Y],
        [200.3, MAIN_STREET_Y],
        [256.8, MAIN_STREET_Y],
        [312.8, MAIN_STREET_Y],
        [349.9, MAIN_STREET_Y],
    ],
    south: [[256.8, 120.0], [312.4, 120.0]],
};

fn add_village(plan: &mut Plan, gates: &Gates) {
    plan.beside = Beside::Houses { storeys: [1.0, 3.0] };
    plan.control = Control::Lights;
    let Village { north, upper, main, south } = VILLAGE;
    for unlit in [upper[1], main[2]] {
        plan.node_with(unlit, Control::Stop);
    }
    let straight = [
        (north[0], north[1]),
        (upper[0], upper[1]),
        (upper[1], upper[2]),
        (south[0], south[1]),
        (north[0], upper[0]),
        (upper[0], main[2]),
        (north[1], upper[1]),
        (upper[1], main[3]),
        (main[3], south[0]),
        (upper[2], main[4]),
        (main[4], south[1]),
    ];
    for (from, to) in straight.into_iter().chain(main.windows(2).map(|pair| (pair[0], pair[1]))) {
        let ends = [(from, direction(from, to)), (to, direction(to, from))];
        let [from, to] = ends.map(|(at, leaving_rad)| (plan.node(at), leaving_rad));
        plan.connect(from, to, &[], STREET);
    }
    add_corners(plan);
    add_ways_in(plan, gates);
}

/// The village's streets around corners.
fn add_corners(plan: &mut Plan) {
    let Village { north, upper, main, south } = VILLAGE;
    let corners: [([f64; 2], &[Bend], [f64; 2]); 6] = [
        (north[0], &[bend(119.1, 309.4, 97.0), bend(60.4, 245.0, 114.0)], main[0]),
        (upper[0], &[bend(165.7, 246.4, 54.0), bend(130.1, 213.0, 59.0)], main[1]),
        (north[1], &[bend(298.7, 309.4, 26.0), bend(313.4, 281.4, 59.0)], upper[2]),
        (main[5], &[bend(350.6, 248.1, 13.0)], upper[2]),
        (main[2], &[bend(200.3, 146.6, 31.5), bend(218.1, 120.0, 31.0)], south[0]),
        (south[1], &[bend(349.7, 120.0, 15.0)], main[5]),
    ];
    for (from, bends, to) in corners {
        let [Some(first), Some(last)] = [bends.first(), bends.last()] else { continue };
        let ends = [(from, direction(from, first.at)), (to, direction(to, last.at))];
        let [from, to] = ends.map(|(at, leaving_rad)| (plan.node(at), leaving_rad));
        plan.connect(from, to, bends, STREET);
    }
}

/// Streets from the village to the motorway around it.
fn add_ways_in(plan: &mut Plan, gates: &Gates) {
    plan.beside = Beside::Nothing;
    let Village { north, main, south, .. } = VILLAGE;
    let ways: [([f64; 2], &[Bend], &Gate); 4] = [
        (main[0], &[], &gates.village_west),
        (main[5], &[], &gates.village_east),
        (north[0], &[], &gates.village_north),
        (south[1], &[bend(312.2, 66.2, 18.5)], &gates.village_south),
    ];
    for (from, bends, gate) in ways {
        let at = plan.at(gate.node);
        let first = bends.first().map_or(at, |bend| bend.at);
        let last = bends.last().map_or(from, |bend| bend.at);
        let gate_end = Pose::new(at, direction(at, last)).ahead(VILLAGE_REACH_M);
        let node = plan.node(from);
        let from = (node, direction(from, first));
        plan.connect(from, End::at(gate.node, gate_end), bends, STREET);
    }
}

/// What background traffic of CARLA's programs asks for: three roads around the crossing between
/// the two ways into a filling station. Ours lie beside the sidewalks that meet there.
fn add_named_ways(plan: &mut Plan) {
    let at = VILLAGE.main[4];
    let node = plan.node(at);
    let ways = [
        (518, -1, [13.0, 7.8], EAST, 9.3),
        (886, 1, [13.0, 8.1], EAST, 11.3),
        (467, 1, [8.3, 13.0], NORTH, 26.3),
    ];
    for (number, lane, [east, north], heading_rad, length_m) in ways {
        let start = Pose::new([at[0] + east, at[1] + north], heading_rad);
        plan.named.push(NamedWay { number, lane, node, through: false, start, length_m });
    }
}
