//! A folder of texts and plots that a bench leaves behind.

use std::path::{Path, PathBuf};

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReportError {
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

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_path_buf();
    move |cause| ReportError::Write { path, cause }
}

/// Makes the folder if it is not there, before anything is driven for it.
///
/// # Errors
/// What the system says.
pub(crate) fn make(out: &Path) -> Result<(), ReportError> {
    std::fs::create_dir_all(out).map_err(failed(out))
}

/// Writes files by name and content.
///
/// # Errors
/// What the system says.
pub(crate) fn write(out: &Path, files: &[(&str, &str)]) -> Result<(), ReportError> {
    for (name, content) in files {
        let path = out.join(name);
        std::fs::write(&path, content).map_err(failed(&path))?;
    }
    Ok(())
}
