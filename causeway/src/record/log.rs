//! Recordings of CARLA's format: what they say, without a site.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use recording::query::{self, Letter, QueryError};
use recording::{Cut, NotARecording, Reader};
use world_service::journal::Reader as JournalReader;

use super::played::heroes_of;
use super::source::{Opened, open};
use super::translated::Translated;
use super::{RecordError, journal};
use crate::numbers;

/// What a recording is about.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Info {
    /// A log of CARLA's format, or a journal
    file: PathBuf,
    /// Everything that a log says of every frame
    #[arg(long)]
    all: bool,
}

/// A question about a log or a journal; the answers are those of CARLA's calls. A log has the
/// contacts of those who carry a collision sensor, a journal those of all.
#[derive(Clone, Debug, clap::Subcommand)]
pub(crate) enum Question {
    /// List who met whom in a log or a journal.
    Collisions {
        /// Its file
        file: PathBuf,
        /// Kinds of both sides: h hero, v vehicle, w walker, t traffic light, o other, a any
        #[arg(long, value_name = "TWO LETTERS", default_value = "aa", value_parser = letters)]
        types: Letters,
    },
    /// List who stood still in a log or a journal, longest first.
    Blocked {
        /// Its file
        file: PathBuf,
        /// For at least so many seconds
        #[arg(long, value_name = "SECS", default_value_t = 30.0, value_parser = numbers::from_zero)]
        time: f64,
        /// Within so many centimetres
        #[arg(long, value_name = "CM", default_value_t = 100.0, value_parser = numbers::from_zero)]
        distance: f64,
    },
}

/// Which kinds of actors meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Letters([Letter; 2]);

fn letters(text: &str) -> Result<Letters, String> {
    let chars: Vec<char> = text.chars().collect();
    match chars[..] {
        [first, second] if chars.iter().all(|letter| "hvwtoa".contains(*letter)) => {
            Ok(Letters([Letter(first), Letter(second)]))
        }
        _ => Err("wanted two of the letters h, v, w, t, o, a".to_owned()),
    }
}

/// Why a recording says nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LogError {
    /// It is none.
    #[error("{path:?}: {cause}")]
    Open {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: NotARecording,
    },
    /// No answer.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// It was told, but not to its end.
    #[error("{path:?}: {cut}")]
    Cut {
        /// Which.
        path: PathBuf,
        /// Where and why.
        cut: Cut,
    },
}

/// Prints the answer; a recording that is cut is told up to there, and then an error.
pub(super) fn ask(question: &Question) -> Result<(), RecordError> {
    let (Question::Collisions { file, .. } | Question::Blocked { file, .. }) = question;
    match open(file)? {
        Opened::Log(reader) => Ok(answer(question, file, reader)?),
        Opened::Journal(reader) => {
            let translated = translated(file, *reader)?;
            let open = |cause| LogError::Open { path: file.clone(), cause };
            Ok(answer(question, file, Reader::open(translated).map_err(open)?)?)
        }
    }
}

fn answer<R: Read>(
    question: &Question,
    file: &Path,
    mut reader: Reader<R>,
) -> Result<(), LogError> {
    let date = &carla_gateway::local_date;
    let mut out = BufWriter::new(io::stdout().lock());
    let asked = match question {
        Question::Collisions { types, .. } => {
            query::collisions(&mut reader, types.0, date, &mut out)
        }
        Question::Blocked { time, distance, .. } => {
            query::actors_blocked(&mut reader, *time, *distance, date, &mut out)
        }
    };
    finish(file, &reader, asked.and_then(|()| Ok(out.flush()?)))
}

/// A journal as a log, of the date of its file.
fn translated(
    path: &Path,
    mut reader: JournalReader<BufReader<File>>,
) -> Result<Translated, RecordError> {
    let refused = |cause| RecordError::Open { path: path.to_owned(), cause };
    let heroes = heroes_of(path, &mut reader)?;
    let changed = std::fs::metadata(path).and_then(|file| file.modified()).map_err(refused)?;
    let date = changed.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs();
    Translated::begin(reader, date as i64, heroes).map_err(refused)
}

/// Prints what a log or a journal is about.
pub(crate) fn info(Info { file, all }: &Info) -> Result<(), RecordError> {
    let mut reader = match open(file)? {
        Opened::Log(reader) => reader,
        Opened::Journal(reader) => {
            journal::info(file, &reader);
            return Ok(());
        }
    };
    let mut out = BufWriter::new(io::stdout().lock());
    let asked = query::file_info(&mut reader, *all, &carla_gateway::local_date, &mut out);
    Ok(finish(file, &reader, asked.and_then(|()| Ok(out.flush()?)))?)
}

fn finish<R: Read>(
    file: &Path,
    reader: &Reader<R>,
    asked: Result<(), QueryError>,
) -> Result<(), LogError> {
    match asked {
        // Whoever reads has read enough, as `head` does.
        Err(QueryError::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(error.into()),
        Ok(()) => whole(file, reader),
    }
}

/// Reads every packet of a recording and prints how much it has, up to where it is damaged.
pub(super) fn verify<R: Read>(file: &Path, mut reader: Reader<R>) -> Result<(), LogError> {
    let last = recording::check(&mut reader).map_err(QueryError::from)?;
    let (number, secs) = last.map_or((0, 0.0), |last| (last.number, last.elapsed_secs));
    let (version, map) = (reader.header().version, &reader.header().map);
    println!("{}: {number} frames, {secs:.3} s on {map}, version {version}", file.display());
    whole(file, &reader)
}

fn whole<R: Read>(file: &Path, reader: &Reader<R>) -> Result<(), LogError> {
    match reader.cut() {
        Some(cut) => Err(LogError::Cut { path: file.to_owned(), cut: cut.clone() }),
        None => Ok(()),
    }
}
