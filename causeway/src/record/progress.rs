//! How far long work has come, for people who wait.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

/// Who waits less long is told nothing.
const SILENCE: Duration = Duration::from_secs(2);

/// Work that is under way.
pub(super) struct Progress {
    what: &'static str,
    /// In seconds of the recording; endless where nobody knows.
    total_secs: f64,
    done_secs: f64,
    begun: Instant,
    told: Instant,
}

impl Progress {
    /// Work on so many seconds of a recording.
    pub(super) fn new(what: &'static str, total_secs: f64) -> Self {
        let now = Instant::now();
        Self { what, total_secs, done_secs: 0.0, begun: now, told: now }
    }

    /// Tells, now and then.
    pub(super) fn reach(&mut self, done_secs: f64) {
        self.done_secs = done_secs;
        if self.told.elapsed() < SILENCE {
            return;
        }
        self.told = Instant::now();
        let percent = 100.0 * done_secs / self.total_secs.max(f64::EPSILON);
        let share =
            if self.total_secs.is_finite() { format!(", {percent:.0} %") } else { String::new() };
        let text = format!("{}: {done_secs:.1} s{share}, {:.0} ×", self.what, self.speed());
        if stderr().is_terminal() {
            eprint!("\r{text}    ");
        } else {
            eprintln!("{text}");
        }
    }

    /// How much faster than the recorded time the work is.
    pub(super) fn speed(&self) -> f64 {
        self.done_secs / self.begun.elapsed().as_secs_f64().max(1e-9)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.told > self.begun && stderr().is_terminal() {
            eprintln!();
        }
    }
}
