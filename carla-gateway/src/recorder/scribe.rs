//! The thread that writes one recording.

use std::io::{self, Write};
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

/// What a recording is written to.
pub(super) trait Sink: Write + Send + 'static {
    /// Returns when all that was written is on the disk.
    fn sync(&self) -> io::Result<()>;
}

impl Sink for LogFile {
    fn sync(&self) -> io::Result<()> {
        LogFile::sync(self)
    }
}

/// Why a frame was not recorded.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum WriteError {
    #[error(
        "a recording ends before frame {frame}: the disk is too slow, {FRAMES_WAITING_MAX} frames \
         wait already"
    )]
    TooSlow {
        /// The first that is missing, from 1.
        frame: u64,
    },
    #[error("a recording has ended before frame {frame}, as its thread says")]
    Ended {
        /// The first that nobody takes.
        frame: u64,
    },
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
    /// How many it was given.
    given: u64,
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
        file: impl Sink,
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
        Ok(Self { frames, given: 0, written: Written(written) })
    }

    pub(super) fn write(&mut self, content: T) -> Result<(), WriteError> {
        let frame = self.given + 1;
        self.frames.give(content).map_err(|error| match error {
            TrySendError::Full(_) => WriteError::TooSlow { frame },
            TrySendError::Disconnected(_) => WriteError::Ended { frame },
        })?;
        self.given = frame;
        Ok(())
    }

    /// When all that it was given is written.
    pub(super) fn written(&self) -> Written {
        self.written.clone()
    }
}

fn write_all<T>(
    mut writer: Writer<impl Sink>,
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
    use std::sync::mpsc::{Receiver, channel};
    use std::sync::{Arc, Mutex};

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

    /// The last whole frame of a log, and its duration.
    fn last_of(log: &[u8]) -> (u64, f64) {
        let mut reader = recording::Reader::open(log).unwrap();
        let last = recording::query::last_frame(&mut reader).unwrap().unwrap();
        assert_eq!(reader.cut(), None);
        (last.number, last.duration_secs)
    }

    /// A disk in memory.
    #[derive(Clone, Default)]
    struct Disk {
        bytes: Arc<Mutex<Vec<u8>>>,
        /// Bytes that it has room for.
        room: Option<usize>,
        /// It takes frames only once this is dropped at the other end.
        stuck: Option<Arc<Mutex<Receiver<()>>>>,
    }

    impl Write for Disk {
        fn write(&mut self, piece: &[u8]) -> io::Result<usize> {
            let mut bytes = self.bytes.lock().unwrap();
            // The head is written by who begins the recording, not by its thread.
            if let Some(stuck) = self.stuck.as_ref().filter(|_| !bytes.is_empty()) {
                stuck.lock().unwrap().recv().unwrap_err();
            }
            if self.room.is_some_and(|room| bytes.len() + piece.len() > room) {
                return Err(io::ErrorKind::StorageFull.into());
            }
            bytes.extend_from_slice(piece);
            Ok(piece.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Sink for Disk {
        fn sync(&self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Bytes of the head and of one frame without content.
    fn sizes() -> (usize, usize) {
        let writer = Writer::begin(Vec::new(), &header()).unwrap();
        let head = writer.sink().len();
        let mut writer = writer;
        writer.frame(frame(0)).unwrap();
        (head, writer.finish().unwrap().len() - head)
    }

    #[tokio::test]
    async fn all_frames_are_in_the_file_when_it_is_finished() {
        let path = std::env::temp_dir().join(format!("causeway-scribe-{}", std::process::id()));
        let file = log_file(File::create(&path).unwrap()).await;
        let mut scribe = Scribe::start(file, &path, &header(), |frame| frame).unwrap();
        for number in 0..100 {
            scribe.write(frame(number)).unwrap();
        }
        let written = scribe.written();
        assert!(!written.is_over());
        drop(scribe);
        written.wait().await;
        assert_eq!(last_of(&fs::read(&path).unwrap()), (100, -1.0));
        fs::remove_file(path).unwrap();
    }

    #[tokio::test]
    async fn a_disk_that_has_no_room_for_the_head_begins_no_recording() {
        let full = log_file(File::options().write(true).open("/dev/full").unwrap()).await;
        let begun = Scribe::start(full, Path::new("/dev/full"), &header(), |frame| frame);
        assert_eq!(begun.err().unwrap().kind(), io::ErrorKind::StorageFull);
    }

    #[tokio::test]
    async fn a_disk_that_is_too_slow_ends_the_recording_before_the_frame_that_is_named() {
        let (free, stuck) = channel();
        let stuck = Some(Arc::new(Mutex::new(stuck)));
        let disk = Disk { stuck, ..Disk::default() };
        let path = Path::new("stuck.log");
        let mut scribe = Scribe::start(disk.clone(), path, &header(), |frame| frame).unwrap();
        let mut taken = 0;
        let refused = loop {
            match scribe.write(frame(taken)) {
                Ok(()) => taken += 1,
                Err(refused) => break refused,
            }
            assert!(taken < 1_000, "nobody says that the disk is too slow");
        };
        let first_missing = u64::from(taken) + 1;
        assert_eq!(refused, WriteError::TooSlow { frame: first_missing });
        assert!(refused.to_string().contains(&format!("before frame {first_missing}: ")));
        assert!(taken as usize >= FRAMES_WAITING_MAX);
        let written = scribe.written();
        drop((scribe, free));
        written.wait().await;
        // All that were taken are there.
        assert_eq!(last_of(&disk.bytes.lock().unwrap()), (u64::from(taken), -1.0));
    }

    #[tokio::test]
    async fn a_disk_that_fills_up_ends_the_recording_before_the_frame_that_is_named() {
        const WHOLE: usize = 5;
        let (head, one) = sizes();
        let disk = Disk { room: Some(head + WHOLE * one + one / 2), ..Disk::default() };
        let writer = Writer::begin(disk.clone(), &header()).unwrap();
        let (writing, written) = watch::channel(());
        let (told, hears) = channel();
        let work = move |waiting| {
            told.send(write_all(writer, &waiting, |frame| frame)).unwrap();
            drop(writing);
        };
        let (frames, _) = batched_queue::spawn("recording", FRAMES_WAITING_MAX, work).unwrap();
        let mut scribe = Scribe { frames, given: 0, written: Written(written) };
        let until = Instant::now() + Duration::from_secs(20);
        let mut number = 0;
        let refused = loop {
            // At the pace of its thread: a queue that is full is not what is asked here.
            std::thread::sleep(Duration::from_millis(1));
            match scribe.write(frame(number)) {
                Ok(()) => number += 1,
                Err(refused) => break refused,
            }
            assert!(Instant::now() < until, "nobody says that writing has ended");
        };
        assert!(matches!(refused, WriteError::Ended { .. }), "{refused}");
        scribe.written().wait().await;
        let ended = hears.recv().unwrap().unwrap_err();
        assert_eq!(ended.frame, WHOLE as u64 + 1);
        assert_eq!(ended.cause.kind(), io::ErrorKind::StorageFull);
        let told = ended.to_string();
        assert!(told.starts_with("a recording ends before frame 6: "), "{told}");
        let (last, _) = last_of(&disk.bytes.lock().unwrap());
        assert_eq!(last, WHOLE as u64);
    }
}
