//! Waiting for a client: looking for a moment, then asleep.
//!
//! Who sleeps is woken some ten microseconds late, and later on a processor that idles; a client
//! may take less from step to step. Who looks takes processor time meanwhile, so that it is done
//! only where it helps: not longer than sleeping costs, not after a long wait, and ever more rarely
//! while it is in vain. The client waits for a step in the same way.

use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec};

/// About what it takes to fall asleep and to be woken.
const LOOK: Duration = Duration::from_micros(20);
/// After a wait longer than this nobody looks.
const SHORT: Duration = Duration::from_micros(150);
/// Most waits without a look after one in vain.
const PAUSE_MAX: u32 = 256;

/// What there is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Woken {
    pub to_step: bool,
    pub asked: bool,
}

/// What the last waits were like.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    /// Waits without a look that are left, and how many there were after the last look in vain.
    left: u32,
    pause: u32,
}

impl Waiting {
    /// Waits for a step or a message.
    ///
    /// # Errors
    /// When the operating system fails.
    pub(crate) fn wait(&mut self, go: &OwnedFd, socket: &UnixStream) -> io::Result<Woken> {
        if self.looks() {
            let woken = look(go, socket)?;
            self.note_look(woken.is_some());
            if let Some(woken) = woken {
                return Ok(woken);
            }
        }
        let begun = Instant::now();
        loop {
            if let Some(woken) = poll(go, socket, None)? {
                self.note_sleep(begun.elapsed());
                return Ok(woken);
            }
        }
    }

    /// Whether to look before this wait.
    fn looks(&mut self) -> bool {
        let now = self.left == 0;
        self.left = self.left.saturating_sub(1);
        now
    }

    /// What was waited for was seen in time, or not.
    fn note_look(&mut self, seen: bool) {
        self.pause = if seen { 0 } else { (2 * self.pause).clamp(1, PAUSE_MAX) };
        self.left = self.pause;
    }

    /// It took so long asleep.
    fn note_sleep(&mut self, waited: Duration) {
        if waited > SHORT {
            self.left = self.left.max(1);
        }
    }
}

/// Looks for a moment for a step or a message.
fn look(go: &OwnedFd, socket: &UnixStream) -> io::Result<Option<Woken>> {
    let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
    let begun = Instant::now();
    while begun.elapsed() < LOOK {
        if let Some(woken) = poll(go, socket, Some(&at_once))? {
            return Ok(Some(woken));
        }
    }
    Ok(None)
}

/// What is there within a time, endless for `None`.
fn poll(go: &OwnedFd, socket: &UnixStream, within: Option<&Timespec>) -> io::Result<Option<Woken>> {
    let mut watched = [PollFd::new(go, PollFlags::IN), PollFd::new(socket, PollFlags::IN)];
    match rustix::event::poll(&mut watched, within) {
        Ok(_) | Err(rustix::io::Errno::INTR) => {}
        Err(error) => return Err(error.into()),
    }
    let [go, asked] = watched.map(|one| one.revents());
    let woken = Woken { to_step: go.contains(PollFlags::IN), asked: !asked.is_empty() };
    Ok((woken.to_step || woken.asked).then_some(woken))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often it looks in so many waits, each of which takes so long and a little more asleep.
    fn looks(waiting: &mut Waiting, waits: usize, took: Duration) -> usize {
        const WOKEN: Duration = Duration::from_micros(30);
        let one = |_: &usize| {
            let looks = waiting.looks();
            if looks {
                waiting.note_look(took < LOOK);
            }
            if !looks || took >= LOOK {
                waiting.note_sleep(took + WOKEN);
            }
            looks
        };
        (0..waits).filter(one).count()
    }

    #[test]
    fn quick_answers_are_looked_for_each_time() {
        assert_eq!(looks(&mut Waiting::default(), 1_000, Duration::from_micros(8)), 1_000);
    }

    #[test]
    fn slow_answers_are_looked_for_once_and_quick_ones_again_after_them() {
        let mut waiting = Waiting::default();
        assert_eq!(looks(&mut waiting, 1_000, Duration::from_millis(1)), 1);
        assert!(looks(&mut waiting, 1_000, Duration::from_micros(8)) > 990);
    }

    #[test]
    fn answers_that_come_a_little_too_late_are_looked_for_ever_more_rarely() {
        let mut waiting = Waiting::default();
        assert!(looks(&mut waiting, 512, Duration::from_micros(60)) < 10);
        assert!(looks(&mut waiting, 10_000, Duration::from_micros(60)) < 42);
    }
}
