//! Maps and tasks by name: files of a folder, then our own.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use roads::Map;
use rollouts::Task;
use schemas::{Error, ErrorCode, limits};

/// Where files of a client's own choice lie.
#[derive(Clone, Debug, Default)]
pub(crate) struct Folders {
    pub maps: Option<PathBuf>,
    pub tasks: Option<PathBuf>,
}

impl Folders {
    /// Reads a map.
    ///
    /// # Errors
    /// `UnknownMap`, or what is wrong with the file.
    pub(crate) fn map(&self, name: &str) -> Result<Arc<Map>, Error> {
        let text = match file(self.maps.as_deref(), name, "xodr") {
            Some(path) => read(&path, limits::MAP_BYTES_MAX)?,
            None => built(name)?,
        };
        let parsed = Map::parse(name, &text);
        parsed.map(Arc::new).map_err(|error| {
            let why = format!("the map {name} cannot be read: {error}");
            Error::new(ErrorCode::InvalidArgument, why)
        })
    }

    /// Reads a task.
    ///
    /// # Errors
    /// `InvalidArgument` for one that is not there, or with what is wrong with the file.
    pub(crate) fn task(&self, name: &str) -> Result<Task, Error> {
        match file(self.tasks.as_deref(), name, "toml") {
            Some(path) => Task::parse(name, &read(&path, rollouts::limits::TASK_BYTES_MAX)?),
            None => Task::named(name),
        }
    }
}

/// The file of a name, if there is one.
fn file(folder: Option<&Path>, name: &str, kind: &str) -> Option<PathBuf> {
    let path = folder.filter(|_| is_file_name(name))?.join(format!("{name}.{kind}"));
    path.is_file().then_some(path)
}

/// No part of another folder.
fn is_file_name(name: &str) -> bool {
    !name.is_empty() && !name.contains(['/', '\0']) && !name.starts_with('.')
}

fn read(path: &Path, bytes_max: usize) -> Result<String, Error> {
    let unreadable = |why: String| {
        Error::new(ErrorCode::InvalidArgument, format!("{} cannot be read: {why}", path.display()))
    };
    let size = fs::metadata(path).map_err(|error| unreadable(error.to_string()))?.len();
    if size > bytes_max as u64 {
        return Err(unreadable("it is too large".to_owned())
            .wanted(format!("at most {bytes_max} bytes"))
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
