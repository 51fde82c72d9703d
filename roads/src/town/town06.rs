//! Town06: a motorway of four and five lanes around two rows of the same kind, all of them one-way
//! roads that ramps connect, and a road across them that turns back at both ends. Its roads lie
//! where CARLA's do, so that places that programs name by coordinates are on the road.

use super::course::{Bend, Pose, direction};
use super::one_way::OneWay;
use super::plan::{Beside, Control, End, Plan};
use super::profile::{Edge, LANE_M, Profile};

type Place = [f64; 2];

/// Lanes of the widest carriageways.
const LANES: i32 = 5;
/// Limit on straight carriageways, and around bends.
const LIMIT_KMH: u32 = 100;
const BEND_LIMIT_KMH: u32 = 50;
const RAMP: Profile = Profile::one_way(1, Edge::Verge, 50);
const NARROW_RAMP: Profile = Profile::one_way(1, Edge::Verge, 40);
/// From a row to one of the opposite direction.
const LINK: Profile = Profile::one_way(2, Edge::Verge, 40);
/// Width of the strip between the directions of the road across, in metres.
const MEDIAN_M: f64 = 4.5;
const ACROSS: Profile = across(3);
const ACROSS_NARROW: Profile = across(2);
/// Where the road across turns back.
const TURN: Profile = Profile::one_way(3, Edge::Verge, 20);

/// Junctions with the road across, from south to north; its directions part at the first and the
/// last, and meet again in the bends of its turns.
const SOUTH_TURN: Place = [2.0, -350.0];
const SOUTH_CROSSING: Place = [1.3, -245.0];
const LOWER_CROSSING: Place = [-0.5, -142.0];
const MIDDLE_CROSSING: Place = [-1.8, -46.0];
const NORTH_CROSSING: Place = [-1.4, 17.0];
const NORTH_TURN: Place = [-0.9, 101.0];
const SOUTH_BEND: Place = [0.5, -405.0];
const NORTH_BEND: Place = [0.5, 144.0];
/// Those of the carriageway in the south, as traffic drives them.
const SOUTH_JOIN: Place = [-226.0, -241.0];
const SOUTH_LEFT: Place = [-101.0, -241.0];
const SOUTH_RAMP: Place = [100.7, -244.0];
const SOUTH_EAST: Place = [589.7, -244.0];
/// The ring's in the east.
const LOWER_END: Place = [663.0, -142.0];
const MIDDLE_END: Place = [664.0, -43.0];
/// Those of the carriageway in the north.
const NORTH_JOIN: Place = [509.0, 17.0];
const NORTH_LIGHTS: Place = [139.8, 16.0];
const NORTH_WIDER: Place = [-48.0, 16.0];
const NORTH_LEFT: Place = [-142.0, 15.0];
/// Those of the carriageway from west to east between both.
const MIDDLE_LIGHTS: Place = [-145.0, -46.0];
const MIDDLE_WIDER: Place = [44.6, -46.0];
const MIDDLE_LEFT: Place = [138.0, -46.0];
const MIDDLE_RAMP: Place = [241.0, -46.0];
const MIDDLE_WIDER_EAST: Place = [305.0, -46.0];
const MIDDLE_LEFT_EAST: Place = [497.0, -46.0];
const MIDDLE_RAMP_EAST: Place = [536.0, -46.0];
/// Those of the carriageway below, which leads from the road across to the east and to the west.
const LOWER_LEFT: Place = [95.0, -143.0];
const LOWER_RAMP: Place = [211.0, -144.0];
const LOWER_LEFT_EAST: Place = [475.0, -145.0];
const LOWER_JOIN: Place = [-104.0, -143.0];
const LOWER_LEFT_WEST: Place = [-222.0, -143.0];

const NORTH: Row = Row { from: [555.0, 8.8], to: [-230.0, 6.4] };
const MIDDLE: Row = Row { from: [-200.0, -36.6], to: [650.0, -36.6] };
const LOWER_EAST: Row = Row { from: [21.7, -134.3], to: [641.3, -136.8] };
const LOWER_WEST: Row = Row { from: [-20.0, -151.0], to: [-280.0, -151.0] };
const SOUTH_WEST: Row = Row { from: [-300.0, -234.7], to: [-20.0, -234.7] };
const SOUTH: Row = Row { from: [20.0, -235.9], to: [600.0, -235.9] };
const EAST: Row = Row { from: [655.9, -178.5], to: [657.1, -68.5] };
/// The middle of the road across in the north.
const ACROSS_NORTH: Row = Row { from: [-1.7, -27.6], to: [-0.9, 97.5] };

