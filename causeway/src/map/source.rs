//! Which map is meant.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::MapFailure;

/// A map on the command line.
#[derive(Debug, clap::Args)]
pub(super) struct Which {
    /// An OpenDRIVE file, or the name of a map of the folder or of our own
    #[arg(value_name = "FILE|NAME")]
    pub(super) map: String,
    #[command(flatten)]
    pub(super) folder: Folder,
}

/// A maps folder on the command line.
#[derive(Debug, clap::Args)]
pub(super) struct Folder {
    /// Folder of OpenDRIVE files (.xodr); one with the name of a built-in map replaces it
    #[arg(long, value_name = "DIR", env = "CAUSEWAY_MAPS")]
    pub(super) maps: Option<PathBuf>,
}

/// OpenDRIVE text and the name of its map.
pub(super) struct NamedText {
    pub(super) name: String,
    pub(super) xodr: String,
}

impl Which {
    /// Finds a file, else a map of the folder, else one of our own.
    ///
    /// # Errors
    /// [`MapFailure::Unknown`] with the known names, or why the file cannot be read.
    pub(super) fn text(&self) -> Result<NamedText, MapFailure> {
        let path = Path::new(&self.map);
        if path.is_file() || path.extension().is_some_and(|end| end.eq_ignore_ascii_case("xodr")) {
            let stem = path.file_stem().unwrap_or(path.as_os_str());
            let name = stem.to_string_lossy().into_owned();
            return Ok(NamedText { name, xodr: world_service::read_map_file(path)? });
        }
        let files = self.folder.files()?;
        if let Some((name, path)) = files.iter().find(|(name, _)| *name == self.map) {
            let xodr = world_service::read_map_file(path)?;
            return Ok(NamedText { name: name.clone(), xodr });
        }
        let xodr = roads::town::build(&self.map).ok_or_else(|| self.unknown(&files))?;
        Ok(NamedText { name: self.map.clone(), xodr })
    }

    fn unknown(&self, files: &[(String, PathBuf)]) -> MapFailure {
        let mut known: BTreeSet<&str> = roads::town::names().collect();
        known.extend(files.iter().map(|(name, _)| name.as_str()));
        let known = known.into_iter().collect::<Vec<_>>().join(", ");
        MapFailure::Unknown { name: self.map.clone(), known }
    }
}

impl Folder {
    /// Names and paths of the folder's maps; none without a folder.
    ///
    /// # Errors
    /// A folder that cannot be listed.
    pub(super) fn files(&self) -> Result<Vec<(String, PathBuf)>, MapFailure> {
        Ok(self.maps.as_deref().map_or_else(|| Ok(Vec::new()), world_service::map_files)?)
    }
}
