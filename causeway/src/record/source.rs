//! Which kind of recording a file is.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek};
use std::path::{Path, PathBuf};

use recording::{NotARecording, Reader as LogReader};
use world_service::journal::{JournalError, Reader as JournalReader};

use super::RecordError;
use super::log::LogError;

/// Bytes that are read at once.
const READ_BYTES: usize = 256 * 1024;
/// What a journal begins with.
const JOURNAL_MAGIC: [u8; 4] = *b"CWJL";

/// One file.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Source {
    /// A log of CARLA's format, or a journal
    pub(super) file: PathBuf,
}

/// A file that was opened.
pub(super) enum Opened {
    Log(LogReader<BufReader<File>>),
    Journal(Box<JournalReader<BufReader<File>>>),
}

/// # Errors
/// No such file, or one that is neither.
pub(super) fn open(path: &Path) -> Result<Opened, RecordError> {
    if is_journal(path)? {
        return open_journal(path).map(|reader| Opened::Journal(Box::new(reader)));
    }
    match log(path) {
        Ok(reader) => Ok(Opened::Log(reader)),
        Err(LogError::Open { cause: NotARecording::Foreign, .. }) => {
            Err(RecordError::Foreign { path: path.to_owned() })
        }
        Err(error) => Err(error.into()),
    }
}

/// A log, to be asked.
///
/// # Errors
/// No such file, or one that is no log.
pub(super) fn log(path: &Path) -> Result<LogReader<BufReader<File>>, LogError> {
    let opened = File::open(path).map_err(NotARecording::Io);
    let opened =
        opened.and_then(|file| LogReader::open(BufReader::with_capacity(READ_BYTES, file)));
    opened.map_err(|cause| LogError::Open { path: path.to_owned(), cause })
}

/// A journal, in any order.
///
/// # Errors
/// No such file, or one that is no journal.
pub(super) fn open_journal(path: &Path) -> Result<JournalReader<BufReader<File>>, RecordError> {
    JournalReader::open(file(path)?).map_err(of(path))
}

/// A file to be read from its beginning.
///
/// # Errors
/// No such file.
pub(super) fn file(path: &Path) -> Result<BufReader<File>, RecordError> {
    let opened = File::open(path);
    let opened = opened.map_err(|cause| RecordError::Open { path: path.to_owned(), cause })?;
    Ok(BufReader::with_capacity(READ_BYTES, opened))
}

/// The error of a journal with its path.
pub(super) fn of(path: &Path) -> impl Fn(JournalError) -> RecordError {
    move |cause| RecordError::Journal { path: path.to_owned(), cause }
}

fn is_journal(path: &Path) -> Result<bool, RecordError> {
    let mut file = file(path)?;
    let mut magic = [0; JOURNAL_MAGIC.len()];
    match file.read_exact(&mut magic).and_then(|()| file.rewind()) {
        Ok(()) => Ok(magic == JOURNAL_MAGIC),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(cause) => Err(RecordError::Open { path: path.to_owned(), cause }),
    }
}
