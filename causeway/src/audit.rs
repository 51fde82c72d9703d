//! Who did what: events with the target `audit` as lines of JSON in a file of their own, beside the
//! log. Nobody waits for the disk; what does not fit into a queue is counted and said.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use batched_queue::{Giver, Taker};
use serde_json::{Map, Value};
use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime as _, SystemTime};
use tracing_subscriber::layer::Context;

/// Lines that may wait for the disk.
const LINES_WAITING_MAX: usize = 4_096;
/// A file that would get longer takes the place of the one before it.
const FILE_BYTES_MAX: u64 = 16 << 20;
/// Of one value.
const CHARS_MAX: usize = 256;
/// How long the end of the process waits for the last lines.
const END_WAIT: Duration = Duration::from_secs(1);

/// Why nothing can be written down.
#[derive(Debug, thiserror::Error)]
#[error("--audit: {path:?}: {cause}")]
pub(crate) struct AuditError {
    path: PathBuf,
    cause: io::Error,
}

/// Takes what is told and gives it to the thread that writes.
pub(crate) struct AuditLayer(Arc<Shared>);

struct Shared {
    service: &'static str,
    /// `None` at the end.
    lines: Mutex<Option<Giver<String>>>,
    /// Lines that did not fit or could not be written, and of which nobody has been told.
    lost: Arc<AtomicU64>,
}

/// Writes the last lines when it is dropped.
pub(crate) struct AuditEnd {
    shared: Arc<Shared>,
    thread: JoinHandle<()>,
}

/// `SERVICE.jsonl` in the folder, with the one before it as `SERVICE.1.jsonl`.
struct Pages {
    path: PathBuf,
    before: PathBuf,
    file: File,
    bytes: u64,
    bytes_max: u64,
}

/// Begins to write down what a service tells.
///
/// # Errors
/// The folder cannot be used, or another process writes there.
pub(crate) fn begin(
    folder: &Path,
    service: &'static str,
) -> Result<(AuditLayer, AuditEnd), AuditError> {
    let wrong = |cause| AuditError { path: folder.to_owned(), cause };
    let pages = Pages::open(folder, service, FILE_BYTES_MAX).map_err(wrong)?;
    let lost = Arc::new(AtomicU64::new(0));
    let unwritten = Arc::clone(&lost);
    let work = move |waiting| write_all(pages, &waiting, &unwritten);
    let (giver, thread) = batched_queue::spawn("audit", LINES_WAITING_MAX, work).map_err(wrong)?;
    let shared = Arc::new(Shared { service, lines: Mutex::new(Some(giver)), lost });
    Ok((AuditLayer(Arc::clone(&shared)), AuditEnd { shared, thread }))
}

impl<S: Subscriber> Layer<S> for AuditLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut line = Line(self.0.line());
        event.record(&mut line);
        self.0.give(Value::Object(line.0).to_string());
    }
}

impl Shared {
    /// What every line begins with.
    fn line(&self) -> Map<String, Value> {
        let begun = [("t", now().into()), ("service", self.service.into())];
        begun.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    fn give(&self, line: String) {
        let lines = self.lock();
        let Some(lines) = lines.as_ref() else { return };
        let lost = self.lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            let mut line = self.line();
            line.insert("action".to_owned(), "lost".into());
            line.insert("lines".to_owned(), lost.into());
            if lines.give(Value::Object(line).to_string()).is_err() {
                self.lost.fetch_add(lost, Ordering::Relaxed);
            }
        }
        if lines.give(line).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Giver<String>>> {
        // Nothing panics while it holds the lock.
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for AuditEnd {
    fn drop(&mut self) {
        self.shared.lock().take();
        let until = Instant::now() + END_WAIT;
        while !self.thread.is_finished() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn now() -> String {
    let mut text = String::new();
    // Without a clock a line has no time.
    let _ = SystemTime.format_time(&mut Writer::new(&mut text));
    text
}

/// The members of a line.
struct Line(Map<String, Value>);

impl Line {
    fn put(&mut self, field: &Field, value: Value) {
        let name = if field.name() == "message" { "action" } else { field.name() };
        self.0.insert(name.to_owned(), value);
    }
}

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let text = format!("{value:?}");
        self.put(field, text.chars().take(CHARS_MAX).collect::<String>().into());
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.put(field, value.chars().take(CHARS_MAX).collect::<String>().into());
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.put(field, value.into());
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.put(field, value.into());
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.put(field, value.into());
    }
}

/// Writes each line that can be written, whatever became of those before it.
fn write_all(mut pages: Pages, waiting: &Taker<String>, lost: &AtomicU64) {
    let mut is_well = true;
    while let Some(lines) = waiting.gather() {
        for line in lines {
            let written = pages.write(&line);
            if let Err(error) = &written {
                lost.fetch_add(1, Ordering::Relaxed);
                if is_well {
                    tracing::error!(%error, path = ?pages.path, "who did what is not written down");
                }
            }
            is_well = written.is_ok();
        }
    }
}

impl Pages {
    fn open(folder: &Path, service: &str, bytes_max: u64) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let path = folder.join(format!("{service}.jsonl"));
        let before = folder.join(format!("{service}.1.jsonl"));
        let file = opened(&path)?;
        let bytes = file.metadata()?.len();
        Ok(Self { path, before, file, bytes, bytes_max })
    }

    fn write(&mut self, line: &str) -> io::Result<()> {
        let bytes = line.len() as u64 + 1;
        if self.bytes > 0 && self.bytes + bytes > self.bytes_max {
            self.turn()?;
        }
        if let Err(error) = self.file.write_all(format!("{line}\n").as_bytes()) {
            // The next line does not follow half of this one.
            self.file.set_len(self.bytes)?;
            return Err(error);
        }
        self.bytes += bytes;
        Ok(())
    }

    /// The present file takes the place of the one before it, unless somebody has moved it away,
    /// and a new one begins.
    fn turn(&mut self) -> io::Result<()> {
        match fs::rename(&self.path, &self.before) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            renamed => renamed?,
        }
        self.file = opened(&self.path)?;
        self.bytes = self.file.metadata()?.len();
        Ok(())
    }
}

/// A file that nobody else writes to.
fn opened(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().append(true).create(true).mode(0o600).open(path)?;
    let taken = "another process writes there; give each its own folder";
    file.try_lock().map_err(|error| match error {
        fs::TryLockError::WouldBlock => io::Error::new(io::ErrorKind::ResourceBusy, taken),
        fs::TryLockError::Error(error) => error,
    })?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use tracing_subscriber::layer::SubscriberExt as _;

    use super::*;

    /// A folder that goes away with the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let name = format!("causeway-audit-{name}-{}", std::process::id());
            Self(std::env::temp_dir().join(name))
        }

