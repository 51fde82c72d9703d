//! `causeway`: the one command people type.
//!
//! Every service of a site is a subcommand that runs alone; `up` starts one process of each and
//! keeps them running. This crate only parses, starts, watches and stops: what a service does is in
//! its own crate.

mod carla_flags;
mod cli;
mod failure;
mod lifeline;
mod logging;
mod router;
mod up;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match cli::Cli::parse_from(carla_flags::translated(std::env::args_os())).run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
