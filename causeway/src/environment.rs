//! Variables of the environment: one that is set but empty is not set. Compose and systemd hand on
//! empty ones for what nobody has named.

use clap::builder::{OsStr, Resettable};
use clap::{Arg, Command};

/// The same command, in which no flag takes an empty variable for its value.
pub(crate) fn without_empty(command: Command) -> Command {
    command.mut_args(unless_empty).mut_subcommands(without_empty)
}

fn unless_empty(arg: Arg) -> Arg {
    let value = arg.get_env().and_then(std::env::var_os);
    match value {
        Some(value) if value.is_empty() => arg.env(Resettable::<OsStr>::Reset),
        _ => arg,
    }
}
