//! `causeway map build` and `causeway map export`.

use std::path::PathBuf;

use clap::ValueEnum;
use roads::Map;

use super::source::Which;
use super::{MapFailure, write};

/// What a new town is like.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Style {
    /// Streets with two lanes each way, an avenue with three, traffic lights
    City,
    /// Streets with one lane each way, some with parked cars, stop signs and lights
    Village,
    /// Country roads over hills, stop and yield signs
    Country,
}

/// A new town.
#[derive(Debug, clap::Args)]
pub(super) struct BuildArgs {
    /// What it is like
    #[arg(long)]
    style: Style,
    /// Any number; the same number gives the same town
    #[arg(long)]
    seed: u64,
    /// Blocks along each side, 2 to 10
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(2..=10))]
    blocks: u8,
    /// Where to write the OpenDRIVE text [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// A town we have.
#[derive(Debug, clap::Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    which: Which,
    /// Where to write the OpenDRIVE text [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Builds a town, reads it back, and writes it.
pub(super) fn build(args: &BuildArgs) -> Result<(), MapFailure> {
    let style = match args.style {
        Style::City => roads::town::Style::City,
        Style::Village => roads::town::Style::Village,
        Style::Country => roads::town::Style::Country,
    };
    let xodr = roads::town::build_styled(style, args.seed, args.blocks.into());
    let map = Map::parse("new", &xodr)?;
    write(args.out.as_deref(), xodr.as_bytes())?;
    if let Some(path) = &args.out {
        println!("{}: {} spawn points", path.display(), map.spawn_points().len());
    }
    Ok(())
}

/// Writes a known map as it is.
pub(super) fn export(args: &ExportArgs) -> Result<(), MapFailure> {
    write(args.out.as_deref(), args.which.text()?.xodr.as_bytes())
}
