//! Town06: long motorways with four lanes each way around a small centre, and two suburbs.

use super::course::{Bend, Pose};
use super::motorway::{Motorway, TERMINAL_M};
use super::plan::{Beside, Control, EAST, Plan, WEST};
use super::profile::{Extra, Profile};

const MOTORWAY: Motorway = Motorway { lanes: 4, limit_kmh: 100 };
const STREET: Profile = Profile::street(2, 30);
/// Distance of the two motorways from the centre, in metres.
const AWAY: f64 = 220.0;
/// Half of the length of the motorways, in metres.
const LONG: f64 = 620.0;
/// The ring street of the centre.
const RING: [f64; 2] = [170.0, 85.0];
/// The suburbs' streets: half of their width, nearest and furthest from the centre, in metres.
const SUBURB: [f64; 3] = [120.0, 350.0, 440.0];

pub(super) fn plan() -> Plan {
    let mut plan = Plan::new(Control::Lights, Beside::Nothing);
    let south = Pose::new([0.0, -AWAY], EAST);
    let north = Pose::new([0.0, AWAY], WEST);
    let south = MOTORWAY.interchange(&mut plan, south, STREET, Control::Lights);
    let north = MOTORWAY.interchange(&mut plan, north, STREET, Control::Lights);
    let bend = |x: f64, y: f64| Bend { at: [x, y], radius_m: 150.0 };
    MOTORWAY.connect(&mut plan, &south, &[bend(LONG, -AWAY), bend(LONG, AWAY)], &north, &[]);
    MOTORWAY.connect(&mut plan, &north, &[bend(-LONG, AWAY), bend(-LONG, -AWAY)], &south, &[]);
    add_centre(&mut plan);
    add_suburbs(&mut plan);
    plan
}

fn add_centre(plan: &mut Plan) {
    let [x, y] = RING;
    let end = AWAY - TERMINAL_M;
    plan.beside = Beside::Houses { storeys: [2.0, 5.0] };
    plan.column(0.0, &[-end, -y, 0.0, y, end], STREET);
    plan.row(0.0, &[-x, 0.0, x], STREET.with(Extra::Parking));
    for [sign_x, sign_y] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
        let bend = Bend { at: [sign_x * x, sign_y * y], radius_m: 20.0 };
        plan.corner([sign_x * x, 0.0], bend, [0.0, sign_y * y], STREET);
    }
}

fn add_suburbs(plan: &mut Plan) {
    let [half, near, far] = SUBURB;
    plan.control = Control::Stop;
    for sign in [1.0, -1.0] {
        let mut ys = [AWAY + TERMINAL_M, near, far].map(|y| sign * y);
        ys.sort_by(f64::total_cmp);
        plan.column(0.0, &ys, STREET);
        let [near, far] = [near, far].map(|y| plan.node([0.0, sign * y]));
        for (leaving_rad, x) in [(EAST, half), (WEST, -half)] {
            let around = [SUBURB[1], SUBURB[2]].map(|y| Bend { at: [x, sign * y], radius_m: 20.0 });
            plan.connect((near, leaving_rad), (far, leaving_rad), &around, STREET);
        }
    }
}
