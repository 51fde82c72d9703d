//! Ends the test when one case takes too long or too much memory.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Longest time of one case.
pub(crate) const CASE_MAX: Duration = Duration::from_secs(40);
/// Most memory of the process, in bytes.
pub(crate) const MEMORY_MAX_BYTES: u64 = 2_500_000_000;

/// A thread that looks at the case under way, as an endless loop cannot be told from inside.
#[derive(Clone, Default)]
pub(crate) struct Watch {
    under_way: Arc<Mutex<Option<(String, Instant)>>>,
}

impl Watch {
    pub(crate) fn new() -> Self {
        let watch = Self::default();
        let watched = watch.clone();
        thread::spawn(move || {
            loop {
                thread::sleep(Duration::from_millis(20));
                watched.look();
            }
        });
        watch
    }

    /// Says what begins now.
    pub(crate) fn begin(&self, case: String) {
        *self.under_way.lock().unwrap_or_else(PoisonError::into_inner) =
            Some((case, Instant::now()));
    }

    fn look(&self) {
        let under_way = self.under_way.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((case, started)) = under_way.as_ref() else { return };
        let memory_bytes = resident_bytes("VmRSS:");
        if started.elapsed() > CASE_MAX || memory_bytes > MEMORY_MAX_BYTES {
            println!("{case}: {memory_bytes} bytes after {:?}", started.elapsed());
            std::process::exit(1);
        }
    }
}

/// A line of the process's memory figures, in bytes; 0 where the system does not tell.
pub(crate) fn resident_bytes(key: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok());
    kilobytes.unwrap_or(0_u64) * 1024
}

/// Forgets the largest memory so far (Linux), so that "VmHWM:" tells that of the next case.
pub(crate) fn forget_peak() {
    let _: Result<(), std::io::Error> = std::fs::write("/proc/self/clear_refs", "5");
}
