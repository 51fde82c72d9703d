//! What CARLA's clients ask about a log, answered in CARLA's words: programs take these texts
//! apart, space by space.
//!
//! Each answer goes line by line to a sink, so that memory does not grow with the log; a sink that
//! refuses ends the query. A log that is cut is told up to its last whole frame; where that is, the
//! reader knows ([`Reader::cut`](crate::Reader::cut)), and the text does not say.

mod blocked;
mod collisions;
mod info;
mod names;
mod number;
mod physics;

use std::io::{self, Read, Write};

use crate::header::Header;
use crate::reader::Reader;
use crate::record::FrameStart;
pub use blocked::actors_blocked;
pub use collisions::{Letter, collisions};
pub use info::file_info;
pub use number::Number;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// The log cannot be read, or the sink refuses.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// What has to be kept in mind is too much.
    #[error("wanted a recording of at most {limit} {what}, found more")]
    TooLarge {
        /// Of what.
        what: &'static str,
        /// How many.
        limit: usize,
    },
}

/// Seconds since 1970 as text: `%m/%d/%y %H:%M:%S` in the time zone of the server.
pub type LocalDate<'a> = &'a dyn Fn(i64) -> String;

/// What every answer begins with.
fn write_head(out: &mut impl Write, header: &Header, date: LocalDate<'_>) -> io::Result<()> {
    let Header { version, map, .. } = header;
    writeln!(out, "Version: {version}\nMap: {map}\nDate: {}\n", date(header.date))
}

/// What every answer ends with.
fn write_foot(out: &mut impl Write, last: &Last, is_whole_secs: bool) -> io::Result<()> {
    writeln!(out, "\nFrames: {}", last.number)?;
    if is_whole_secs {
        writeln!(out, "Duration: {:.0} seconds", last.elapsed_secs)
    } else {
        writeln!(out, "Duration: {} seconds", Number(last.elapsed_secs))
    }
}

/// The frame that was read last.
#[derive(Default)]
struct Last {
    number: u64,
    elapsed_secs: f64,
}

impl Last {
    fn note(&mut self, start: &FrameStart) {
        (self.number, self.elapsed_secs) = (start.number, start.elapsed_secs);
    }
}

/// Number and time of the last whole frame of a log, by reading all of it.
///
/// # Errors
/// Those of the source.
pub fn last_frame(reader: &mut Reader<impl Read>) -> io::Result<Option<FrameStart>> {
    let mut last = None;
    while let Some(frame) = reader.next_frame()? {
        last = Some(frame.start);
    }
    Ok(last)
}
