//! Requests for several ticks: done one tick at a time, so that other worlds get their turn.

use std::time::Instant;

use schemas::{Error, ErrorCode, Reply, WorldId};

use super::hosted::Hosted;
use super::inbox::{JOBS_MAX, WorldWork};
use super::shared_clock::Waiter;
use super::tick::Progress;
use super::{Answer, Outlet, Simulation};

/// A request under way, and who waits for it.
pub(super) struct Run {
    waiter: Waiter,
    progress: Progress,
}

/// What must wait until the request under way is over.
pub(super) enum Deferred {
    /// Further ticks.
    Tick(Waiter),
    /// Anything else about the world.
    Work(WorldWork, Answer),
}

impl Run {
    pub(super) fn into_waiter(self) -> Waiter {
        self.waiter
    }
}

impl Deferred {
    pub(super) fn refuse(self, error: Error) {
        match self {
            Self::Tick(waiter) => waiter.give(Err(error)),
            Self::Work(_, answer) => answer(Reply::Error(error)),
        }
    }
}

impl<S: Simulation> Hosted<S> {
    /// Whether a request is under way.
    pub(super) fn is_running(&self) -> bool {
        self.run.is_some()
    }

    /// Applies the commands of a checked request for several ticks.
    pub(super) fn begin(&mut self, waiter: Waiter) {
        let begun = self.with(waiter.world(), |world| Ok(Progress::begin(world, &waiter.item)));
        match begun {
            Ok(progress) => self.run = Some(Run { waiter, progress }),
            Err(error) => waiter.give(Err(error)),
        }
    }

    /// Does one tick of the request under way, and answers it after its last.
    pub(super) fn go_on(&mut self, id: WorldId, outlet: &impl Outlet<S>) {
        let Some(Run { waiter, mut progress }) = self.run.take() else { return };
        let (item, begun) = (&waiter.item, Instant::now());
        let advanced = self.with_tenant(id, |world, tenant| {
            progress.advance(world, tenant, item, outlet)?;
            let is_over = progress.is_over(item);
            Ok(if is_over { Ok(progress.outcome(world)) } else { Err(progress) })
        });
        outlet.ticked(self.note_tick(begun));
        match advanced {
            Ok(Err(progress)) => self.run = Some(Run { waiter, progress }),
            Ok(Ok(outcome)) => waiter.give(Ok(outcome)),
            Err(error) => waiter.give(Err(error)),
        }
    }

    /// Keeps what must wait for the request under way.
    pub(super) fn defer(&mut self, deferred: Deferred) {
        if self.deferred.len() < JOBS_MAX {
            self.deferred.push_back(deferred);
        } else {
            deferred.refuse(too_many());
        }
    }
}

/// Why no more waits for a world.
pub(super) fn too_many() -> Error {
    Error::new(ErrorCode::Capacity, "too many requests wait for the world")
        .wanted(format_args!("at most {JOBS_MAX}"))
}
