//! The signals that ask a process to end, in one place for all processes of a site, and what it
//! still does then.

use std::io;
use std::time::Duration;

use monitoring::Monitor;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::{Instant, sleep_until};

/// Between two looks at what is left.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Between two lines that tell what is left.
const TELL_EVERY: Duration = Duration::from_secs(10);

/// Follows SIGINT and SIGTERM. SIGHUP keeps its meaning: it ends the process, or nothing under
/// `nohup`.
#[derive(Debug)]
pub struct Termination {
    interrupt: Signal,
    terminate: Signal,
}

impl Termination {
    /// Follows them from now on, inside a tokio runtime; neither ends the process by itself then.
    ///
    /// # Errors
    /// When the operating system takes no handler.
    pub fn follow() -> io::Result<Self> {
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
        })
    }

    /// Returns when the process is to end now: after the first signal it may take the window of its
    /// monitor to get rid of what is `left`, and takes nothing new; the second one ends that.
    /// `what` names it in the log, whose last line tells how much was lost.
    pub async fn drained(&mut self, monitor: &Monitor, what: &str, left: impl Fn() -> usize) {
        self.requested().await;
        let window = monitor.window();
        if window.is_zero() {
            return;
        }
        monitor.begin_end();
        let begun = Instant::now();
        tracing::info!(target: "audit", what, left = left(), secs = window.as_secs(), "drain to end");
        let mut told = begun;
        while left() > 0 && begun.elapsed() < window {
            if told.elapsed() >= TELL_EVERY {
                told = Instant::now();
                tracing::info!(left = left(), "waiting for {what}");
            }
            tokio::select! {
                () = sleep_until(Instant::now() + LOOK_EVERY) => {}
                () = self.requested() => break,
            }
        }
        tracing::info!(lost = left(), millis = begun.elapsed().as_millis() as u64, "drained");
    }

    /// Returns with the next of them. May be dropped and called again without losing one.
    pub async fn requested(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use rustix::process::{Signal, getpid, kill_process};

    use super::*;

    /// Longer than any machine takes for what a test waits for.
    const WINDOW: Duration = Duration::from_secs(600);

    #[tokio::test]
    async fn each_of_them_is_noticed_also_when_it_came_before_anybody_waited() {
        let mut termination = Termination::follow().unwrap();
        for signal in [Signal::INT, Signal::TERM] {
            kill_process(getpid(), signal).unwrap();
            termination.requested().await;
        }
    }

    fn terminate() {
        kill_process(getpid(), Signal::TERM).unwrap();
    }

    async fn until_it_drains(monitor: &Monitor) {
        let mut drain = monitor.follow_drain();
        drain.wait_for(|drain| drain.is_on()).await.unwrap();
    }

    #[tokio::test]
    async fn who_has_no_time_to_drain_ends_at_once_and_others_when_nothing_is_left() {
        let mut termination = Termination::follow().unwrap();
        terminate();
        let hasty = Monitor::new("world", "", Duration::ZERO);
        termination.drained(&hasty, "worlds", || 1).await;
        assert!(!hasty.is_draining());
        let (monitor, left) = (Monitor::new("world", "", WINDOW), AtomicUsize::new(1));
        terminate();
        let freeing = async {
            until_it_drains(&monitor).await;
            left.store(0, Ordering::Relaxed);
        };
        let count = || left.load(Ordering::Relaxed);
        let begun = Instant::now();
        tokio::join!(termination.drained(&monitor, "worlds", count), freeing);
        assert!(begun.elapsed() < WINDOW);
    }

    #[tokio::test]
    async fn a_second_signal_and_the_end_of_its_time_end_who_drains() {
        let mut termination = Termination::follow().unwrap();
        let monitor = Monitor::new("world", "", WINDOW);
        terminate();
        let again = async {
            until_it_drains(&monitor).await;
            terminate();
        };
        let begun = Instant::now();
        tokio::join!(termination.drained(&monitor, "worlds", || 1), again);
        assert!(begun.elapsed() < WINDOW);
        terminate();
        let brief = Monitor::new("world", "", Duration::from_millis(1));
        termination.drained(&brief, "worlds", || 1).await;
        assert!(brief.is_draining());
    }
}
