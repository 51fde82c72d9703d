//! Standard output and error that never hold a process up.
//!
//! Programs that start a simulator often give it pipes that they do not read. Once such a pipe is
//! full, whoever writes to it stands still for ever: the world, its clients and whoever asks the
//! site to end. So a pipe is opened once more, not to wait, and what does not fit is left out.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::sync::OnceLock;

/// `O_NONBLOCK` of Linux.
const NOT_TO_WAIT: i32 = 0o4000;

/// One of the two streams.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outlet {
    Out,
    Error,
}

impl Outlet {
    /// Prints a line.
    pub(crate) fn tell(mut self, line: &str) {
        // Nobody is left who could be told of it.
        let _ = self.write_all(format!("{line}\n").as_bytes());
    }

    /// The stream as a pipe of our own; nothing where it is none.
    fn pipe(self) -> Option<&'static File> {
        static PIPES: [OnceLock<Option<File>>; 2] = [const { OnceLock::new() }; 2];
        let (place, path) = match self {
            Self::Out => (0, "/proc/self/fd/1"),
            Self::Error => (1, "/proc/self/fd/2"),
        };
        PIPES[place].get_or_init(|| reopened(path)).as_ref()
    }
}

impl Write for Outlet {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match (self.pipe(), self) {
            (Some(pipe), _) => write_what_fits(pipe, bytes),
            (None, Self::Out) => io::stdout().write(bytes),
            (None, Self::Error) => io::stderr().write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Out => io::stdout().flush(),
            Self::Error => Ok(()),
        }
    }
}

fn reopened(path: &str) -> Option<File> {
    let is_pipe = std::fs::metadata(path).is_ok_and(|it| it.file_type().is_fifo());
    let open = || OpenOptions::new().write(true).custom_flags(NOT_TO_WAIT).open(path).ok();
    if is_pipe { open() } else { None }
}

fn write_what_fits(mut pipe: &File, bytes: &[u8]) -> io::Result<usize> {
    match pipe.write(bytes) {
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(bytes.len()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::os::fd::AsRawFd;

    use super::*;

    #[test]
    fn what_does_not_fit_into_a_pipe_is_left_out() {
        let (mut reader, writer) = io::pipe().unwrap();
        let pipe = reopened(&format!("/proc/self/fd/{}", writer.as_raw_fd())).unwrap();
        let line = [b'x'; 1_000];
        for _ in 0..1_000 {
            assert_eq!(write_what_fits(&pipe, &line).unwrap(), line.len());
        }
        let mut read = vec![0; 100_000];
        let count = reader.read(&mut read).unwrap();
        assert!(count > 1_000 && read[..count].iter().all(|byte| *byte == b'x'), "{count}");
        // There is room again, also for whoever waits.
        assert_eq!(write_what_fits(&pipe, b"seen").unwrap(), 4);
    }

    #[test]
    fn a_file_is_no_pipe() {
        assert!(reopened("/dev/null").is_none());
        assert!(reopened("/proc/self/exe").is_none());
    }
}
