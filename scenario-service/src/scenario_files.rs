//! The folder of scenarios' files.

use std::fs::File;
use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use crate::limits::{SCENARIO_BYTES_MAX, SCENARIO_FILES_MAX};

/// A folder with a file `<scenario name>.toml` for each scenario that is not built in, if there is
/// one. A file is read when it is asked for, so that it can come and change while the service runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct ScenarioFiles {
    folder: Option<PathBuf>,
}

/// Behind a name.
const ENDING: &str = "toml";

impl ScenarioFiles {
    /// Those of a folder.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub(crate) fn of(folder: &Path) -> std::io::Result<Self> {
        std::fs::read_dir(folder)?;
        Ok(Self { folder: Some(folder.to_owned()) })
    }

    /// Their names, in order; at most [`SCENARIO_FILES_MAX`].
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = self.folder.iter().filter_map(|folder| std::fs::read_dir(folder).ok());
        let paths = entries.flatten().filter_map(|entry| Some(entry.ok()?.path()));
        let has_ending = |path: &PathBuf| path.extension().is_some_and(|it| it == ENDING);
        let stem = |path: PathBuf| Some(path.file_stem()?.to_str()?.to_owned());
        let names = paths.filter(has_ending).filter_map(stem).filter(|name| is_name(name));
        let mut names: Vec<String> = names.take(SCENARIO_FILES_MAX).collect();
        names.sort_unstable();
        names
    }

    /// What stands in one of them; `None` where there is no such file.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub(crate) fn text(&self, name: &str) -> Result<Option<String>, String> {
        let Some(folder) = self.folder.as_ref().filter(|_| is_name(name)) else { return Ok(None) };
        let file = match File::open(folder.join(name).with_extension(ENDING)) {
            Ok(file) => file,
            Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(None),
            Err(cause) => return Err(cause.to_string()),
        };
        let mut text = String::new();
        let most = SCENARIO_BYTES_MAX as u64;
        file.take(most + 1).read_to_string(&mut text).map_err(|cause| cause.to_string())?;
        if text.len() > SCENARIO_BYTES_MAX {
            return Err(format!("wanted at most {SCENARIO_BYTES_MAX} bytes"));
        }
        Ok(Some(text))
    }
}

/// Whether a name can be that of a file: letters, digits, `_` and `-`.
fn is_name(name: &str) -> bool {
    let legal = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (1..=64).contains(&name.len()) && name.chars().all(legal)
}
