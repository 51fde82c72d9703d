//! Maps by name: files of a folder, then our own towns.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use roads::Map;
use schemas::{Error, ErrorCode, limits};

/// Reads a map.
///
/// # Errors
/// `UnknownMap`, or what is wrong with the file.
pub(crate) fn map(folder: Option<&Path>, name: &str) -> Result<Arc<Map>, Error> {
    let file = folder.filter(|_| is_file_name(name)).map(|it| it.join(format!("{name}.xodr")));
    let text = match file.filter(|path| path.is_file()) {
        Some(path) => read(&path)?,
        None => built(name)?,
    };
    let parsed = Map::parse(name, &text);
    parsed.map(Arc::new).map_err(|error| {
        Error::new(ErrorCode::InvalidArgument, format!("the map {name} cannot be read: {error}"))
    })
}

/// No part of another folder.
fn is_file_name(name: &str) -> bool {
    !name.is_empty() && !name.contains(['/', '\0']) && !name.starts_with('.')
}

fn read(path: &Path) -> Result<String, Error> {
    let unreadable = |why: String| {
        Error::new(ErrorCode::InvalidArgument, format!("{} cannot be read: {why}", path.display()))
    };
    let size = fs::metadata(path).map_err(|error| unreadable(error.to_string()))?.len();
    if size > limits::MAP_BYTES_MAX as u64 {
        return Err(unreadable("it is too large".to_owned())
            .wanted(format!("at most {} bytes", limits::MAP_BYTES_MAX))
            .found(size));
    }
    fs::read_to_string(path).map_err(|error| unreadable(error.to_string()))
}

fn built(name: &str) -> Result<String, Error> {
    roads::town::build(name).ok_or_else(|| {
        let names: Vec<&str> = roads::town::names().collect();
        Error::new(ErrorCode::UnknownMap, "no such map").wanted(names.join(", ")).found(name)
    })
}
