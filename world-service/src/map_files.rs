//! A folder of OpenDRIVE files.

use std::fs;
use std::path::{Path, PathBuf};

use schemas::limits::MAP_BYTES_MAX;
use schemas::{Error, ErrorCode};

/// Files of one maps folder that are looked at.
const MAPS_MAX: usize = 1_024;

/// Names and paths of the `.xodr` files of a folder, ordered by name. The name is the file's stem.
///
/// # Errors
/// A folder that cannot be listed, or holds more than 1,024 maps.
pub fn map_files(folder: &Path) -> Result<Vec<(String, PathBuf)>, Error> {
    let unusable = |cause: std::io::Error| {
        Error::new(ErrorCode::InvalidArgument, format!("cannot list the maps folder {folder:?}"))
            .found(cause)
    };
    let mut found = Vec::new();
    for file in fs::read_dir(folder).map_err(unusable)? {
        let path = file.map_err(unusable)?.path();
        let is_map =
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xodr"));
        let name = path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned);
        if let (true, Some(name)) = (is_map, name) {
            found.push((name, path));
        }
        if found.len() > MAPS_MAX {
            return Err(Error::new(ErrorCode::Capacity, format!("too many maps in {folder:?}"))
                .wanted(format_args!("at most {MAPS_MAX}")));
        }
    }
    found.sort();
    Ok(found)
}

/// The text of an OpenDRIVE file. Bytes that are no UTF-8 are taken as Latin-1, which some
/// exporters write into names and comments.
///
/// # Errors
/// A file that cannot be read, or is larger than any map may be.
pub fn read_map_file(path: &Path) -> Result<String, Error> {
    let unusable = |cause: std::io::Error| {
        Error::new(ErrorCode::UnknownMap, format!("cannot read the map file {path:?}")).found(cause)
    };
    let size_bytes = fs::metadata(path).map_err(unusable)?.len();
    if size_bytes > MAP_BYTES_MAX as u64 {
        return Err(Error::new(ErrorCode::TooLarge, format!("the map file {path:?} is too large"))
            .wanted(format_args!("at most {MAP_BYTES_MAX} bytes"))
            .found(format_args!("{size_bytes} bytes")));
    }
    let bytes = fs::read(path).map_err(unusable)?;
    Ok(String::from_utf8(bytes).unwrap_or_else(|not_utf8| {
        not_utf8.as_bytes().iter().map(|byte| char::from(*byte)).collect()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_in_latin_1_is_read() {
        let path = std::env::temp_dir().join(format!("causeway-latin-{}.xodr", std::process::id()));
        fs::write(&path, b"<OpenDRIVE name=\"M\xfcnchen\"/>").unwrap();
        let text = read_map_file(&path);
        fs::remove_file(&path).unwrap();
        assert_eq!(text.unwrap(), "<OpenDRIVE name=\"M\u{fc}nchen\"/>");
    }
}
