//! Whether what settings name is there.

use std::collections::BTreeSet;
use std::path::Path;

use super::plan::PlanError;

/// Whether a folder can be read.
pub(super) fn check_folder(setting: &'static str, path: &Path) -> Result<(), PlanError> {
    match std::fs::read_dir(path) {
        Ok(_) => Ok(()),
        Err(cause) => Err(PlanError::Folder { setting, path: path.to_owned(), cause }),
    }
}

/// Whether a folder is there or can be made.
pub(super) fn check_new_folder(setting: &'static str, path: &Path) -> Result<(), PlanError> {
    path.ancestors().find(|at| at.exists()).map_or(Ok(()), |at| check_folder(setting, at))
}

/// Whether there is a map of this name, in the folder or of our own.
pub(super) fn check_map(name: &str, folder: Option<&Path>) -> Result<(), PlanError> {
    let own = roads::town::names().map(str::to_owned);
    let files = folder.and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten();
    let paths = files.flatten().map(|entry| entry.path());
    let named = paths.filter(|path| path.extension().is_some_and(|it| it == "xodr"));
    let stems = named.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()));
    let known: BTreeSet<String> = own.chain(stems).collect();
    if carla_gateway::is_among(name, known.iter().map(String::as_str)) {
        return Ok(());
    }
    let known = known.into_iter().collect::<Vec<_>>().join(", ");
    Err(PlanError::NoMap { name: name.to_owned(), known })
}
