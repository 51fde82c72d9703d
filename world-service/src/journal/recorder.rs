//! Writing a journal while a world runs.

use std::io::{self, ErrorKind, Write};

use schemas::wire::encode_request;
use schemas::{Command, EncodedFrame, Request, WorldId};

use super::chunk::{self, CHUNK_HEAD_BYTES, HEAD, Kind};

/// A journal that is being written; bounded.
pub struct Journal {
    out: Box<dyn Write + Send>,
    left_bytes: u64,
}

impl Journal {
    /// Begins with a world's map and present state.
    ///
    /// # Errors
    /// The file cannot be written, or `bytes_max` is too little even for that.
    pub fn begin(
        out: Box<dyn Write + Send>,
        bytes_max: u64,
        map_name: &str,
        map_text: &str,
        snapshot: &[u8],
    ) -> io::Result<Self> {
        let left_bytes = bytes_max.saturating_sub(HEAD.len() as u64);
        let mut journal = Self { out, left_bytes };
        journal.out.write_all(&HEAD)?;
        journal.put(Kind::MapName, &[map_name.as_bytes()])?;
        journal.put(Kind::MapText, &[map_text.as_bytes()])?;
        journal.put(Kind::Snapshot, &[snapshot])?;
        journal.out.flush()?;
        Ok(journal)
    }

    /// Commands that a world carried out. Refused ones change nothing and need no record.
    ///
    /// # Errors
    /// The file cannot be written, or is full.
    pub fn commands(&mut self, world: WorldId, commands: Vec<Command>) -> io::Result<()> {
        let request = encode_request(&Request::RunCommands { world, commands });
        self.put(Kind::Commands, &[&request])
    }

    /// A tick and what came of it.
    ///
    /// # Errors
    /// The file cannot be written, or is full.
    pub fn tick(&mut self, dt_secs: Option<f64>, frame: &EncodedFrame) -> io::Result<()> {
        let wanted = dt_secs.unwrap_or(f64::NAN).to_le_bytes();
        self.put(Kind::Tick, &[&wanted, &frame.0])?;
        // What was replied to is in the file, whatever happens to the process.
        self.out.flush()
    }

    /// Ends it in order.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn end(mut self) -> io::Result<()> {
        chunk::write(&mut *self.out, Kind::End, &[])?;
        self.out.flush()
    }

    fn put(&mut self, kind: Kind, content: &[&[u8]]) -> io::Result<()> {
        let bytes: u64 = content.iter().map(|part| part.len() as u64).sum();
        // Room for the end stays.
        let left = self.left_bytes.checked_sub(bytes + CHUNK_HEAD_BYTES);
        let Some(left) = left.filter(|left| *left >= CHUNK_HEAD_BYTES) else {
            chunk::write(&mut *self.out, Kind::End, &[])?;
            self.out.flush()?;
            return Err(ErrorKind::QuotaExceeded.into());
        };
        self.left_bytes = left;
        chunk::write(&mut *self.out, kind, content)
    }
}
