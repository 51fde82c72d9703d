//! Pieces of logs and journals as files of their own.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use world_service::journal;

use super::RecordError;
use super::progress::Progress;
use super::source::{Opened, of, open};

/// Which piece.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Cut {
    /// A log of CARLA's format, or a journal
    file: PathBuf,
    /// Where the piece begins, in seconds since the beginning
    #[arg(long, value_name = "SECS", default_value_t = 0.0)]
    from: f64,
    /// Where it ends, in seconds since the beginning [default: with the recording]
    #[arg(long, value_name = "SECS", default_value_t = f64::INFINITY, hide_default_value = true)]
    until: f64,
    /// The new file; one that is there is never replaced
    #[arg(long, value_name = "FILE")]
    to: PathBuf,
}

/// # Errors
/// A file that is neither, a time that it does not have, and a new file that cannot be written.
pub(super) fn cut(order: &Cut) -> Result<(), RecordError> {
    let Cut { file, from, until, to } = order;
    let is_span = *from >= 0.0 && from <= until;
    if !is_span {
        let why = format!("wanted a time from 0 on and one after it, found {from} to {until} s");
        return Err(RecordError::Unfit { path: file.clone(), why });
    }
    let opened = open(file)?;
    let mut out = NewFile::create(to)?;
    let told = match opened {
        Opened::Log(mut reader) => {
            let mut progress = Progress::new("read", *until);
            let span = (*from, *until);
            let frames = recording::cut(&mut reader, span, &mut out, |secs| progress.reach(secs));
            let frames = frames.map_err(|cause| out.refused(cause))?;
            if frames == 0 {
                let why = format!("wanted frames from {from} s on, found none");
                return Err(RecordError::Unfit { path: file.clone(), why });
            }
            format!("{frames} frames")
        }
        Opened::Journal(mut reader) => {
            let index = reader.index();
            let total_secs = index.total_secs();
            if *from > total_secs {
                let why = format!("wanted a time up to {total_secs:.3} s, found {from} s");
                return Err(RecordError::Unfit { path: file.clone(), why });
            }
            let (first, last) = (index.tick_at(*from), index.tick_at(*until));
            let mut progress = Progress::new("written", until.min(total_secs) - from);
            let tick_secs = total_secs / (index.last().0 - index.first().0).max(1) as f64;
            let piece = journal::cut(&mut reader, (first, last), &mut out, |ticks| {
                progress.reach(ticks as f64 * tick_secs);
            });
            piece.map_err(of(file))?;
            format!("{first} to {last}")
        }
    };
    out.keep()?;
    println!("{}: {told} of {}", to.display(), file.display());
    Ok(())
}

/// A file that is there under its name only when it is whole.
pub(super) struct NewFile {
    path: PathBuf,
    part: PathBuf,
    out: BufWriter<File>,
}

impl NewFile {
    /// # Errors
    /// A file of this name, or what the system refuses.
    pub(super) fn create(path: &Path) -> Result<Self, RecordError> {
        let refused = |cause| RecordError::Write { path: path.to_owned(), cause };
        if path.exists() {
            return Err(refused(std::io::ErrorKind::AlreadyExists.into()));
        }
        let mut part = path.to_owned().into_os_string();
        part.push(".part");
        let part = PathBuf::from(part);
        let out = BufWriter::new(File::create(&part).map_err(refused)?);
        Ok(Self { path: path.to_owned(), part, out })
    }

    /// # Errors
    /// What the system refuses.
    pub(super) fn keep(mut self) -> Result<(), RecordError> {
        let kept = self.out.flush().and_then(|()| std::fs::rename(&self.part, &self.path));
        kept.map_err(|cause| self.refused(cause))
    }

    pub(super) fn refused(&self, cause: std::io::Error) -> RecordError {
        RecordError::Write { path: self.path.clone(), cause }
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        // Of a file that was kept there is no part.
        let _ = std::fs::remove_file(&self.part);
    }
}
