//! Journals on disk: which names lead to which files, and whether all are written.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use monitoring::Counter;
use schemas::{Error, ErrorCode, Tenant};
use whole_file::WholeFile;

use crate::args::Journals;
use crate::journal::{Head, Queue, Scribe};
use crate::service::NewJournal;

/// What names of journals end with.
const EXTENSION: &str = "journal";
/// What journals begin with; a file that does not is never replaced.
const MAGIC: [u8; 4] = *b"CWJL";
/// Journals of one world, one after the other.
const JOURNALS_PER_WORLD_MAX: u32 = 1_000;
/// How long the end of a service waits for the disk.
const SETTLE_WAIT: Duration = Duration::from_secs(10);

/// The journals of one service.
pub(super) struct JournalFolder {
    journals: Option<Journals>,
    threads: Mutex<Vec<JoinHandle<()>>>,
    /// Of entries, before they are packed.
    bytes: Counter,
}

impl JournalFolder {
    /// Where no folder is named, none are kept. Bytes of their entries are counted.
    pub(super) fn new(journals: Option<Journals>, bytes: Counter) -> Self {
        Self { journals, threads: Mutex::default(), bytes }
    }

    /// Begins a journal.
    ///
    /// # Errors
    /// `Unsupported` where none are kept, a name that leads nowhere, or the file cannot be made.
    pub(super) fn begin(&self, wanted: NewJournal<'_>) -> Result<(String, Box<dyn Scribe>), Error> {
        let journals = self.journals()?;
        let folder = journals.folder.join(wanted.tenant.as_str());
        let (name, file) = match wanted.name {
            Some(name) => (name.to_owned(), replaced(&path_in(&folder, name)?)),
            None => new_file(&folder, wanted.world.get())?,
        };
        let refused = |cause: io::Error| {
            Error::new(ErrorCode::Internal, "the journal cannot be begun")
                .found(format_args!("{}: {cause}", folder.join(&name).display()))
        };
        let file = file.map_err(refused)?;
        let scribe = self.spawn(file, &name, journals.bytes_max, wanted.head).map_err(refused)?;
        Ok((name, Box::new(scribe)))
    }

    /// The file of a journal that is there.
    ///
    /// # Errors
    /// `Unsupported` where none are kept, a name that leads nowhere, or no such file.
    pub(super) fn open(&self, tenant: &Tenant, name: &str) -> Result<File, Error> {
        let folder = self.journals()?.folder.join(tenant.as_str());
        File::open(path_in(&folder, name)?).map_err(|cause| {
            Error::new(ErrorCode::UnknownAsset, "no such journal")
                .wanted(format_args!("one in {}", folder.display()))
                .found(format_args!("{name:?}: {cause}"))
        })
    }

    /// Waits until all journals of worlds that are gone are written, but not for ever.
    pub(super) fn settle(&self) {
        let until = Instant::now() + SETTLE_WAIT;
        let threads = std::mem::take(&mut *self.lock());
        while threads.iter().any(|thread| !thread.is_finished()) {
            if Instant::now() > until {
                tracing::warn!("journals are left without their ends");
                return;
            }
            thread::sleep(Duration::from_millis(2));
        }
    }

    fn journals(&self) -> Result<&Journals, Error> {
        self.journals.as_ref().ok_or_else(|| {
            Error::new(ErrorCode::Unsupported, "this world service keeps no journals")
                .wanted("one started with --journals DIR")
        })
    }

    fn spawn(&self, file: File, name: &str, bytes_max: u64, head: Head) -> io::Result<Queue> {
        let (out, bytes) = (WholeFile::new(file), self.bytes.clone());
        let (queue, thread) = Queue::begin(out, bytes_max, head, name.to_owned(), bytes)?;
        let mut threads = self.lock();
        threads.retain(|thread| !thread.is_finished());
        threads.push(thread);
        Ok(queue)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<JoinHandle<()>>> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The file that a name leads to.
fn path_in(folder: &Path, name: &str) -> Result<PathBuf, Error> {
    let refuse = || {
        Error::new(ErrorCode::InvalidArgument, "this is no name of a journal")
            .wanted(format_args!("a name that ends with .{EXTENSION}, also with folders before it"))
            .found(format_args!("{name:?}"))
    };
    let path = Path::new(name);
    let is_inside = path.components().all(|part| matches!(part, Component::Normal(_)));
    let is_journal = path.extension().is_some_and(|end| end == EXTENSION);
    if is_inside && is_journal && !name.contains(['\\', '\0']) {
        Ok(folder.join(path))
    } else {
        Err(refuse())
    }
}

/// A file of its own in place of the journal that is there. One that is still being written stays
/// with its writer.
fn replaced(path: &Path) -> io::Result<File> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    match File::open(path) {
        Ok(mut before) => {
            let mut magic = [0; MAGIC.len()];
            let is_journal = before.read_exact(&mut magic).is_ok() && magic == MAGIC;
            if !is_journal && before.metadata()?.len() > 0 {
                return Err(io::Error::other("it is there already, and no journal"));
            }
            fs::remove_file(path)?;
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    File::create_new(path)
}

/// The next journal of a world, which may have several, one after the other.
fn new_file(folder: &Path, world: u64) -> Result<(String, io::Result<File>), Error> {
    if let Err(cause) = fs::create_dir_all(folder) {
        return Ok((String::new(), Err(cause)));
    }
    for count in 1..=JOURNALS_PER_WORLD_MAX {
        let name = format!("world-{world}-{count}.{EXTENSION}");
        match File::create_new(folder.join(&name)) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return Ok((name, made)),
        }
    }
    Err(Error::new(ErrorCode::Capacity, "the world has too many journals")
        .wanted(format_args!("at most {JOURNALS_PER_WORLD_MAX}")))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::journal::Entry;

    #[test]
    fn names_lie_in_the_folder_and_end_as_journals_do() {
        let folder = Path::new("/srv/journals/local");
        for name in ["a.journal", "runs/7/a.log.journal", "2026-11-28 05:15:19.log.journal"] {
            assert_eq!(path_in(folder, name).unwrap(), folder.join(name));
        }
        for name in ["", "a.log", "../a.journal", "/a.journal", "b/../a.journal", "c:\\a.journal"] {
            assert!(path_in(folder, name).is_err(), "{name:?}");
        }
    }

    #[test]
    fn what_is_no_journal_is_never_replaced() {
        let folder = std::env::temp_dir().join(format!("causeway-journals-{}", std::process::id()));
        let path = folder.join("runs/a.journal");
        replaced(&path).unwrap().write_all(b"CWJL\x02").unwrap();
        drop(replaced(&path).unwrap());
        fs::write(&path, "notes of somebody").unwrap();
        assert!(replaced(&path).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"notes of somebody");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_full_disk_ends_the_journal_and_the_giver_learns_of_it() {
        let folder = JournalFolder::new(None, Counter::default());
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut queue = folder.spawn(full, "full", 1 << 30, Head::default()).unwrap();
        folder.settle();
        assert!(queue.put(Entry::Commands(Vec::new())).is_err());
    }
}
