//! Opening a recording to replay it.

use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

use recording::{Index, NotARecording, Reader};

/// Bytes that are read at once.
const READ_BYTES: usize = 256 * 1024;

/// What tells whether a file is still the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Version {
    path: std::path::PathBuf,
    bytes: u64,
    changed: Option<SystemTime>,
}

/// A recording, and where its frames lie.
pub(super) struct Opened {
    pub(super) version: Version,
    pub(super) reader: Reader<BufReader<File>>,
    pub(super) index: Arc<Index>,
}

/// Why there is nothing to replay.
#[derive(Debug)]
pub(super) enum OpenError {
    Missing,
    Foreign,
    Io(io::Error),
}

/// Reads all of a recording once, to know where its frames lie, unless that is known already.
pub(super) fn open(path: &Path, known: Option<(Version, Arc<Index>)>) -> Result<Opened, OpenError> {
    let metadata = fs::metadata(path).map_err(|_| OpenError::Missing)?;
    // Opening a pipe would wait for whoever writes to it.
    if !metadata.is_file() {
        return Err(OpenError::Foreign);
    }
    let file = File::open(path).map_err(OpenError::Io)?;
    let (path, bytes) = (path.to_owned(), metadata.len());
    let version = Version { path, bytes, changed: metadata.modified().ok() };
    let mut reader = match Reader::open(BufReader::with_capacity(READ_BYTES, file)) {
        Ok(reader) => reader,
        Err(NotARecording::Foreign) => return Err(OpenError::Foreign),
        Err(NotARecording::Io(error)) => return Err(OpenError::Io(error)),
    };
    let index = match known {
        Some((same, index)) if same == version => index,
        _ => Arc::new(Index::build(&mut reader).map_err(OpenError::Io)?),
    };
    if let Some(cut) = reader.cut() {
        tracing::warn!(path = %version.path.display(), %cut, "a recording is replayed up to there");
    }
    Ok(Opened { version, reader, index })
}
