//! Town07: country roads over hills, with stop and yield signs, and a hamlet.

use super::course::{Bend, distance_m};
use super::plan::{Beside, Control, EAST, NORTH, Plan, SOUTH, WEST};
use super::profile::{Edge, Profile};

const COUNTRY: Profile = Profile::two_way(1, Edge::Verge, 40);
const VILLAGE: Profile = Profile::street(1, 30);
/// Roads turn with this radius where there is room, in metres.
const RADIUS_M: f64 = 45.0;

/// Junctions row by row from the south, west to east: place and height in metres. Those at the
/// corners of the map are bends.
const PLACES: [[[f64; 3]; 4]; 3] = [
    [[-270., -190., 0.], [-105., -170., 3.], [90., -205., 0.], [260., -200., 0.]],
    [[-290., 10., 5.], [-95., -20., 0.], [85., 25., 2.], [250., -15., 6.]],
    [[-280., 180., 0.], [-80., 160., 6.], [100., 190., 1.], [255., 185., 0.]],
];

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Stop, Beside::Trees);
    for (row, places) in PLACES.iter().enumerate() {
        for (column, [x, y, height_m]) in places.iter().enumerate() {
            if is_bend(row, column) {
                continue;
            }
            let control = match (row, column) {
                (1, 1) => Control::AllStop,
                (1, _) => Control::Stop,
                _ => Control::Yield,
            };
            plan.node_with([*x, *y], control);
            plan.raise([*x, *y], *height_m);
        }
    }
    for row in 0..3 {
        for column in 0..3 {
            if row == 1 || column == 1 {
                let ends = [at(row, column), at(row, column + 1)];
                let profile = if (row, column) == (1, 1) { VILLAGE } else { COUNTRY };
                wind(&mut plan, ends, [EAST, WEST], profile);
            }
        }
    }
    for row in 0..2 {
        for column in 1..3 {
            wind(&mut plan, [at(row, column), at(row + 1, column)], [NORTH, SOUTH], COUNTRY);
        }
    }
    add_corners(&mut plan);
    plan
}

fn is_bend(row: usize, column: usize) -> bool {
    row != 1 && (column == 0 || column == 3)
}

fn at(row: usize, column: usize) -> [f64; 2] {
    let [x, y, _] = PLACES[row][column];
    [x, y]
}

/// A road that leaves both junctions along the grid and slants over between them.
fn wind(plan: &mut Plan, [from, to]: [[f64; 2]; 2], leaving_rad: [f64; 2], profile: Profile) {
    let eastward = leaving_rad[0] == EAST;
    let [along, across] = if eastward { [0, 1] } else { [1, 0] };
    let aside_m = to[across] - from[across];
    let middle = (from[along] + to[along]) / 2.0;
    let slant_m = aside_m.abs().max(20.0) / 2.0;
    let place = |along_m: f64, across_m: f64| {
        if eastward { [along_m, across_m] } else { [across_m, along_m] }
    };
    let (first, second) =
        (place(middle - slant_m, from[across]), place(middle + slant_m, to[across]));
    // Both corners turn by at most 45 degrees; their tangents share the slant.
    let radius_m = RADIUS_M.min(distance_m(first, second));
    let bends = [first, second].map(|at| Bend { at, radius_m });
    let ends = (plan.node(from), plan.node(to));
    let street = plan.connect((ends.0, leaving_rad[0]), (ends.1, leaving_rad[1]), &bends, profile);
    if profile == VILLAGE {
        street.beside = Beside::Houses { storeys: [1.0, 3.0] };
    }
}

fn add_corners(plan: &mut Plan) {
    let corners = [
        ((1, 0), (2, 0), (2, 1), [NORTH, WEST]),
        ((2, 2), (2, 3), (1, 3), [EAST, NORTH]),
        ((1, 3), (0, 3), (0, 2), [SOUTH, EAST]),
        ((0, 1), (0, 0), (1, 0), [WEST, SOUTH]),
    ];
    for ((r0, c0), (r1, c1), (r2, c2), leaving_rad) in corners {
        let (from, [bend_x, bend_y], to) = (at(r0, c0), at(r1, c1), at(r2, c2));
        let ends = (plan.node(from), plan.node(to));
        // The roads leave along the grid and lean towards the corner.
        let lean = |end: [f64; 2], leaving_rad: f64| {
            if leaving_rad == EAST || leaving_rad == WEST {
                [(end[0] + bend_x) / 2.0, end[1]]
            } else {
                [end[0], (end[1] + bend_y) / 2.0]
            }
        };
        let bends = [lean(from, leaving_rad[0]), [bend_x, bend_y], lean(to, leaving_rad[1])]
            .map(|at| Bend { at, radius_m: RADIUS_M });
        let ends = ((ends.0, leaving_rad[0]), (ends.1, leaving_rad[1]));
        plan.connect(ends.0, ends.1, &bends, COUNTRY).heights = vec![[0.5, 4.0]];
    }
}