const fn across(lanes: i32) -> Profile {
    Profile::two_way(lanes, Edge::Sidewalk, 60).divided(MEDIAN_M)
}

const fn motorway(lanes: i32, limit_kmh: u32) -> Profile {
    Profile::one_way(lanes, Edge::HardShoulder, limit_kmh)
}

const fn bend(x: f64, y: f64, radius_m: f64) -> Bend {
    Bend { at: [x, y], radius_m }
}

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Free, Beside::Nothing);
    for at in [SOUTH_CROSSING, MIDDLE_CROSSING, NORTH_CROSSING] {
        plan.node_with(at, Control::Lights);
    }
    for at in [LOWER_END, MIDDLE_END, NORTH_LIGHTS, MIDDLE_LIGHTS] {
        plan.node_with(at, Control::Lights);
    }
    add_rows(&mut plan);
    add_bends(&mut plan);
    add_ramps(&mut plan);
    add_across(&mut plan);
    plan
}

/// A straight line along which traffic drives: the left border of five lanes.
struct Row {
    from: Place,
    to: Place,
}

impl Row {
    /// Left border of the outer lanes, where the row comes to this x; to this y, if it leads from
    /// south to north.
    fn at(&self, along: f64, lanes: i32) -> Place {
        let axis =
            usize::from((self.to[0] - self.from[0]).abs() < (self.to[1] - self.from[1]).abs());
        let share = (along - self.from[axis]) / (self.to[axis] - self.from[axis]);
        let at = [0, 1].map(|k| self.from[k] + share * (self.to[k] - self.from[k]));
        let right_m = f64::from(LANES - lanes) * LANE_M;
        Pose::new(at, direction(self.from, self.to)).left(-right_m).at
    }
}

/// The straight carriageways: on which row, between which junctions, where they begin and end, and
/// how many lanes they have.
const STRAIGHT: [(&Row, [Place; 2], [f64; 2], i32); 23] = [
    (&NORTH, [NORTH_JOIN, NORTH_LIGHTS], [491.8, 154.5], 5),
    (&NORTH, [NORTH_LIGHTS, NORTH_CROSSING], [125.2, 25.1], 5),
    (&NORTH, [NORTH_CROSSING, NORTH_WIDER], [-22.8, -29.6], 4),
    (&NORTH, [NORTH_WIDER, NORTH_LEFT], [-66.4, -127.7], 5),
    (&MIDDLE, [MIDDLE_LIGHTS, MIDDLE_CROSSING], [-129.2, -24.6], 4),
    (&MIDDLE, [MIDDLE_CROSSING, MIDDLE_WIDER], [16.8, 26.2], 4),
    (&MIDDLE, [MIDDLE_WIDER, MIDDLE_LEFT], [63.0, 123.9], 5),
    (&MIDDLE, [MIDDLE_LEFT, MIDDLE_RAMP], [152.2, 218.8], 4),
    (&MIDDLE, [MIDDLE_RAMP, MIDDLE_WIDER_EAST], [264.2, 282.3], 4),
    (&MIDDLE, [MIDDLE_WIDER_EAST, MIDDLE_LEFT_EAST], [328.0, 480.3], 5),
    (&MIDDLE, [MIDDLE_LEFT_EAST, MIDDLE_RAMP_EAST], [514.0, 520.2], 5),
    (&MIDDLE, [MIDDLE_RAMP_EAST, MIDDLE_END], [551.1, 646.9], 5),
    (&LOWER_EAST, [LOWER_CROSSING, LOWER_LEFT], [21.7, 62.3], 5),
    (&LOWER_EAST, [LOWER_LEFT, LOWER_RAMP], [128.0, 181.8], 5),
    (&LOWER_EAST, [LOWER_RAMP, LOWER_LEFT_EAST], [240.3, 452.6], 5),
    (&LOWER_EAST, [LOWER_LEFT_EAST, LOWER_END], [497.3, 641.3], 5),
    (&LOWER_WEST, [LOWER_CROSSING, LOWER_JOIN], [-22.1, -82.8], 4),
    (&LOWER_WEST, [LOWER_JOIN, LOWER_LEFT_WEST], [-124.9, -205.8], 5),
    (&SOUTH_WEST, [SOUTH_JOIN, SOUTH_LEFT], [-207.2, -122.3], 5),
    (&SOUTH_WEST, [SOUTH_LEFT, SOUTH_CROSSING], [-79.7, -21.0], 4),
    (&SOUTH, [SOUTH_CROSSING, SOUTH_RAMP], [22.4, 72.8], 5),
    (&SOUTH, [SOUTH_RAMP, SOUTH_EAST], [128.5, 583.3], 5),
    (&EAST, [LOWER_END, MIDDLE_END], [-120.3, -65.5], 5),
];

