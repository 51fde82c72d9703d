//! `causeway map`: work on maps without a running site.

mod build;
mod check;
mod failure;
mod list;
mod query;
mod show;
mod source;

use std::io::Write;
use std::path::Path;

use clap::Subcommand;

pub(crate) use failure::MapFailure;

/// What to do with which map.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the maps of our own and those of a folder.
    List(list::Args),
    /// Tell what is wrong with a map, and whether CARLA's client survives it; if not, exit with 1.
    Check(check::Args),
    /// Draw a map as PNG or SVG.
    Show(show::Args),
    /// Write a map of our own, or of the folder, as OpenDRIVE.
    Export(build::ExportArgs),
    /// Answer questions about many places of a map at once, for programs.
    Query(query::Args),
    /// Build a new town and write it as OpenDRIVE.
    Build(build::BuildArgs),
}

/// Does it.
///
/// # Errors
/// [`MapFailure`]; what was written before stays.
pub(crate) fn run(args: Args) -> Result<(), MapFailure> {
    match args.command {
        Command::List(args) => list::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Show(args) => show::run(&args),
        Command::Export(args) => build::export(&args),
        Command::Query(args) => query::run(&args),
        Command::Build(args) => build::build(&args),
    }
}

/// Looks whether a file can be written before anything is made for it; changes nothing.
fn want_place(path: &Path) -> Result<(), MapFailure> {
    let is_new = !path.exists();
    let opened = std::fs::OpenOptions::new().append(true).create(true).open(path);
    match opened {
        Ok(_) if is_new => std::fs::remove_file(path),
        opened => opened.map(drop),
    }
    .map_err(|cause| MapFailure::Write { path: path.to_owned(), cause })
}

/// Writes a file, or standard output without one.
fn write(path: Option<&Path>, bytes: &[u8]) -> Result<(), MapFailure> {
    match path {
        Some(path) => std::fs::write(path, bytes)
            .map_err(|cause| MapFailure::Write { path: path.to_owned(), cause }),
        None => std::io::stdout().lock().write_all(bytes).map_err(MapFailure::Output),
    }
}
