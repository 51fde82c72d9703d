//! How does our traffic flow?
//!
//! Writes a table and plots of flow and speed over density to a folder, and prints the table.

use std::path::PathBuf;

use super::folder::{self, ReportError};

/// Name of the table.
const TABLE: &str = "traffic.md";

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// Folder for table and plots; made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "traffic")]
    out: PathBuf,
}

pub(crate) fn run(args: &Args) -> Result<(), ReportError> {
    folder::make(&args.out)?;
    let report = manoeuvres::traffic().map_err(ReportError::Driving)?;
    let plots = report.plots.iter().map(|(name, svg)| (*name, svg.as_str()));
    let files: Vec<_> = [(TABLE, report.text.as_str())].into_iter().chain(plots).collect();
    folder::write(&args.out, &files)?;
    println!("{}\nWritten to {}.", report.text, args.out.display());
    Ok(())
}
