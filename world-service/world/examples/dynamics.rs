//! Prints what vehicles do beside what their makers publish, as the table of docs/physics.md.
#![allow(clippy::unwrap_used, dead_code, missing_docs, reason = "an example fails loudly")]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/figures/mod.rs"]
mod figures;

fn main() {
    println!("| vehicle | manoeuvre | ours | published | error |");
    println!("|---|---|---|---|---|");
    for vehicle in figures::VEHICLES {
        for row in figures::measure(vehicle) {
            let error_percent = 100.0 * (row.measured / row.published - 1.0);
            println!(
                "| `{}` | {} | {:.2} | {:.2} | {error_percent:+.0} % |",
                vehicle.id, row.what, row.measured, row.published
            );
        }
    }
}
