//! Town10HD: a dense inner city of 400 by 400 m: a ring street, cross streets, and an avenue from
//! west to east whose western half is 218 m without a junction.

use super::course::Bend;
use super::plan::{Beside, Block, Control, LandUse, Plan};
use super::profile::Profile;

const WEST: f64 = -200.0;
const MIDDLE_WEST: f64 = -70.0;
const MIDDLE_EAST: f64 = 60.0;
const EAST: f64 = 200.0;
const NORTH: f64 = 200.0;
const SOUTH: f64 = -200.0;
const ROWS: [f64; 3] = [-100.0, 0.0, 100.0];

const STREET: Profile = Profile::street(2, 30);
const AVENUE: Profile = Profile::street(3, 30);
/// Radius of the middle line where the ring street turns, in metres. The block inside keeps its
/// corner, for the sidewalk turns with 7.5 m there.
const CORNER_RADIUS_M: f64 = 18.0;

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Nothing);
    plan.row(0.0, &[WEST, MIDDLE_EAST, EAST], AVENUE);
    plan.row(100.0, &[WEST, MIDDLE_WEST, MIDDLE_EAST, EAST], STREET);
    plan.row(-100.0, &[WEST, MIDDLE_WEST, MIDDLE_EAST, EAST], STREET);
    plan.row(NORTH, &[MIDDLE_WEST, MIDDLE_EAST], STREET);
    plan.row(SOUTH, &[MIDDLE_WEST, MIDDLE_EAST], STREET);
    plan.column(WEST, &ROWS, STREET);
    plan.column(EAST, &ROWS, STREET);
    plan.column(MIDDLE_WEST, &[SOUTH, -100.0], STREET);
    plan.column(MIDDLE_WEST, &[100.0, NORTH], STREET);
    plan.column(MIDDLE_EAST, &[SOUTH, -100.0, 0.0, 100.0, NORTH], STREET);
    let corners = [
        ([WEST, 100.0], [WEST, NORTH], [MIDDLE_WEST, NORTH]),
        ([MIDDLE_EAST, NORTH], [EAST, NORTH], [EAST, 100.0]),
        ([EAST, -100.0], [EAST, SOUTH], [MIDDLE_EAST, SOUTH]),
        ([MIDDLE_WEST, SOUTH], [WEST, SOUTH], [WEST, -100.0]),
    ];
    for (from, at, to) in corners {
        plan.corner(from, Bend { at, radius_m: CORNER_RADIUS_M }, to, STREET);
    }
    add_blocks(&mut plan);
    plan
}

fn add_blocks(plan: &mut Plan) {
    /// Land of a block begins this far outside the sidewalk's edge: corners are rounded.
    const GAP_M: f64 = 0.1;
    let side = |profile: Profile| profile.width_m(1) + GAP_M;
    let street = side(STREET);
    // A street row is given by its y and by how far its land keeps away from it.
    let rows =
        [(SOUTH, street), (-100.0, street), (0.0, side(AVENUE)), (100.0, street), (NORTH, street)];
    for (index, pair) in rows.windows(2).enumerate() {
        let [(y0, gap0), (y1, gap1)] = pair else { continue };
        let beside_avenue = index == 1 || index == 2;
        let columns: &[(f64, f64)] = if beside_avenue {
            &[(WEST, MIDDLE_EAST), (MIDDLE_EAST, EAST)]
        } else {
            &[(WEST, MIDDLE_WEST), (MIDDLE_WEST, MIDDLE_EAST), (MIDDLE_EAST, EAST)]
        };
        for (column, (x0, x1)) in columns.iter().enumerate() {
            let is_park = column == 1 && (index == 0 || index == 2);
            plan.blocks.push(Block {
                min: [x0 + street, y0 + gap0],
                max: [x1 - street, y1 - gap1],
                use_of_land: if is_park { LandUse::Park } else { LandUse::Houses },
            });
        }
    }
    let (near, far, along) = (EAST + street, EAST + street + 24.0, 160.0);
    let outside = [
        ([near, -along], [far, along]),
        ([-along, near], [along, far]),
        ([-far, -along], [-near, along]),
        ([-along, -far], [along, -near]),
    ];
    plan.blocks.extend(outside.map(|(min, max)| Block { min, max, use_of_land: LandUse::Row }));
}
