//! Where jobs wait between the bus's thread and the drawing thread.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use bus::Incoming;
use schemas::{Error, ErrorCode, RenderJob};

use super::fair_queue::FairQueue;

/// Jobs that may wait; more are refused.
pub(crate) const JOBS_MAX: usize = 256;
/// Jobs that came in and were not decoded yet; more are refused.
const UNREAD_MAX: usize = 256;

/// A job and whom to answer.
pub(crate) struct Task {
    pub(crate) job: RenderJob,
    pub(crate) incoming: Incoming,
}

/// Filled by the bus's thread, emptied by the drawing thread.
pub(crate) struct JobQueue {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    unread: Vec<Incoming>,
    waiting: FairQueue<Task>,
    open: bool,
}

impl Default for JobQueue {
    fn default() -> Self {
        let state = State { unread: Vec::new(), waiting: FairQueue::new(JOBS_MAX), open: true };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }
}

impl JobQueue {
    /// Takes a job in, or refuses it. Never waits for a drawing.
    pub(crate) fn put(&self, incoming: Incoming) {
        let mut state = self.lock();
        let refusal = if !state.open {
            Error::new(ErrorCode::RendererUnavailable, "the renderer is ending")
        } else if state.unread.len() >= UNREAD_MAX {
            Error::new(ErrorCode::Capacity, "too many pictures are waiting to be drawn")
                .wanted(format_args!("at most {UNREAD_MAX} new jobs"))
        } else {
            state.unread.push(incoming);
            drop(state);
            self.changed.notify_one();
            return;
        };
        drop(state);
        incoming.refuse(refusal);
    }

    /// Waits for jobs and takes up to `count_max` of them, tenants in turn, and no more once they
    /// have so many pixels: whoever comes then waits for all that were taken. `None` when closed.
    pub(crate) fn take(&self, count_max: usize, pixels_max: usize) -> Option<Vec<Task>> {
        let mut refused = Vec::new();
        let mut state = self.lock();
        while state.open && state.unread.is_empty() && state.waiting.is_empty() {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if !state.open {
            return None;
        }
        let unread = std::mem::take(&mut state.unread);
        drop(state);
        let mut read = Vec::with_capacity(unread.len());
        for incoming in unread {
            match incoming.render_job() {
                Ok(job) => read.push(Task { job, incoming }),
                Err(error) => refused.push((incoming, error)),
            }
        }
        let mut state = self.lock();
        for task in read {
            if let Err((task, error)) = state.waiting.push(task.job.tenant.clone(), task) {
                refused.push((task.incoming, error));
            }
        }
        let tasks = state.waiting.pop_some(count_max, pixels_max, |task| pixels_of(&task.job));
        drop(state);
        for (incoming, error) in refused {
            incoming.refuse(error);
        }
        Some(tasks)
    }

    /// Jobs that wait.
    pub(crate) fn waiting(&self) -> usize {
        let state = self.lock();
        state.unread.len() + state.waiting.len()
    }

    /// Refuses everything that waits and all that comes.
    pub(crate) fn close(&self) {
        let mut state = self.lock();
        state.open = false;
        let mut waiting: Vec<Incoming> = std::mem::take(&mut state.unread);
        waiting.extend(std::iter::from_fn(|| state.waiting.pop()).map(|task| task.incoming));
        drop(state);
        self.changed.notify_all();
        for incoming in waiting {
            incoming.refuse(Error::new(ErrorCode::RendererUnavailable, "the renderer is ending"));
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Pixels of all pictures of a job.
pub(crate) fn pixels_of(job: &RenderJob) -> usize {
    job.cameras.iter().map(|camera| camera.width_px as usize * camera.height_px as usize).sum()
}
