//! Agreement with CARLA's client library on real and synthetic maps.
//!
//! Every map has a file of answers made by the client library. The maps are third-party and not
//! part of this repository: their folder is `CAUSEWAY_MAPS_DIR`, and without it these tests pass
//! with a message. Every check counts the answers that differ; what may differ is listed by name in
//! [`known`], each with its reason.

#[path = "oracle/checks.rs"]
mod checks;
#[path = "oracle/known.rs"]
mod known;
#[path = "common/maps.rs"]
mod maps;
#[path = "oracle/signals.rs"]
mod signals;

use checks::Outcome;
use maps::Judged;

/// Runs one check over all maps and compares the differences with the known ones.
fn judge(check: &str, run: impl Fn(&Judged) -> Outcome) {
    let mut surprises = Vec::new();
    for judged in maps::all() {
        let outcome = run(&judged);
        let allowed = known::allowed(&judged.name, check);
        println!(
            "{check}: {}: {} of {} differ (known: {allowed})",
            judged.name, outcome.wrong, outcome.asked
        );
        if outcome.wrong > allowed {
            surprises.push(format!("{}: {} {:#?}", judged.name, outcome.wrong, outcome.examples));
        }
    }
    assert!(surprises.is_empty(), "{check}:\n{}", surprises.join("\n"));
}

#[test]
fn lane_middles_lie_where_the_client_puts_them() {
    judge("pose", checks::poses);
}

#[test]
fn widths_types_and_junctions_are_the_clients() {
    judge("lane", checks::lanes);
}

#[test]
fn neighbours_marks_and_permissions_are_the_clients() {
    judge("neighbours", checks::neighbours);
}

#[test]
fn next_and_previous_lead_to_the_same_places() {
    judge("moving", checks::moving);
}

#[test]
fn lookups_by_road_lane_and_s_accept_the_same_range() {
    judge("lookup", checks::lookups);
}

#[test]
fn generated_waypoints_are_as_many() {
    judge("generate", checks::generated);
}

#[test]
fn topology_has_the_same_pairs() {
    judge("topology", checks::topology);
}

#[test]
fn projections_find_the_same_lanes() {
    judge("projection", checks::projections);
}

#[test]
fn landmarks_are_the_same_at_the_same_places() {
    judge("landmarks", signals::landmarks);
}

#[test]
fn landmarks_ahead_are_the_same_at_the_same_distances() {
    judge("landmarks ahead", signals::landmarks_ahead);
}

#[test]
fn signals_share_controllers_with_the_same_signals() {
    judge("groups", signals::landmark_groups);
}

#[test]
fn crosswalks_have_the_same_corners() {
    judge("crosswalks", checks::crosswalks);
}

#[test]
fn geographic_places_are_the_same_both_ways() {
    judge("geo", checks::geo);
}
