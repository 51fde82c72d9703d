//! `causeway map list`.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::source::Folder;
use super::{MapFailure, write};

/// Whose maps.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    folder: Folder,
}

/// Prints every name with where its map comes from.
pub(super) fn run(args: &Args) -> Result<(), MapFailure> {
    let mut maps: BTreeMap<String, String> =
        roads::town::names().map(|name| (name.to_owned(), "built in".to_owned())).collect();
    for (name, path) in args.folder.files()? {
        let instead = if maps.contains_key(&name) { " instead of the built-in map" } else { "" };
        let source = format!("{}{instead}", path.display());
        maps.insert(name, source);
    }
    let width = maps.keys().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (name, source) in maps {
        // Writing to a string cannot fail.
        let _: Result<(), std::fmt::Error> = writeln!(text, "{name:width$}  {source}");
    }
    write(None, text.as_bytes())
}