fn add_rows(plan: &mut Plan) {
    for (row, junctions, along, lanes) in STRAIGHT {
        let [from, to] = [0, 1].map(|k| (plan.node(junctions[k]), row.at(along[k], lanes)));
        let profile = motorway(lanes, LIMIT_KMH);
        OneWay { from, bends: &[], to, profile }.add(plan);
    }
}

/// The carriageways around bends: the ring's in the south-east, the north-east and the west, and
/// the one in the west that leads from row to row.
fn add_bends(plan: &mut Plan) {
    let on = |row: &Row, along: f64, lanes: i32, radius_m: f64| Bend {
        at: row.at(along, lanes),
        radius_m,
    };
    let south_east = [on(&SOUTH, 619.0, LANES, 85.5), on(&EAST, -218.8, LANES, 31.0)];
    let north_east = [bend(650.7, -24.6, 104.5), on(&NORTH, 641.0, LANES, 40.5)];
    let west = [
        on(&NORTH, -293.8, 4, 125.5),
        bend(-358.8, -33.6, 63.5),
        bend(-357.1, -225.5, 34.0),
        on(&SOUTH_WEST, -319.9, 4, 62.5),
    ];
    let between = [
        on(&LOWER_WEST, -339.2, 4, 51.0),
        bend(-314.8, -45.7, 53.5),
        on(&MIDDLE, -214.9, 4, 743.5),
    ];
    let ends = [
        ((SOUTH_EAST, SOUTH.at(595.9, LANES)), (LOWER_END, EAST.at(-168.5, LANES))),
        ((MIDDLE_END, [651.7, -27.6]), (NORTH_JOIN, NORTH.at(527.6, LANES))),
        ((NORTH_LEFT, NORTH.at(-155.7, 4)), (SOUTH_JOIN, SOUTH_WEST.at(-245.4, 4))),
        ((LOWER_LEFT_WEST, LOWER_WEST.at(-239.4, 4)), (MIDDLE_LIGHTS, MIDDLE.at(-161.1, 4))),
    ];
    let bends: [(&[Bend], i32); 4] =
        [(&south_east, LANES), (&north_east, LANES), (&west, 4), (&between, 4)];
    for ((from, to), (bends, lanes)) in ends.into_iter().zip(bends) {
        let [from, to] = [from, to].map(|(junction, at)| (plan.node(junction), at));
        OneWay { from, bends, to, profile: motorway(lanes, BEND_LIMIT_KMH) }.add(plan);
    }
}

