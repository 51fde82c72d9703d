//! `causeway map check`.

use std::fmt::Write;

use roads::{Map, Report, Severity};

use super::source::Which;
use super::{MapFailure, write};

/// Which map to check.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    which: Which,
}

/// Prints every fault, what it does, what drivers may want to know, and the verdict.
pub(super) fn run(args: &Args) -> Result<(), MapFailure> {
    let source = args.which.text()?;
    let (faults, notes, size) = match Map::parse(&source.name, &source.xodr) {
        Ok(map) => (map.check(), map.corners(), Some(size(&map))),
        Err(refused) => {
            let faults = Report { diagnostics: refused.diagnostics, count: refused.count };
            (faults, Report::default(), None)
        }
    };
    let survives = !faults.diagnostics.iter().any(|one| one.severity.breaks_client());
    let text = told(&faults, &notes, size.as_deref(), survives);
    write(None, text.as_bytes())?;
    if survives { Ok(()) } else { Err(MapFailure::BreaksClient { name: source.name }) }
}

fn told(faults: &Report, notes: &Report, size: Option<&str>, survives: bool) -> String {
    let mut text = String::new();
    let mut line = |words: std::fmt::Arguments<'_>| {
        // Writing to a string cannot fail.
        let _: Result<(), std::fmt::Error> = writeln!(text, "{words}");
    };
    for (report, what) in [(faults, "faults"), (notes, "notes")] {
        for diagnostic in &report.diagnostics {
            line(format_args!("{}: {diagnostic}", word(diagnostic.severity)));
        }
        let untold = report.count - report.diagnostics.len();
        if untold > 0 {
            line(format_args!("and {untold} more {what}"));
        }
    }
    let size = size.unwrap_or("no map can be made of it");
    let several = |count: usize| if count == 1 { "" } else { "s" };
    let (faults, notes) = (faults.count, notes.count);
    let found = format!("{faults} fault{}, {notes} note{}", several(faults), several(notes));
    line(format_args!("{size}; {found}"));
    let verdict = if survives { "survives" } else { "does not survive" };
    line(format_args!("CARLA's client {verdict} this map"));
    text
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "note",
        Severity::Suspicious => "suspicious",
        Severity::BreaksClient => "breaks CARLA's client",
        Severity::Refused => "refused",
    }
}

fn size(map: &Map) -> String {
    let metres = map.generate_waypoints(1.0);
    format!(
        "{} driving-lane metres, {} landmarks, {} crosswalks, {} spawn points",
        metres.map_or_else(|_| "millions of".to_owned(), |places| places.len().to_string()),
        map.landmarks().len(),
        map.crosswalks().len(),
        map.spawn_points().len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_told_with_its_place_and_its_weight() {
        let text = "<OpenDRIVE><road id=\"7\" length=\"-1\" junction=\"-1\"/></OpenDRIVE>";
        let refused = Map::parse("broken", text).unwrap_err();
        let faults = Report { diagnostics: refused.diagnostics, count: 9 };
        let told = told(&faults, &Report::default(), None, false);
        assert!(
            told.contains("refused: road 7: wanted a length above 0 m, found \"-1\""),
            "{told}"
        );
        assert!(told.contains("more") && told.contains("does not survive"), "{told}");
        assert!(told.contains("no map can be made of it; 9 faults, 0 notes"), "{told}");
        let faults = Report { count: 1, ..faults };
        let told = super::told(&faults, &Report::default(), None, false);
        assert!(told.contains("; 1 fault, 0 notes"), "{told}");
    }
}
