//! What the recordings of a tenant take up, which all its endpoints fill together.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::Allowance;

/// All recordings of a tenant.
#[derive(Default)]
pub(super) struct Recordings(Mutex<Bytes>);

#[derive(Default)]
struct Bytes {
    /// The quota, as the newest recording found it.
    max: u64,
    /// Of files that nobody records to, as that one found them, and of those that have ended since.
    resting: u64,
    /// Files that are being written, with their bytes so far.
    growing: BTreeMap<u64, (PathBuf, u64)>,
    next: u64,
}

/// A recording that takes its bytes as it grows; they are counted for as long as its file is there.
pub(crate) struct Growing {
    recordings: Arc<Recordings>,
    allowance: Allowance,
    number: u64,
    /// Bytes of the file in whose place it comes.
    replaced: u64,
}

/// Begins a recording; nobody has a quota where `bytes_max` is `None`.
///
/// # Errors
/// How many bytes there are, when there is no room for more.
pub(super) fn begin(
    recordings: &Arc<Recordings>,
    allowance: Allowance,
    bytes_max: Option<u64>,
    folder: &Path,
    path: &Path,
) -> Result<Growing, u64> {
    // Whoever writes meanwhile waits, so that no piece is counted twice or not at all.
    let mut bytes = recordings.lock();
    bytes.max = bytes_max.unwrap_or(u64::MAX);
    let grows = |path: &Path| bytes.growing.values().any(|(other, _)| other == path);
    let resting = bytes_max.map_or(0, |_| bytes_in(folder, |path| !grows(path)));
    let is_counted = bytes_max.is_some() && path.starts_with(folder) && !grows(path);
    let replaced = match fs::symlink_metadata(path) {
        Ok(about) if is_counted && about.is_file() => about.len(),
        _ => 0,
    };
    bytes.resting = resting;
    let there = bytes.all().saturating_sub(replaced);
    if there >= bytes.max {
        return Err(there);
    }
    let number = bytes.next;
    bytes.next += 1;
    bytes.growing.insert(number, (path.to_owned(), 0));
    let recordings = Arc::clone(recordings);
    Ok(Growing { recordings, allowance, number, replaced })
}

impl Bytes {
    fn all(&self) -> u64 {
        self.resting + self.growing.values().map(|(_, bytes)| bytes).sum::<u64>()
    }
}

impl Recordings {
    fn lock(&self) -> MutexGuard<'_, Bytes> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Growing {
    /// The file in whose place it comes is empty now.
    pub(crate) fn replace(&mut self) {
        let mut bytes = self.recordings.lock();
        bytes.resting = bytes.resting.saturating_sub(std::mem::take(&mut self.replaced));
    }

    /// Whether it may have so many bytes more, which are counted then.
    pub(crate) fn take(&self, more: u64) -> bool {
        let mut bytes = self.recordings.lock();
        let fits = bytes.all().saturating_add(more) <= bytes.max;
        if !fits {
            drop(bytes);
            self.allowance.refuse_recording();
        } else if let Some((_, own)) = bytes.growing.get_mut(&self.number) {
            *own += more;
        }
        fits
    }

    /// Bytes that were not written.
    pub(crate) fn give_back(&self, less: u64) {
        if let Some((_, own)) = self.recordings.lock().growing.get_mut(&self.number) {
            *own = own.saturating_sub(less);
        }
    }
}

impl Drop for Growing {
    fn drop(&mut self) {
        let mut bytes = self.recordings.lock();
        if let Some((_, own)) = bytes.growing.remove(&self.number) {
            bytes.resting += own;
        }
    }
}

/// Of files in a folder and the folders in it that count; what cannot be read counts nothing.
fn bytes_in(folder: &Path, counts: impl Fn(&Path) -> bool) -> u64 {
    let (mut bytes, mut folders) = (0, vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            match entry.metadata() {
                Ok(about) if about.is_dir() => folders.push(entry.path()),
                Ok(about) if counts(&entry.path()) => bytes += about.len(),
                _ => {}
            }
        }
    }
    bytes
}
