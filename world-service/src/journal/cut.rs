//! A piece of a journal.

use std::io::{self, Read, Seek, Write};

use schemas::Tick;

use super::entry::{Head, Moment};
use super::reader::Reader;
use super::replay::{JournalError, Replay};
use super::writer::Writer;

/// Writes the part of a journal from the state of one tick to that of another as a journal of its
/// own; `progress` hears how many ticks are written.
///
/// # Errors
/// [`JournalError`], also of the sink.
pub fn cut<W: Write>(
    reader: &mut Reader<impl Read + Seek>,
    (from, to): (Tick, Tick),
    sink: W,
    mut progress: impl FnMut(u64),
) -> Result<W, JournalError> {
    let way = reader.way_to(from)?;
    let mut replay = Replay::begin(reader.head())?;
    replay.go(&way)?;
    let frame = replay.world().frame();
    let Head { map_name, map_text, .. } = reader.head().clone();
    let snapshot = replay.world().snapshot();
    let head = Head { map_name, map_text, snapshot, first: Moment::of(&frame) };
    let mut writer = Writer::begin(sink, u64::MAX, &head)?;
    let mut written = 0;
    reader.entries(from, to, |entry| {
        if matches!(entry, super::Entry::Tick(_)) {
            written += 1;
            progress(written);
        }
        writer.write(&entry).map_err(JournalError::Read)
    })?;
    writer.finish().map_err(|error: io::Error| error.into())
}