        fn read(&self, name: &str) -> String {
            fs::read_to_string(self.0.join(name)).unwrap()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn an_event_is_a_line_and_the_last_ones_are_written_at_the_end() {
        let folder = Folder::new("lines");
        let (layer, end) = begin(&folder.0, "scenario").unwrap();
        let subscriber = tracing_subscriber::registry().with(layer);
        tracing::subscriber::with_default(subscriber, || {
            let text = "x".repeat(1_000);
            tracing::info!(target: "audit", tenant = %"alice", count = 3, text, "open session");
        });
        drop(end);
        let lines = folder.read("scenario.jsonl");
        let line: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
        assert_eq!((&line["action"], &line["tenant"]), (&"open session".into(), &"alice".into()));
        assert_eq!((&line["service"], &line["count"]), (&"scenario".into(), &3.into()));
        assert_eq!(line["text"].as_str().unwrap().len(), CHARS_MAX);
        assert!(line["t"].as_str().unwrap().ends_with('Z'), "{line}");
    }

    #[test]
    fn files_are_bounded_and_the_one_before_is_kept() {
        let folder = Folder::new("pages");
        let mut pages = Pages::open(&folder.0, "gateway", 100).unwrap();
        for number in 0..25 {
            pages.write(&format!("line {number:04}")).unwrap();
        }
        let (now, before) = (folder.read("gateway.jsonl"), folder.read("gateway.1.jsonl"));
        assert_eq!((now.lines().count(), before.lines().count()), (5, 10));
        assert_eq!(
            (before.lines().next(), now.lines().last()),
            (Some("line 0010"), Some("line 0024"))
        );
        drop(pages);
        let mut again = Pages::open(&folder.0, "gateway", 100).unwrap();
        again.write("line 0025").unwrap();
        assert_eq!(folder.read("gateway.jsonl").lines().count(), 6, "an old file is gone on with");
    }

    #[test]
    fn a_file_that_somebody_moved_away_is_followed_by_a_new_one() {
        let folder = Folder::new("moved");
        let mut pages = Pages::open(&folder.0, "gateway", 20).unwrap();
        pages.write("line 0000").unwrap();
        pages.write("line 0001").unwrap();
        fs::rename(&pages.path, folder.0.join("archived")).unwrap();
        pages.write("line 0002").unwrap();
        assert_eq!(folder.read("gateway.jsonl"), "line 0002\n");
        assert_eq!(folder.read("archived").lines().count(), 2);
    }

    #[test]
    fn a_line_that_cannot_be_written_is_counted_and_those_after_it_are_written() {
        let folder = Folder::new("between");
        let mut pages = Pages::open(&folder.0, "gateway", 20).unwrap();
        pages.write("line 0000").unwrap();
        // Where the file before it belongs, a folder stands, which no file replaces.
        fs::create_dir(&pages.before).unwrap();
        let lost = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&lost);
        let work = move |taker: Taker<String>| write_all(pages, &taker, &counted);
        let (giver, thread) = batched_queue::spawn("test", 8, work).unwrap();
        for line in ["too long for what is left", "line 0001"] {
            giver.give(line.to_owned()).unwrap();
        }
        drop(giver);
        thread.join().unwrap();
        assert_eq!(folder.read("gateway.jsonl"), "line 0000\nline 0001\n");
        assert_eq!(lost.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn two_processes_do_not_write_to_one_file() {
        let folder = Folder::new("two");
        let first = Pages::open(&folder.0, "gateway", 100).unwrap();
        let refused = Pages::open(&folder.0, "gateway", 100).err().unwrap().to_string();
        assert!(refused.contains("give each its own folder"), "{refused}");
        drop(first);
        assert!(Pages::open(&folder.0, "gateway", 100).is_ok());
    }

    #[test]
    fn whoever_tells_too_much_waits_for_nobody_and_it_is_said() {
        let (giver, thread) = batched_queue::spawn("test", 2, |taker: Taker<String>| {
            std::thread::sleep(Duration::from_millis(200));
            while let Some(lines) = taker.gather() {
                lines.for_each(drop);
            }
        })
        .unwrap();
        let lines = Mutex::new(Some(giver));
        let shared = Shared { service: "scenario", lines, lost: Arc::default() };
        let begun = Instant::now();
        (0..1_000).for_each(|_| shared.give("line".to_owned()));
        assert!(begun.elapsed() < Duration::from_millis(150));
        assert!(shared.lost.load(Ordering::Relaxed) >= 990);
        shared.lock().take();
        thread.join().unwrap();
    }
}