/// A road from one carriageway to another: between which junctions, from where to where.
type Ramp = ([Place; 2], [Place; 2], &'static [Bend], Profile);

const RAMPS: [Ramp; 8] = [
    (
        [NORTH_LEFT, MIDDLE_LIGHTS],
        [[-146.4, -3.9], [-149.8, -15.9]],
        &[bend(-149.6, -8.9, 21.0)],
        LINK,
    ),
    (
        [MIDDLE_LEFT, NORTH_LIGHTS],
        [[140.4, -14.1], [139.5, -4.3]],
        &[bend(140.5, -9.5, 43.0)],
        LINK,
    ),
    (
        [MIDDLE_LEFT_EAST, NORTH_JOIN],
        [[512.9, -23.2], [517.3, -1.2]],
        &[bend(521.4, -13.4, 21.5)],
        NARROW_RAMP,
    ),
    (
        [LOWER_LEFT, MIDDLE_RAMP],
        [[124.5, -119.9], [216.7, -60.0]],
        &[bend(152.1, -108.4, 223.5), bend(210.1, -63.5, 54.5)],
        RAMP,
    ),
    (
        [LOWER_LEFT_EAST, MIDDLE_RAMP_EAST],
        [[490.7, -122.7], [521.4, -64.4]],
        &[bend(496.9, -116.7, 42.5), bend(517.3, -71.2, 83.5)],
        RAMP,
    ),
    (
        [SOUTH_RAMP, LOWER_RAMP],
        [[123.0, -222.0], [184.7, -163.5]],
        &[bend(136.7, -211.8, 130.0), bend(169.9, -173.2, 125.0)],
        RAMP,
    ),
    (
        [LOWER_LEFT_WEST, SOUTH_JOIN],
        [[-234.0, -161.1], [-238.1, -223.9]],
        &[bend(-245.3, -170.0, 29.0), bend(-246.0, -214.4, 31.0)],
        NARROW_RAMP,
    ),
    (
        [SOUTH_LEFT, LOWER_JOIN],
        [[-86.4, -224.5], [-88.7, -161.6]],
        &[bend(-74.9, -213.2, 36.5), bend(-75.7, -172.4, 36.5)],
        NARROW_RAMP,
    ),
];

fn add_ramps(plan: &mut Plan) {
    plan.beside = Beside::Trees;
    for (junctions, ends, bends, profile) in RAMPS {
        let [from, to] = [0, 1].map(|k| (plan.node(junctions[k]), ends[k]));
        OneWay { from, bends, to, profile }.add(plan);
    }
}

/// The road across, from south to north.
fn add_across(plan: &mut Plan) {
    plan.beside = Beside::Houses { storeys: [1.0, 3.0] };
    let [middle, narrow_end, north, north_end] =
        [-27.6, -0.5, 34.9, 95.1].map(|y| ACROSS_NORTH.at(y, LANES));
    let stretches = [
        ((SOUTH_TURN, [1.9, -342.8]), (SOUTH_CROSSING, [1.8, -263.1]), ACROSS),
        ((SOUTH_CROSSING, [1.0, -227.6]), (LOWER_CROSSING, [0.2, -158.4]), ACROSS),
        ((LOWER_CROSSING, [-1.2, -125.3]), (MIDDLE_CROSSING, [-1.9, -64.5]), ACROSS),
        ((MIDDLE_CROSSING, middle), (NORTH_CROSSING, narrow_end), ACROSS_NARROW),
        ((NORTH_CROSSING, north), (NORTH_TURN, north_end), ACROSS),
    ];
    for ((from, start), (to, end), profile) in stretches {
        let along_rad = direction(start, end);
        let from = End::at(plan.node(from), Pose::new(start, along_rad));
        let to = End::at(plan.node(to), Pose::new(end, along_rad).reversed());
        plan.connect(from, to, &[], profile);
    }
    add_turns(plan);
}

/// The turns at the ends of the road across. The tight bend of each is a junction: a road that
/// leads back into the junction where it begins has no neighbours in CARLA's client.
fn add_turns(plan: &mut Plan) {
    plan.beside = Beside::Trees;
    let turns = [
        (
            [NORTH_TURN, NORTH_BEND],
            ([1.6, 107.6], bend(1.8, 113.4, 33.5), [7.9, 133.7]),
            ([-7.5, 133.8], bend(-3.3, 114.6, 52.5), [-3.1, 108.0]),
        ),
        (
            [SOUTH_TURN, SOUTH_BEND],
            ([-1.1, -355.7], bend(-1.6, -371.8, 98.0), [-8.7, -391.5]),
            ([10.2, -392.0], bend(5.7, -372.6, 120.0), [4.6, -361.2]),
        ),
    ];
    for (junctions, there, back) in turns {
        let [junction, turn] = junctions.map(|at| plan.node(at));
        for ((from, to), (start, bend, end)) in
            [((junction, turn), there), ((turn, junction), back)]
        {
            OneWay { from: (from, start), bends: &[bend], to: (to, end), profile: TURN }.add(plan);
        }
    }
}
