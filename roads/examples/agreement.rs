//! Prints how well every map with answers of CARLA's client agrees with them, as a table.
//!
//! The maps are those of the tests: `CAUSEWAY_MAPS_DIR` names their folder. A cell says how many
//! answers were compared, and how many differ where any do; `tests/oracle/known.rs` has the
//! reasons.
#![allow(clippy::print_stdout, reason = "this is what the program is for")]

#[allow(dead_code, reason = "the worst differences stand for the check of poses")]
#[path = "../tests/oracle/checks.rs"]
mod checks;
#[path = "../tests/common/maps.rs"]
mod maps;
#[path = "../tests/oracle/signals.rs"]
mod signals;
#[path = "../tests/oracle/worst.rs"]
mod worst;

use checks::Outcome;
use maps::Judged;

/// A column and the checks that are counted in it.
type Column = (&'static str, &'static [fn(&Judged) -> Outcome]);

const COLUMNS: [Column; 6] = [
    ("lanes, neighbours, marks", &[checks::lanes, checks::neighbours, checks::lookups]),
    ("next, previous", &[checks::moving]),
    ("topology", &[checks::topology, checks::generated]),
    ("projections", &[checks::projections]),
    ("landmarks", &[signals::landmarks, signals::landmarks_ahead, signals::landmark_groups]),
    ("crosswalks, geo", &[checks::crosswalks, checks::geo]),
];

fn main() {
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    println!("| map | waypoints | position, mm | heading, µrad | {} |", names.join(" | "));
    println!("|---|---|---|---|{}", "---|".repeat(COLUMNS.len()));
    for judged in maps::all() {
        let worst = worst::worst(&judged);
        let cells: Vec<String> = COLUMNS.iter().map(|(_, checks)| cell(&judged, checks)).collect();
        println!(
            "| {} | {} | {:.2} | {:.1} | {} |",
            judged.name,
            worst.waypoints,
            worst.position_m * 1e3,
            worst.heading_rad * 1e6,
            cells.join(" | ")
        );
    }
}

fn cell(judged: &Judged, checks: &[fn(&Judged) -> Outcome]) -> String {
    let (mut asked, mut wrong) = (0, 0);
    for outcome in checks.iter().map(|check| check(judged)) {
        asked += outcome.asked;
        wrong += outcome.wrong;
    }
    match (asked, wrong) {
        (0, _) => "none".to_owned(),
        (asked, 0) => asked.to_string(),
        (asked, wrong) => format!("{asked}, {wrong} differ"),
    }
}
