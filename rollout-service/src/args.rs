//! What can be typed.

use std::path::PathBuf;

/// Settings of `causeway rollout`.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Serve every client that connects to this Unix socket.
    #[arg(long, value_name = "PATH", required_unless_present = "stdin", conflicts_with = "stdin")]
    pub(crate) listen: Option<PathBuf>,
    /// Serve the one client whose socket is standard input, and end with it.
    #[arg(long)]
    pub(crate) stdin: bool,
    /// Folder of OpenDRIVE files (.xodr), which win over built-in maps of the same name.
    #[arg(long, value_name = "DIR")]
    pub(crate) maps: Option<PathBuf>,
    /// Folder of tasks (.toml), which win over built-in tasks of the same name.
    #[arg(long, value_name = "DIR")]
    pub(crate) tasks: Option<PathBuf>,
}
