//! The signals that ask a process to end, in one place for all processes of a site.

use std::io;

use tokio::signal::unix::{Signal, SignalKind, signal};

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
    use rustix::process::{Signal, getpid, kill_process};

    use super::*;

    #[tokio::test]
    async fn each_of_them_is_noticed_also_when_it_came_before_anybody_waited() {
        let mut termination = Termination::follow().unwrap();
        for signal in [Signal::INT, Signal::TERM] {
            kill_process(getpid(), signal).unwrap();
            termination.requested().await;
        }
    }
}
