//! The file of a recording, which grows as far as a quota allows.

use std::fs::File;
use std::io::{self, Write};

use whole_file::WholeFile;

use crate::allowance::Growing;

/// A file that takes whole pieces, and counts them.
pub(super) struct LogFile {
    file: WholeFile,
    growing: Growing,
}

impl LogFile {
    /// An empty file, open for writing.
    pub(super) fn new(file: File, growing: Growing) -> Self {
        Self { file: WholeFile::new(file), growing }
    }

    /// Returns when all pieces are on the disk.
    pub(super) fn sync(&self) -> io::Result<()> {
        self.file.sync()
    }
}

impl Write for LogFile {
    /// Writes all of a piece or nothing.
    fn write(&mut self, piece: &[u8]) -> io::Result<usize> {
        let bytes = piece.len() as u64;
        if !self.growing.take(bytes) {
            let why = "the quota recordings_mib allows no more";
            return Err(io::Error::new(io::ErrorKind::QuotaExceeded, why));
        }
        self.file.write(piece).inspect_err(|_| self.growing.give_back(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
