//! Recordings of CARLA's format: what they say, without a site.

use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use recording::query::{self, Letter, QueryError};
use recording::{Cut, NotARecording, Reader};

use super::source::{Opened, log as open, open as open_any};
use super::{RecordError, journal};

/// What a recording is about.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Info {
    /// A log of CARLA's format, or a journal
    file: PathBuf,
    /// Everything that a log says of every frame
    #[arg(long)]
    all: bool,
}

/// A question about one recording; the answers are those of CARLA's calls.
#[derive(Clone, Debug, clap::Subcommand)]
pub(crate) enum Question {
    /// List who met whom in a recording of CARLA's format.
    Collisions {
        /// Its file
        file: PathBuf,
        /// Kinds of both sides: h hero, v vehicle, w walker, t traffic light, o other, a any
        #[arg(long, value_name = "TWO LETTERS", default_value = "aa", value_parser = letters)]
        types: Letters,
    },
    /// List who stood still in a recording of CARLA's format, longest first.
    Blocked {
        /// Its file
        file: PathBuf,
        /// For at least so many seconds
        #[arg(long, value_name = "SECS", default_value_t = 30.0)]
        time: f64,
        /// Within so many centimetres
        #[arg(long, value_name = "CM", default_value_t = 100.0)]
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
pub(crate) fn ask(question: &Question) -> Result<(), LogError> {
    let (Question::Collisions { file, .. } | Question::Blocked { file, .. }) = question;
    let date = &carla_gateway::local_date;
    let mut reader = open(file)?;
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

/// Prints what a log or a journal is about.
pub(crate) fn info(Info { file, all }: &Info) -> Result<(), RecordError> {
    let mut reader = match open_any(file)? {
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

/// Prints how much a recording has.
pub(super) fn verify<R: Read>(file: &Path, mut reader: Reader<R>) -> Result<(), LogError> {
    let last = query::last_frame(&mut reader).map_err(QueryError::from)?;
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
