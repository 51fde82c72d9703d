//! `causeway`: the one command people type.
//!
//! Every service of a site is a subcommand that runs alone; `up` starts one process of each and
//! keeps them running. `map` works on files and answers at once. This crate only parses, starts,
//! watches and stops: what a service does, and what a map is, is in its own crate.

mod audit;
mod bench;
mod carla_flags;
mod cli;
mod environment;
mod failure;
mod health;
mod lifeline;
mod log_pace;
mod logging;
mod map;
mod no_display;
mod numbers;
mod open_files;
mod outlet;
mod python;
mod record;
mod router;
mod token;
mod up;
mod watched;

use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _};

fn main() -> ExitCode {
    carla_flags::take_name(std::env::args_os());
    let command = environment::with_values(cli::Cli::command());
    let line = carla_flags::translated(std::env::args_os(), &command);
    let given = command.try_get_matches_from(line).unwrap_or_else(|wrong| numbers::refuse(&wrong));
    let cli = cli::Cli::from_arg_matches(&given).unwrap_or_else(|wrong| wrong.exit());
    match cli.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
