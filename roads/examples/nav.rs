//! Writes the walkers' mesh of a map as the file CARLA's client library loads:
//! `nav Town03 FOLDER` for a generated town, `nav PATH.xodr FOLDER` for any map. Prints the path of
//! the file in the folder. A third word cuts it into that many tiles along each side.
#![allow(clippy::print_stdout, reason = "this is what the program is for")]

use std::io;
use std::path::Path;

use roads::nav::{NavMesh, detour};
use roads::{Map, town};

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, folder, per_side) = match arguments.as_slice() {
        [name, folder] => (name, folder, None),
        [name, folder, tiles] => (name, folder, Some(tiles.parse().map_err(io::Error::other)?)),
        _ => return Err(io::Error::other("wanted: TOWN_OR_FILE FOLDER [TILES_PER_SIDE]")),
    };
    let (name, text) = match town::build(name) {
        Some(text) => (name.clone(), text),
        None => {
            let stem = Path::new(name).file_stem().unwrap_or_default();
            (stem.to_string_lossy().into_owned(), std::fs::read_to_string(name)?)
        }
    };
    let map = Map::parse(&name, &text).map_err(io::Error::other)?;
    let mesh = NavMesh::new(&map).map_err(io::Error::other)?;
    let bytes = match per_side {
        None => detour::file(&mesh),
        Some(per_side) => detour::file_in_tiles(&mesh, per_side),
    };
    let bytes = bytes.map_err(io::Error::other)?;
    let path = detour::file_name(&name, &bytes);
    let full = Path::new(folder).join(&path);
    std::fs::create_dir_all(full.parent().unwrap_or(Path::new(folder)))?;
    std::fs::write(full, bytes)?;
    println!("{path}");
    Ok(())
}
