//! Recordings on disk that are opened: to be asked, and to be replayed.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use recording::{Index, NotARecording, Reader};
use tokio::sync::OwnedSemaphorePermit;

/// Bytes that are read at once.
const READ_BYTES: usize = 256 * 1024;

/// The frames of a file.
pub(crate) type FileReader = Reader<BufReader<File>>;

/// What tells whether a file is still the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Version {
    path: PathBuf,
    bytes: u64,
    changed: Option<SystemTime>,
}

/// Where the frames of one version of a file lie.
pub(crate) type Known = (Version, Arc<Index>);

/// A recording, and where its frames lie.
pub(crate) struct Opened {
    pub(crate) version: Version,
    pub(crate) reader: FileReader,
    pub(crate) index: Arc<Index>,
}

/// Why there is no recording.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    #[error("there is no such file")]
    Missing,
    #[error("it is no recording")]
    Foreign,
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A recording that was opened for a call, or why there is none; and the place that it takes among
/// those that are opened.
pub(crate) struct Prepared {
    pub(crate) opened: Result<Box<Opened>, OpenError>,
    pub(crate) _place: OwnedSemaphorePermit,
}

impl fmt::Debug for Prepared {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let version = self.opened.as_ref().map(|opened| &opened.version);
        out.debug_tuple("Prepared").field(&version).finish()
    }
}

/// Reads the head of a recording.
///
/// # Errors
/// [`OpenError`].
pub(crate) fn open(path: &Path) -> Result<FileReader, OpenError> {
    opened(path).map(|(_, reader)| reader)
}

/// Reads all of a recording once, to know where its frames lie, unless that is known already.
///
/// # Errors
/// [`OpenError`].
pub(crate) fn open_indexed(path: &Path, known: Option<Known>) -> Result<Opened, OpenError> {
    let (version, mut reader) = opened(path)?;
    let index = match known {
        Some((same, index)) if same == version => index,
        _ => Arc::new(Index::build(&mut reader)?),
    };
    if let Some(cut) = reader.cut() {
        tracing::warn!(path = %version.path.display(), %cut, "a recording is replayed up to there");
    }
    Ok(Opened { version, reader, index })
}

fn opened(path: &Path) -> Result<(Version, FileReader), OpenError> {
    let metadata = fs::metadata(path).map_err(|_| OpenError::Missing)?;
    // Opening a pipe would wait for whoever writes to it.
    if !metadata.is_file() {
        return Err(OpenError::Foreign);
    }
    let file = File::open(path)?;
    let (path, bytes) = (path.to_owned(), metadata.len());
    let version = Version { path, bytes, changed: metadata.modified().ok() };
    match Reader::open(BufReader::with_capacity(READ_BYTES, file)) {
        Ok(reader) => Ok((version, reader)),
        Err(NotARecording::Foreign) => Err(OpenError::Foreign),
        Err(NotARecording::Io(error)) => Err(OpenError::Io(error)),
    }
}
