//! The thread that writes one recording.

use std::io;
use std::path::Path;
use std::sync::mpsc::TrySendError;
use std::time::{Duration, Instant};

use batched_queue::{Giver, Taker};
use recording::{FrameContent, Header, Writer};
use tokio::sync::watch;

use super::log_file::LogFile;

/// Frames that may wait for the disk: several seconds, and at most some dozens of megabytes.
const FRAMES_WAITING_MAX: usize = 256;
/// How much a machine that dies may lose.
const SYNC_PERIOD: Duration = Duration::from_secs(1);

/// Why a frame was not recorded.
#[derive(Debug, thiserror::Error)]
pub(super) enum WriteError {
    #[error("the disk is too slow: {FRAMES_WAITING_MAX} frames wait already")]
    TooSlow,
    #[error("writing has ended")]
    Ended,
}

/// Why a recording has fewer frames than it was given.
#[derive(Debug, thiserror::Error)]
#[error("a recording ends before frame {frame}: {cause}")]
struct Ended {
    /// The first that is missing, from 1.
    frame: u64,
    cause: io::Error,
}

/// Writes frames in the order it is given them, and holds nobody up. Who drops it says that no more
/// are to come.
pub(super) struct Scribe<T> {
    frames: Giver<T>,
    written: Written,
}

/// Knows when all of a recording is written.
#[derive(Clone, Debug)]
pub(super) struct Written(watch::Receiver<()>);

impl Written {
    /// Whether it is.
    pub(super) fn is_over(&self) -> bool {
        self.0.has_changed().is_err()
    }

    /// Waits until it is.
    pub(super) async fn wait(mut self) {
        while self.0.changed().await.is_ok() {}
    }
}

impl<T: Send + 'static> Scribe<T> {
    /// Writes the head. What a file has of each thing that is given later, its thread finds out.
    pub(super) fn start(
        file: LogFile,
        path: &Path,
        header: &Header,
        content: impl FnMut(T) -> FrameContent + Send + 'static,
    ) -> io::Result<Self> {
        let writer = Writer::begin(file, header)?;
        let path = path.to_owned();
        let (writing, written) = watch::channel(());
        let work = move |waiting| {
            if let Err(ended) = write_all(writer, &waiting, content) {
                tracing::error!(?path, "{ended}");
            }
            // Also when that panics, whoever waits is told.
            drop(writing);
        };
        let (frames, _) = batched_queue::spawn("recording", FRAMES_WAITING_MAX, work)?;
        Ok(Self { frames, written: Written(written) })
    }

    pub(super) fn write(&self, frame: T) -> Result<(), WriteError> {
        self.frames.give(frame).map_err(|error| match error {
            TrySendError::Full(_) => WriteError::TooSlow,
            TrySendError::Disconnected(_) => WriteError::Ended,
        })
    }

    /// When all that it was given is written.
    pub(super) fn written(&self) -> Written {
        self.written.clone()
    }
}

fn write_all<T>(
    mut writer: Writer<LogFile>,
    waiting: &Taker<T>,
    mut content: impl FnMut(T) -> FrameContent,
) -> Result<(), Ended> {
    let mut synced = Instant::now();
    while let Some(mut frames) = waiting.gather() {
        let outcome = frames.try_for_each(|frame| writer.frame(content(frame))).and_then(|()| {
            if synced.elapsed() >= SYNC_PERIOD {
                synced = Instant::now();
                writer.sink().sync()?;
            }
            Ok(())
        });
        // The one that the writer holds: the next one, which tells how long it lasts, is not taken.
        outcome.map_err(|cause| Ended { frame: writer.frames(), cause })?;
    }
    let frame = writer.frames();
    writer.finish().and_then(|file| file.sync()).map_err(|cause| Ended { frame, cause })
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};

    use super::*;
    use crate::allowance::Allowance;

    /// A file as if it were a recording of somebody without quotas.
    async fn log_file(file: File) -> LogFile {
        let allowance = Allowance::open("local".parse().unwrap());
        let folder = std::env::temp_dir();
        LogFile::new(file, allowance.recording(&folder, &folder.join("none.log")).await.unwrap())
    }

    fn frame(number: u32) -> FrameContent {
        FrameContent { elapsed_secs: f64::from(number), ..FrameContent::default() }
    }

    fn header() -> Header {
        Header { version: Header::VERSION, date: 0, map: "Town01".to_owned() }
    }

    #[tokio::test]
    async fn all_frames_are_in_the_file_when_it_is_finished() {
        let path = std::env::temp_dir().join(format!("causeway-scribe-{}", std::process::id()));
        let file = log_file(File::create(&path).unwrap()).await;
        let scribe = Scribe::start(file, &path, &header(), |frame| frame).unwrap();
        for number in 0..100 {
            scribe.write(frame(number)).unwrap();
        }
        let written = scribe.written();
        assert!(!written.is_over());
        drop(scribe);
        written.wait().await;
        let log = fs::read(&path).unwrap();
        let mut reader = recording::Reader::open(&log[..]).unwrap();
        let last = recording::query::last_frame(&mut reader).unwrap().unwrap();
        assert_eq!((last.number, last.duration_secs), (100, -1.0));
        fs::remove_file(path).unwrap();
    }

    #[tokio::test]
    async fn a_full_disk_ends_the_recording_and_the_giver_learns_of_it() {
        let full = log_file(File::options().write(true).open("/dev/full").unwrap()).await;
        let same = |frame: FrameContent| frame;
        let begun = Scribe::start(full, Path::new("/dev/full"), &header(), same);
        // The head is the first that does not fit.
        assert_eq!(begun.err().unwrap().kind(), io::ErrorKind::StorageFull);
        // A file that was not opened for writing refuses what a full disk would.
        let read_only = log_file(File::open("/dev/null").unwrap()).await;
        let writer = Writer::after_head(read_only);
        let (writing, written) = watch::channel(());
        let (told, hears) = std::sync::mpsc::channel();
        let work = move |waiting| {
            told.send(write_all(writer, &waiting, same)).unwrap();
            drop(writing);
        };
        let (frames, _) = batched_queue::spawn("recording", FRAMES_WAITING_MAX, work).unwrap();
        let scribe = Scribe { frames, written: Written(written) };
        let until = Instant::now() + Duration::from_secs(20);
        while scribe.write(frame(1)).is_ok() {
            assert!(Instant::now() < until, "nobody says that writing has ended");
            std::thread::yield_now();
        }
        scribe.written().wait().await;
        let ended = hears.recv().unwrap().unwrap_err().to_string();
        assert!(ended.starts_with("a recording ends before frame 1: "), "{ended}");
    }
}
