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

/// Becomes the module named first among its arguments, if Python has the package.
const RUN: &str = r#"
import importlib.util, runpy, sys
module = sys.argv.pop(1)
try:
    found = importlib.util.find_spec(module)
except ModuleNotFoundError as error:
    # A folder that is named like the package counts as one, without its modules.
    if error.name.split(".")[0] != "causeway":
        raise
    found = None
if found is None:
    print(
        f"causeway: {sys.executable} has no module {module}: install agents/python there, or name "
        "a Python that has it with CAUSEWAY_PYTHON",
        file=sys.stderr,
    )
    sys.exit(2)
runpy.run_module(module, run_name="__main__", alter_sys=True)
"#;

/// Becomes a module of the package, with this program as its engine.
///
/// # Errors
/// There is no Python.
pub(crate) fn run(module: &str, args: Args) -> Result<(), Failure> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let python = set("CAUSEWAY_PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(&python);
    command.args(["-c", RUN, module]).args(args.arguments);
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
