//! Files that grow piece by piece and never end within a piece, whatever the disk does.
//!
//! Recordings and journals are such files: who reads one that is still being written, or whose
//! writer died, finds whole pieces only.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// A file in which every write is a piece: one that does not fit is taken back.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    bytes: u64,
}

impl WholeFile {
    /// An empty file, open for writing.
    pub fn new(file: File) -> Self {
        Self { file, bytes: 0 }
    }

    /// Returns when all pieces are on the disk; flushing does not wait for that.
    ///
    /// # Errors
    /// What the system says.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// The next piece follows the last whole one.
    fn take_back(&mut self) -> io::Result<()> {
        self.file.set_len(self.bytes)?;
        self.file.seek(SeekFrom::Start(self.bytes)).map(drop)
    }
}

impl Write for WholeFile {
    /// Writes all of a piece or nothing.
    ///
    /// # Errors
    /// What the system says; also when the piece could not be taken back.
    fn write(&mut self, piece: &[u8]) -> io::Result<usize> {
        if let Err(error) = self.file.write_all(piece) {
            self.take_back().map_err(|why| {
                io::Error::new(error.kind(), format!("{error}; the file ends in a piece: {why}"))
            })?;
            return Err(error);
        }
        self.bytes += piece.len() as u64;
        Ok(piece.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    const PIECE: [u8; 1_000] = [7; 1_000];
    /// Names the file to a second process of this test.
    const FILE: &str = "CAUSEWAY_WHOLE_FILE_TEST";

    #[test]
    fn what_does_not_fit_is_taken_back() {
        if let Some(path) = std::env::var_os(FILE) {
            let mut file = WholeFile::new(File::create(path).unwrap());
            file.write_all(&PIECE).unwrap();
            file.sync().unwrap();
            assert_eq!(file.write_all(&PIECE).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
            file.write_all(&PIECE[..10]).unwrap();
            return;
        }
        let path = std::env::temp_dir().join(format!("causeway-whole-{}", std::process::id()));
        // Files of at most 1,024 bytes: the first bytes of the second piece still fit.
        let limited = "trap '' XFSZ; ulimit -f 1; exec \"$0\" what_does_not_fit_is_taken_back";
        let mut second = Command::new("bash");
        second.args(["-c", limited]).arg(std::env::current_exe().unwrap()).env(FILE, &path);
        assert!(second.output().unwrap().status.success());
        assert_eq!(std::fs::read(&path).unwrap(), [7; 1_010]);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn what_cannot_be_taken_back_is_said() {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let refused = WholeFile::new(full).write_all(&PIECE).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::StorageFull);
        assert!(refused.to_string().contains("ends in a piece"), "{refused}");
    }
}
