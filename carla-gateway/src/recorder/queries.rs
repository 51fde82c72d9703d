//! What clients ask about recordings.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use recording::query::{self, Letter, QueryError};
#[cfg(test)]
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;

use super::scribe::Written;
use crate::archive::{self, Known, OpenError, Prepared};
use crate::rpc::{Answer, Payload, Refusal};

/// Longest answer, in bytes: a text that is cut would be misread.
const TEXT_BYTES_MAX: usize = 64 * 1024 * 1024;

/// Questions that are answered or wait for that.
const QUESTIONS_MAX: usize = 64;
/// Recordings that are opened to be replayed, or are open and not replayed yet; each takes up to
/// some 100 MB.
const OPENINGS_MAX: usize = 4;
/// Recordings that are read at once.
const READERS_MAX: usize = 2;

/// One question about a recording.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Question {
    /// What it says, all of it or only what happens to actors.
    Info {
        /// All of it.
        is_all: bool,
    },
    /// Who met whom.
    Collisions([Letter; 2]),
    /// Who stood for so many seconds within so many centimetres.
    Blocked {
        /// At least.
        min_secs: f64,
        /// Less than.
        min_cm: f64,
    },
}

/// Where recordings are read, away from the calls.
#[derive(Clone, Debug)]
pub(super) struct RecordingReader {
    seats: Arc<Semaphore>,
    openings: Arc<Semaphore>,
    readers: Arc<Semaphore>,
}

impl Default for RecordingReader {
    fn default() -> Self {
        let limits = [QUESTIONS_MAX, OPENINGS_MAX, READERS_MAX];
        let [seats, openings, readers] = limits.map(|count| Arc::new(Semaphore::new(count)));
        Self { seats, openings, readers }
    }
}

impl RecordingReader {
    /// Answers in CARLA's words, also for files that are missing or no recordings, when what is
    /// still being written is written. A file that cannot be read, and an answer that is too long,
    /// are refused.
    ///
    /// # Errors
    /// Too many questions wait.
    pub(super) fn ask(
        &self,
        path: PathBuf,
        endings: Vec<Written>,
        question: Question,
    ) -> Result<JoinHandle<Answer>, Refusal> {
        let seat = Arc::clone(&self.seats).try_acquire_owned().map_err(|_| {
            let limit = QUESTIONS_MAX;
            Refusal(format!(
                "wanted at most {limit} questions about recordings at once, found more"
            ))
        })?;
        let readers = Arc::clone(&self.readers);
        Ok(tokio::spawn(async move {
            for written in endings {
                written.wait().await;
            }
            let reader = readers.acquire_owned().await;
            let told = tokio::task::spawn_blocking(move || answer(&path, question)).await;
            drop((reader, seat));
            Payload::value(&told.map_err(|error| Refusal(error.to_string()))??)
        }))
    }

    /// Opens a recording when what is still being written is written; where its frames lie takes a
    /// while to find out, unless it is known.
    ///
    /// # Errors
    /// Too many are opened.
    pub(super) fn open(
        &self,
        path: PathBuf,
        endings: Vec<Written>,
        known: Option<Known>,
    ) -> Result<JoinHandle<Prepared>, Refusal> {
        let place = Arc::clone(&self.openings).try_acquire_owned().map_err(|_| {
            let limit = OPENINGS_MAX;
            Refusal(format!("wanted at most {limit} recordings to be opened at once, found more"))
        })?;
        let readers = Arc::clone(&self.readers);
        Ok(tokio::spawn(async move {
            for written in endings {
                written.wait().await;
            }
            let reader = readers.acquire_owned().await;
            let opening = move || archive::open_indexed(&path, known).map(Box::new);
            let opened = tokio::task::spawn_blocking(opening).await;
            drop(reader);
            let opened = opened.unwrap_or_else(|error| Err(io::Error::other(error).into()));
            Prepared { opened, _place: place }
        }))
    }

    #[cfg(test)]
    pub(super) async fn hold(&self) -> OwnedSemaphorePermit {
        let readers = Arc::clone(&self.readers);
        readers.acquire_many_owned(READERS_MAX as u32).await.expect("it is never closed")
    }
}

fn answer(path: &Path, question: Question) -> Result<String, Refusal> {
    let told = path.display();
    let mut reader = match archive::open(path) {
        Ok(reader) => reader,
        Err(OpenError::Foreign) => return Ok("File is not a CARLA recorder\n".to_owned()),
        Err(OpenError::Missing | OpenError::Io(_)) => {
            return Ok(format!("File {told} not found on server\n"));
        }
    };
    let mut text = Text(Vec::new());
    let (date, out) = (&local_date, &mut text);
    let asked = match question {
        Question::Info { is_all } => query::file_info(&mut reader, is_all, date, out),
        Question::Collisions(wanted) => query::collisions(&mut reader, wanted, date, out),
        Question::Blocked { min_secs, min_cm } => {
            query::actors_blocked(&mut reader, min_secs, min_cm, date, out)
        }
    };
    if let Some(cut) = reader.cut() {
        tracing::warn!(path = %told, %cut, "a recording is told up to its last whole frame");
    }
    asked.map_err(|error| match error {
        QueryError::Io(error) => Refusal(format!("recording {told}: {error}")),
        error => Refusal(format!("recording {told}: {error}; causeway record reads it too")),
    })?;
    Ok(String::from_utf8_lossy(&text.0).into_owned())
}

/// Seconds since 1970 as CARLA writes dates: in the time zone of this machine.
pub fn local_date(secs: i64) -> String {
    let time = jiff::Timestamp::from_second(secs).unwrap_or_default();
    let local = time.to_zoned(jiff::tz::TimeZone::system());
    local.strftime("%m/%d/%y %H:%M:%S").to_string()
}

/// A text that does not grow beyond its limit.
struct Text(Vec<u8>);

impl Write for Text {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.len() + bytes.len() > TEXT_BYTES_MAX {
            return Err(io::Error::other(format!(
                "wanted an answer of at most {TEXT_BYTES_MAX} bytes, found more; ask without \
                 details, or have `causeway record info` print it"
            )));
        }
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
