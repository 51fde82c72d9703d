//! Commands of the Python package under the name of the one command people type: policies are
//! Python, so what drives with them is too.

use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use crate::failure::Failure;

/// What follows the name of the command; the package reads it.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Args {
    /// Flags of the package's command; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    arguments: Vec<OsString>,
}

/// Becomes a module of the package, with this program as its engine.
///
/// # Errors
/// There is no Python.
pub(crate) fn run(module: &str, args: Args) -> Result<(), Failure> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let python = set("CAUSEWAY_PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(&python);
    command.arg("-m").arg(module).args(args.arguments);
    if set("CAUSEWAY_BIN").is_none()
        && let Ok(program) = std::env::current_exe()
    {
        command.env("CAUSEWAY_BIN", program);
    }
    let cause = command.exec();
    Err(Failure::usage(&NoPython { python, cause }))
}

#[derive(Debug, thiserror::Error)]
#[error(
    "cannot run {python:?} ({cause}): name the Python that has the package `causeway` with \
     CAUSEWAY_PYTHON, or have it first on the PATH"
)]
struct NoPython {
    python: OsString,
    cause: io::Error,
}
