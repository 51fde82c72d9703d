//! Where jobs and towns wait for the drawing thread.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bus::Incoming;
use schemas::{Error, ErrorCode};

use super::fair_queue::Whose;
use super::textures::FetchedTexture;
use super::towns::BuiltTown;

/// Jobs that may wait; more are refused.
pub(crate) const JOBS_MAX: usize = 256;
/// Jobs that came in and were not decoded yet; more are refused.
const UNREAD_MAX: usize = 256;

/// Filled by the bus's thread and by those who build towns, emptied by the drawing thread.
pub(crate) struct JobQueue {
    state: Mutex<State>,
    changed: Condvar,
    /// Jobs that the drawing thread has taken and nobody has answered.
    taken: AtomicUsize,
}

struct State {
    arrived: Arrived,
    is_woken: bool,
    is_open: bool,
}

/// What has come since the last look.
#[derive(Default)]
pub(crate) struct Arrived {
    /// Each with when it came.
    pub(crate) jobs: Vec<(Instant, Incoming)>,
    pub(crate) towns: Vec<BuiltTown>,
    pub(crate) textures: Vec<FetchedTexture>,
    /// What sessions have used outside the drawing thread, in nanoseconds.
    pub(crate) used: Vec<(Whose, u64)>,
}

/// How long the drawing thread waits when nothing has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wait {
    No,
    Until(Instant),
    Ever,
}

/// A job that the drawing thread has taken; dropped with its answer.
pub(crate) struct Taken(Arc<JobQueue>);

impl Drop for Taken {
    fn drop(&mut self) {
        self.0.taken.fetch_sub(1, Ordering::Relaxed);
        self.0.wake();
    }
}

impl Default for JobQueue {
    fn default() -> Self {
        let state = State { arrived: Arrived::default(), is_woken: false, is_open: true };
        Self { state: Mutex::new(state), changed: Condvar::new(), taken: AtomicUsize::default() }
    }
}

impl JobQueue {
    /// Takes a job in, or refuses it. Never waits for a drawing.
    pub(crate) fn put(&self, incoming: Incoming) {
        let mut state = self.lock();
        let refusal = if !state.is_open {
            is_ending()
        } else if state.arrived.jobs.len() >= UNREAD_MAX {
            Error::new(ErrorCode::Capacity, "too many pictures are waiting to be drawn")
                .wanted(format_args!("at most {UNREAD_MAX} new jobs"))
        } else {
            state.arrived.jobs.push((Instant::now(), incoming));
            drop(state);
            self.changed.notify_one();
            return;
        };
        drop(state);
        incoming.refuse(refusal);
    }

    /// Takes a town in that was asked for.
    pub(crate) fn put_town(&self, town: BuiltTown) {
        self.lock().arrived.towns.push(town);
        self.changed.notify_one();
    }

    /// Takes a texture in that was asked for.
    pub(crate) fn put_texture(&self, texture: FetchedTexture) {
        self.lock().arrived.textures.push(texture);
        self.changed.notify_one();
    }

    /// Takes in what a session has used outside the drawing thread.
    pub(crate) fn put_used(&self, whose: Whose, time: Duration) {
        let nanos = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        self.lock().arrived.used.push((whose, nanos));
    }

    /// Has the drawing thread look again at what waits.
    fn wake(&self) {
        self.lock().is_woken = true;
        self.changed.notify_one();
    }

    /// What has come. `None` when closed.
    pub(crate) fn take(&self, wait: Wait) -> Option<Arrived> {
        let mut state = self.lock();
        while state.is_open
            && !state.is_woken
            && state.arrived.jobs.is_empty()
            && state.arrived.towns.is_empty()
            && state.arrived.textures.is_empty()
        {
            state = match wait {
                Wait::No => break,
                Wait::Ever => self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                Wait::Until(at) => {
                    let left = at.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        break;
                    }
                    let waited = self.changed.wait_timeout(state, left);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
        state.is_woken = false;
        state.is_open.then(|| std::mem::take(&mut state.arrived))
    }

    /// Counts a job that the drawing thread has taken.
    pub(crate) fn note_taken(self: &Arc<Self>) -> Taken {
        self.taken.fetch_add(1, Ordering::Relaxed);
        Taken(Arc::clone(self))
    }

    /// Jobs that wait for their answer.
    pub(crate) fn waiting(&self) -> usize {
        self.lock().arrived.jobs.len() + self.taken.load(Ordering::Relaxed)
    }

    /// Refuses all that comes. What the drawing thread has taken it refuses itself.
    pub(crate) fn close(&self) {
        let mut state = self.lock();
        state.is_open = false;
        let waiting = std::mem::take(&mut state.arrived.jobs);
        drop(state);
        self.changed.notify_all();
        for (_, incoming) in waiting {
            incoming.refuse(is_ending());
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What those are told who come too late.
pub(crate) fn is_ending() -> Error {
    Error::new(ErrorCode::RendererUnavailable, "the renderer is ending")
}
