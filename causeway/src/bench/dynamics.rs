//! How do our vehicles drive?
//!
//! Writes a table, plots and the runs that other models can repeat to a folder, and prints the
//! table.

use std::path::PathBuf;

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

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DynamicsError {
    /// The simulation refused or diverged.
    #[error("the vehicles could not be driven: {0}")]
    Driving(schemas::Error),
    /// The folder cannot be written.
    #[error("{path:?} cannot be written: {cause}")]
    Write {
        /// What was to be written.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
}

pub(crate) fn run(args: &Args) -> Result<(), DynamicsError> {
    let failed = |path: &PathBuf| {
        let path = path.clone();
        move |cause| DynamicsError::Write { path, cause }
    };
    std::fs::create_dir_all(&args.out).map_err(failed(&args.out))?;
    let report = manoeuvres::report().map_err(DynamicsError::Driving)?;
    let plots = report.plots.iter().map(|(name, svg)| (*name, svg.as_str()));
    let texts = [(TABLE, report.text.as_str()), (RUNS, report.runs.as_str())];
    for (name, content) in texts.into_iter().chain(plots) {
        let path = args.out.join(name);
        std::fs::write(&path, content).map_err(failed(&path))?;
    }
    println!("{}\nWritten to {}.", report.text, args.out.display());
    Ok(())
}
