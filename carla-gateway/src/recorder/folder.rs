//! Where recordings lie, and which names lead there.

use std::fs::{self, File, TryLockError};
use std::hash::{Hash, Hasher};
use std::io::BufReader;
use std::path::{Component, Path, PathBuf};

use recording::Reader;

use crate::rpc::Refusal;

/// The folder of the recordings of one tenant.
#[derive(Clone, Debug)]
pub(crate) struct RecordingFolder {
    folder: PathBuf,
    /// Whether names may lead elsewhere, as in CARLA; only for users of this machine.
    is_private: bool,
}

impl RecordingFolder {
    pub(crate) fn new(folder: PathBuf, is_private: bool) -> Self {
        Self { folder, is_private }
    }

    /// The file that a client means: names lie in the folder, also with folders before them; whole
    /// paths lead where they say, on a private server elsewhere too.
    ///
    /// # Errors
    /// A name that leads out of the folder, or that only Windows knows.
    pub(crate) fn path_of(&self, name: &str) -> Result<PathBuf, Refusal> {
        let refuse = |wanted: &str| Err(Refusal(format!("wanted {wanted}, found {name:?}")));
        if name.is_empty() || name.ends_with('/') || name.contains('\0') {
            return refuse("the name of a recording");
        }
        if name.contains('\\') || has_drive(name) {
            return refuse("a recording without \\ or a drive, as the server is no Windows");
        }
        let Some(path) = resolved(&self.folder.join(name)) else {
            return refuse("the name of a recording");
        };
        let is_inside = path.starts_with(&self.folder) && path != self.folder;
        if is_inside || (self.is_private && Path::new(name).is_absolute()) {
            return Ok(path);
        }
        refuse(&format!("a recording in {:?}", self.folder))
    }

    /// The name of a journal beside a recording, in the folder of journals: that of the recording,
    /// and for others than the first one their number. Recordings from elsewhere are told apart by
    /// where they lie.
    pub(crate) fn companion_of(&self, path: &Path, number: u32) -> String {
        let end = match number {
            ..=1 => "journal".to_owned(),
            _ => format!("{number}.journal"),
        };
        let inside = path.strip_prefix(&self.folder).ok().and_then(Path::to_str);
        if let Some(name) = inside {
            return format!("{name}.{end}");
        }
        let mut place = std::hash::DefaultHasher::new();
        path.hash(&mut place);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name: String = name.chars().filter(|letter| *letter != '\\').collect();
        format!("elsewhere/{name}-{:016x}.{end}", place.finish())
    }

    /// Where recordings lie.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// A new file for a recording; one that is a recording already is begun anew.
    ///
    /// # Errors
    /// A file that is something else or that somebody records to, and what the system refuses.
    pub(crate) fn create(&self, path: &Path) -> Result<File, Refusal> {
        let refused =
            |error: std::io::Error| Refusal(format!("cannot record to {path:?}: {error}"));
        if let Some(folder) = path.parent().filter(|_| path.starts_with(&self.folder)) {
            fs::create_dir_all(folder).map_err(refused)?;
        }
        if fs::metadata(path).is_ok_and(|file| !file.is_file() || file.len() > 0) {
            let is_recording =
                File::open(path).is_ok_and(|file| Reader::open(BufReader::new(file)).is_ok());
            if !is_recording {
                return Err(Refusal(format!(
                    "wanted a new file or a recording to replace, found {path:?}, which is neither"
                )));
            }
        }
        let file = File::options().write(true).create(true).truncate(false).open(path);
        let file = file.map_err(refused)?;
        // Held until the recording is written.
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => {
                Refusal(format!("wanted a file that nobody records to, found {path:?}"))
            }
            TryLockError::Error(error) => refused(error),
        })?;
        file.set_len(0).map_err(refused)?;
        Ok(file)
    }
}

/// Whether a path begins with a drive of Windows, as `c:/`.
fn has_drive(name: &str) -> bool {
    matches!(name.as_bytes(), [letter, b':', b'/', ..] if letter.is_ascii_alphabetic())
}

/// Without `.` and `..`, by the words alone; `None` for what leads above the root.
fn resolved(path: &Path) -> Option<PathBuf> {
    let mut resolved = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if !resolved.pop() => return None,
            Component::ParentDir => {}
            other => resolved.push(other),
        }
    }
    Some(resolved)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(is_private: bool) -> RecordingFolder {
        RecordingFolder::new(PathBuf::from("/srv/recordings/local"), is_private)
    }

    #[test]
    fn names_lie_in_the_folder() {
        for (name, path) in [
            ("a.log", "/srv/recordings/local/a.log"),
            ("./a.log", "/srv/recordings/local/a.log"),
            ("runs/7/a.log", "/srv/recordings/local/runs/7/a.log"),
            ("runs/../a.log", "/srv/recordings/local/a.log"),
            ("run 2026-11-28 05:15:19.log", "/srv/recordings/local/run 2026-11-28 05:15:19.log"),
            ("/srv/recordings/local/b.log", "/srv/recordings/local/b.log"),
        ] {
            assert_eq!(folder(false).path_of(name).unwrap(), Path::new(path));
        }
    }

    #[test]
    fn no_name_leads_to_another_tenant() {
        let elsewhere = ["../other/a.log", "runs/../../other/a.log", "/srv/recordings/other/a.log"];
        let nowhere = ["", "runs/", "c:\\records\\r.log", "c:/r.log", "..", ".", "a\0b"];
        for name in elsewhere.into_iter().chain(nowhere) {
            assert!(folder(false).path_of(name).is_err(), "{name:?}");
        }
    }

    #[test]
    fn whole_paths_lead_anywhere_on_a_private_server_only() {
        let path = "/home/carla/recording01.log";
        assert_eq!(folder(true).path_of(path).unwrap(), Path::new(path));
        assert!(folder(false).path_of(path).is_err());
        assert!(folder(true).path_of("../../etc/a.log").is_err());
    }

    #[test]
    fn nobody_records_to_a_file_that_another_records_to() {
        let name = format!("causeway-recordings-twice-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let recordings = RecordingFolder::new(folder.clone(), false);
        let path = recordings.path_of("a.log").unwrap();
        let first = recordings.create(&path).unwrap();
        let refusal = recordings.create(&path).unwrap_err();
        assert!(refusal.0.contains("nobody records to"), "{refusal}");
        drop(first);
        recordings.create(&path).unwrap();
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn journals_are_named_after_their_recordings() {
        let name = |path: &str| folder(true).companion_of(Path::new(path), 1);
        assert_eq!(name("/srv/recordings/local/runs/a.log"), "runs/a.log.journal");
        let third = folder(true).companion_of(Path::new("/srv/recordings/local/a.log"), 3);
        assert_eq!(third, "a.log.3.journal");
        let (one, other) = (name("/home/a/run.log"), name("/home/b/run.log"));
        assert!(one.starts_with("elsewhere/run.log-") && one != other, "{one} {other}");
        assert_eq!(one, name("/home/a/run.log"));
    }

    #[test]
    fn what_is_no_recording_is_never_replaced() {
        let folder =
            std::env::temp_dir().join(format!("causeway-recordings-{}", std::process::id()));
        let recordings = RecordingFolder::new(folder.clone(), false);
        let path = recordings.path_of("runs/a.log").unwrap();
        drop(recordings.create(&path).unwrap());
        drop(recordings.create(&path).unwrap());
        fs::write(&path, "notes of somebody").unwrap();
        assert!(recordings.create(&path).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"notes of somebody");
        fs::remove_dir_all(folder).unwrap();
    }
}
