//! What holds for the flags of all commands. A variable of the environment that is set but empty is
//! not set: compose and systemd hand on empty ones for what nobody has named. A negative number is
//! a value, so that whoever reads it says what was wanted.

use clap::builder::{OsStr, Resettable};
use clap::{Arg, Command};

/// The same command, in which no flag takes an empty variable for its value and each takes a
/// negative number for one.
pub(crate) fn with_values(command: Command) -> Command {
    command.mut_args(|arg| negative_too(unless_empty(arg))).mut_subcommands(with_values)
}

fn negative_too(arg: Arg) -> Arg {
    let is_read = arg.get_long().is_some() && arg.get_action().takes_values();
    arg.allow_negative_numbers(is_read)
}

fn unless_empty(arg: Arg) -> Arg {
    let value = arg.get_env().and_then(std::env::var_os);
    match value {
        Some(value) if value.is_empty() => arg.env(Resettable::<OsStr>::Reset),
        _ => arg,
    }
}
