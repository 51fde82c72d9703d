//! `causeway map show`.

use std::path::PathBuf;

use resvg::{tiny_skia, usvg};
use roads::{Map, picture};

use super::source::Which;
use super::{MapFailure, want_place, write};

/// Which map to draw, and where.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    which: Which,
    /// The picture: a file ending in .png or .svg
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Width of the picture in pixels
    #[arg(long, default_value_t = 1600, value_parser = clap::value_parser!(u32).range(200..=10_000))]
    width: u32,
}

/// Draws the map.
pub(super) fn run(args: &Args) -> Result<(), MapFailure> {
    let ends_in =
        |wanted: &str| args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    if !ends_in("png") && !ends_in("svg") {
        return Err(MapFailure::Format { path: args.out.clone() });
    }
    want_place(&args.out)?;
    let source = args.which.text()?;
    let map = Map::parse(&source.name, &source.xodr)?;
    let svg = picture::draw(&map, args.width);
    let bytes = if ends_in("svg") { svg.into_bytes() } else { png(&svg, args.width)? };
    write(Some(&args.out), &bytes)
}

fn png(svg: &str, width_px: u32) -> Result<Vec<u8>, MapFailure> {
    let fails = |cause: String| MapFailure::Pixels { width_px, cause };
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())
        .map_err(|cause| fails(cause.to_string()))?;
    let size = tree.size().to_int_size();
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())
        .ok_or_else(|| fails("there is not enough memory".to_owned()))?;
    resvg::render(&tree, tiny_skia::Transform::identity(), &mut pixels.as_mut());
    pixels.encode_png().map_err(|cause| fails(cause.to_string()))
}
