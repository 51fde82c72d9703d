//! How do our vehicles drive?
//!
//! Writes a table, plots and the runs that other models can repeat to a folder, and prints the
//! table.

use std::path::PathBuf;

use super::folder::{self, ReportError};

/// Name of the table.
const TABLE: &str = "dynamics.md";
/// Name of the steering and its answers, for `beside_commonroad.py`.
const RUNS: &str = "runs.json";

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// Folder for table and plots; made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "dynamics")]
    out: PathBuf,
}

pub(crate) fn run(args: &Args) -> Result<(), ReportError> {
    folder::make(&args.out)?;
    let report = manoeuvres::report().map_err(ReportError::Driving)?;
    let plots = report.plots.iter().map(|(name, svg)| (*name, svg.as_str()));
    let texts = [(TABLE, report.text.as_str()), (RUNS, report.runs.as_str())];
    let files: Vec<_> = texts.into_iter().chain(plots).collect();
    folder::write(&args.out, &files)?;
    println!("{}\nWritten to {}.", report.text, args.out.display());
    Ok(())
}
