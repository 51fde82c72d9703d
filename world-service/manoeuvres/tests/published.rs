//! Goal: vehicles drive as published. Method: the manoeuvres of the report, with bounds.

use manoeuvres::{VEHICLES, measure};

#[test]
fn published_figures_are_met_within_their_tolerance() {
    for known in &VEHICLES {
        for row in measure(known).unwrap() {
            let error = row.measured / row.published - 1.0;
            assert!(error.abs() <= row.tolerance, "{}: {row:?}", known.id);
        }
    }
}
