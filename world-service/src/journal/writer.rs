//! Writing a journal.

use std::io::{self, ErrorKind, Write};

use super::chunk::{self, CHUNK_HEAD_BYTES, HEAD, Kind};
use super::entry::{Entry, Head, Moment, Scribe};
use super::index::{Index, Keyframe, Place};

/// Bytes that the index takes for each tick and keyframe.
const PLACE_BYTES: u64 = 16;
/// What is written at the end besides: the heads of two chunks, a count, an offset.
const END_BYTES: u64 = 2 * CHUNK_HEAD_BYTES + 8 + 8;

/// A journal that is being written; bounded, and whole after every entry.
pub struct Writer<W> {
    out: W,
    /// The chunk that is being put together: one write for each.
    chunk: Vec<u8>,
    bytes: u64,
    bytes_max: u64,
    first_secs: f64,
    index: Index,
}

impl<W: Write> Writer<W> {
    /// Begins a journal.
    ///
    /// # Errors
    /// The file cannot be written, or `bytes_max` is too little even for the head.
    pub fn begin(mut out: W, bytes_max: u64, head: &Head) -> io::Result<Self> {
        out.write_all(&HEAD)?;
        let (first_secs, index) = (head.first.sim_secs, Index::after(head.first.tick));
        let (chunk, bytes) = (Vec::new(), HEAD.len() as u64);
        let mut writer = Self { out, chunk, bytes, bytes_max, first_secs, index };
        writer.chunk(Kind::MapName, &[head.map_name.as_bytes()])?;
        writer.chunk(Kind::MapText, &[&chunk::pack(head.map_text.as_bytes())])?;
        let moment = moment_bytes(&head.first);
        writer.chunk(Kind::Snapshot, &[&moment, &chunk::pack(&head.snapshot)])?;
        writer.out.flush()?;
        Ok(writer)
    }

    /// Writes the next entry.
    ///
    /// # Errors
    /// The file cannot be written, or is full; then it has an end.
    pub fn write(&mut self, entry: &Entry) -> io::Result<()> {
        let offset = self.bytes;
        match entry {
            Entry::Commands(request) => self.chunk(Kind::Commands, &[request]),
            Entry::Tick(tick) => {
                let wanted = tick.wanted_secs.unwrap_or(f64::NAN).to_le_bytes();
                let (moment, frame) = (moment_bytes(&tick.moment), chunk::pack(&tick.frame.0));
                self.chunk(Kind::Tick, &[&wanted, &moment, &frame])?;
                let elapsed_secs = tick.moment.sim_secs - self.first_secs;
                self.index.ticks.push(Place { offset, elapsed_secs });
                // What was written is in the file, whatever happens to the process.
                self.out.flush()
            }
            Entry::Keyframe { moment, snapshot } => {
                let moment = moment_bytes(moment);
                self.chunk(Kind::Keyframe, &[&moment, &chunk::pack(snapshot)])?;
                let ticks_before = self.index.ticks.len() as u64;
                self.index.keyframes.push(Keyframe { offset, ticks_before });
                Ok(())
            }
        }
    }

    /// Ends it in order.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.write_end()?;
        Ok(self.out)
    }

    /// What it writes to.
    pub fn sink(&self) -> &W {
        &self.out
    }

    fn write_end(&mut self) -> io::Result<()> {
        let index_at = self.bytes.to_le_bytes();
        self.chunk.clear();
        chunk::write(&mut self.chunk, Kind::Index, &[&self.index.encode()])?;
        chunk::write(&mut self.chunk, Kind::End, &[&index_at])?;
        self.out.write_all(&self.chunk)?;
        self.out.flush()
    }

    fn chunk(&mut self, kind: Kind, content: &[&[u8]]) -> io::Result<()> {
        let bytes: u64 = content.iter().map(|part| part.len() as u64).sum();
        let places = self.index.ticks.len() + self.index.keyframes.len() + 1;
        let end_bytes = END_BYTES + PLACE_BYTES * places as u64;
        if self.bytes + CHUNK_HEAD_BYTES + bytes + end_bytes > self.bytes_max {
            self.write_end()?;
            return Err(ErrorKind::QuotaExceeded.into());
        }
        self.chunk.clear();
        chunk::write(&mut self.chunk, kind, content)?;
        self.out.write_all(&self.chunk)?;
        self.bytes += CHUNK_HEAD_BYTES + bytes;
        Ok(())
    }
}

/// Writes at once: for those who may wait.
impl<W: Write + Send> Scribe for Writer<W> {
    fn put(&mut self, entry: Entry) -> io::Result<()> {
        self.write(&entry)
    }

    fn end(self: Box<Self>, then: Box<dyn FnOnce() + Send>) {
        if let Err(error) = self.finish() {
            tracing::warn!(%error, "a journal has no end");
        }
        then();
    }
}

fn moment_bytes(moment: &Moment) -> [u8; 24] {
    let mut bytes = [0; 24];
    bytes[..8].copy_from_slice(&moment.tick.0.to_le_bytes());
    bytes[8..16].copy_from_slice(&moment.sim_secs.to_le_bytes());
    bytes[16..].copy_from_slice(&moment.state_hash.to_le_bytes());
    bytes
}
