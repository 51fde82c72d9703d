//! `causeway bench`: what a user waits for, and what a user relies on.

mod dynamics;
mod folder;
mod pictures;
mod roads;
mod start;
mod traffic;

use crate::failure::Failure;

/// What to measure.
#[derive(Clone, Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// From `causeway up` to the first answered reset, and what that time is made of.
    Start(start::Args),
    /// What vehicles do on a test track, with plots, beside what is published of real ones.
    Dynamics(dynamics::Args),
    /// How traffic flows on a ring road over its density, with plots, beside its model.
    Traffic(traffic::Args),
    /// Who leaves the road on any map: our drivers, a table of maps.
    Roads(roads::Args),
    /// Pictures a second of every kind, size and quality, by any adapter.
    Pictures(pictures::Args),
}

/// # Errors
/// What could not be measured.
pub(crate) fn run(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Start(args) => start::run(args).map_err(|error| Failure::of(&error)),
        Command::Dynamics(args) => dynamics::run(args).map_err(|error| Failure::of(&error)),
        Command::Roads(args) => roads::run(args).map_err(|error| Failure::of(&error)),
        Command::Pictures(args) => pictures::run(args).map_err(|error| Failure::of(&error)),
        Command::Traffic(args) => traffic::run(args).map_err(|error| Failure::of(&error)),
    }
}
