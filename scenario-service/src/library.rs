//! Scenarios by name: those that are built in, and those of a folder of files.

use std::fs::File;
use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use crate::limits::{SCENARIO_BYTES_MAX, SCENARIO_FILES_MAX};
use crate::scenario::described::Described;
use crate::scenario::{Profile, Scenario, ScenarioError, registry};

/// The built-in scenarios, and a folder with a file `<name>.toml` for each other one. A file is
/// read when its scenario is asked for, so that it can come and change while the service runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Library {
    folder: Option<PathBuf>,
}

/// Between a name and the folder.
const ENDING: &str = "toml";

impl Library {
    /// The built-in ones and those of a folder.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub(crate) fn with_folder(folder: &Path) -> std::io::Result<Self> {
        std::fs::read_dir(folder)?;
        Ok(Self { folder: Some(folder.to_owned()) })
    }

    /// The scenario of this name with the defaults of a profile. Built-in ones come first.
    ///
    /// # Errors
    /// [`ScenarioError::Name`] where there is none, [`ScenarioError::File`] where its file is
    /// wrong.
    pub(crate) fn build(
        &self,
        name: &str,
        profile: Profile,
    ) -> Result<Box<dyn Scenario>, ScenarioError> {
        match registry::build(name, profile) {
            Err(unknown @ ScenarioError::Name(_)) => match self.text(name)? {
                Some(text) => Ok(Box::new(Described::parse(name, profile, &text)?)),
                None => Err(unknown),
            },
            known => known,
        }
    }

    /// Whether the file that a scenario was read from says something else by now, or is gone.
    ///
    /// # Errors
    /// [`ScenarioError::File`] where it cannot be read.
    pub(crate) fn has_changed(
        &self,
        name: &str,
        scenario: &dyn Scenario,
    ) -> Result<bool, ScenarioError> {
        match scenario.file() {
            Some(text) => Ok(self.text(name)?.as_deref() != Some(text)),
            None => Ok(false),
        }
    }

    /// The names of the folder's files, in order, but for those of built-in scenarios; at most
    /// [`SCENARIO_FILES_MAX`].
    pub(crate) fn names_of_files(&self) -> Vec<String> {
        let entries = self.folder.iter().filter_map(|folder| std::fs::read_dir(folder).ok());
        let paths = entries.flatten().filter_map(|entry| Some(entry.ok()?.path()));
        let has_ending = |path: &PathBuf| path.extension().is_some_and(|it| it == ENDING);
        let stem = |path: PathBuf| Some(path.file_stem()?.to_str()?.to_owned());
        let is_new =
            |name: &String| is_name(name) && registry::build(name, Profile::Documented).is_err();
        let names = paths.filter(has_ending).filter_map(stem).filter(is_new);
        let mut names: Vec<String> = names.take(SCENARIO_FILES_MAX).collect();
        names.sort_unstable();
        names
    }

    /// What stands in a scenario's file; `None` where there is no such file.
    fn text(&self, name: &str) -> Result<Option<String>, ScenarioError> {
        let Some(folder) = self.folder.as_ref().filter(|_| is_name(name)) else { return Ok(None) };
        let wrong = |why: String| ScenarioError::File { name: name.to_owned(), why };
        let file = match File::open(folder.join(name).with_extension(ENDING)) {
            Ok(file) => file,
            Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(None),
            Err(cause) => return Err(wrong(cause.to_string())),
        };
        let mut text = String::new();
        let most = SCENARIO_BYTES_MAX as u64;
        file.take(most + 1).read_to_string(&mut text).map_err(|why| wrong(why.to_string()))?;
        if text.len() > SCENARIO_BYTES_MAX {
            return Err(wrong(format!("wanted at most {SCENARIO_BYTES_MAX} bytes")));
        }
        Ok(Some(text))
    }
}

/// Whether a name can be that of a file of the folder: letters, digits, `_` and `-`.
fn is_name(name: &str) -> bool {
    let legal = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (1..=64).contains(&name.len()) && name.chars().all(legal)
}
