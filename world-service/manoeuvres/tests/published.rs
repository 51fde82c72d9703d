//! Goal: vehicles drive as published. Method: the manoeuvres of the report, with bounds.

use manoeuvres::{Aids, VEHICLES, dwell, measure, split_stop, turn_stop};

#[test]
fn published_figures_are_met_within_their_tolerance() {
    for known in &VEHICLES {
        for row in measure(known).unwrap() {
            let error = row.measured / row.published - 1.0;
            assert!(error.abs() <= row.tolerance, "{}: {row:?}", known.id);
        }
    }
}

const CARS: [&str; 2] = ["vehicle.mini.cooper_s", "vehicle.audi.tt"];
const KMH_80: f32 = 80.0 / 3.6;

#[test]
fn cars_pass_fmvss_126_with_stability_control_and_not_without() {
    for id in CARS {
        let with = dwell(id, Aids::BOTH, KMH_80).unwrap();
        assert_eq!(with.stable_to, 6.5, "{id}: {with:?}");
        assert!(with.beside_m >= 1.83, "{id}: {with:?}");
        let without = dwell(id, Aids::ANTI_LOCK, KMH_80).unwrap();
        assert!(without.stable_to < 5.0, "{id}: {without:?}");
    }
}

#[test]
fn cars_brake_in_a_turn_without_a_swing_and_without_anti_lock_go_straight_on() {
    for id in CARS {
        let with = turn_stop(id, Aids::BOTH).unwrap();
        assert!((0.7..1.3).contains(&with.yaw_share) && with.slip_deg < 6.0, "{id}: {with:?}");
        let locked = turn_stop(id, Aids::NONE).unwrap();
        assert!(locked.yaw_share.abs() < 0.7, "{id}: {locked:?}");
    }
}

#[test]
fn cars_brake_on_two_frictions_as_un_r13_h_wants_with_anti_lock_and_not_without() {
    for id in CARS {
        let with = split_stop(id, Aids::BOTH).unwrap();
        assert!(with.passes(), "{id}: {with:?}");
        let without = split_stop(id, Aids::NONE).unwrap();
        assert!(!without.passes(), "{id}: {without:?}");
    }
}
