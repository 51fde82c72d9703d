//! What it takes to make the world of an episode again when the service that had it is gone: a
//! state of it, and all that was done since. The same commands give the same bits, so it is the
//! same world.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use schemas::{Command, EncodedFrame, Error, ErrorCode, Frame, TickItem};

use super::SessionContext;
use crate::limits::{RECOVERY_BYTES, RECOVERY_TICKS};
use crate::world_port::keeper::OwnedWorld;
use crate::world_port::{CreatedWorld, NewWorld};

/// Bytes that the episodes of a service may keep for it.
pub(crate) struct RecoveryBudget {
    bytes_max: usize,
    used: AtomicUsize,
}

impl RecoveryBudget {
    /// So many bytes; none: no world is made again.
    pub(crate) fn new(bytes_max: usize) -> Arc<Self> {
        Arc::new(Self { bytes_max, used: AtomicUsize::new(0) })
    }

    /// Bytes that are kept.
    pub(crate) fn used(&self) -> usize {
        self.used.load(Ordering::Relaxed)
    }
}

/// A part of the budget.
struct Share {
    budget: Arc<RecoveryBudget>,
    bytes: usize,
}

impl Share {
    fn none(budget: Arc<RecoveryBudget>) -> Self {
        Self { budget, bytes: 0 }
    }

    /// Whether there was room; without any nothing changes.
    fn grow(&mut self, bytes: usize) -> bool {
        let used = &self.budget.used;
        let before = used.fetch_add(bytes, Ordering::Relaxed);
        if before + bytes > self.budget.bytes_max {
            used.fetch_sub(bytes, Ordering::Relaxed);
            return false;
        }
        self.bytes += bytes;
        true
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        self.budget.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// A state from which a world goes on.
#[derive(Clone)]
pub(super) enum Base {
    /// Its first one.
    New(NewWorld),
    /// A later one.
    Snapshot(Vec<u8>),
}

/// What was done in one request.
struct Done {
    commands: Vec<Command>,
    tick_count: u32,
}

/// A state of a world, and all that was done since.
pub(super) struct Recovery {
    base: Base,
    done: Vec<Done>,
    ticks: u32,
    /// Of `done`.
    bytes: usize,
    /// How often no new state could be had.
    misses: usize,
    share: Share,
}

impl Recovery {
    /// `None` when the budget has no room for it.
    pub(super) fn new(base: Base, budget: &Arc<RecoveryBudget>) -> Option<Self> {
        let mut share = Share::none(Arc::clone(budget));
        let has_room = share.grow(base.bytes());
        has_room.then(|| Self { base, done: Vec::new(), ticks: 0, bytes: 0, misses: 0, share })
    }

    /// Notes what was done. `false`: there is no room for it, so that nothing can be made again.
    #[must_use]
    pub(super) fn note(&mut self, commands: Vec<Command>, tick_count: u32) -> bool {
        let bytes = Done::bytes(commands.len());
        self.ticks += tick_count;
        self.bytes += bytes;
        self.done.push(Done { commands, tick_count });
        self.share.grow(bytes)
    }

    /// Whether a new state should take the place of all this and so much more.
    pub(super) fn is_long_with(&self, commands: usize, tick_count: u32) -> bool {
        let ticks = self.ticks.saturating_add(tick_count) as usize;
        let bytes = self.bytes + Done::bytes(commands);
        let times = 1 + self.misses;
        ticks >= RECOVERY_TICKS as usize * times || bytes >= RECOVERY_BYTES * times
    }

    /// Notes that no new state could be had; it is asked for again after as much again.
    pub(super) fn miss(&mut self) {
        self.misses += 1;
    }

    /// Ticks that are repeated.
    pub(super) fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Makes the world again, on whichever service takes it. `None`: it is not as it was seen last.
    ///
    /// # Errors
    /// Those of the port.
    pub(super) async fn remake(
        &self,
        context: &Arc<SessionContext>,
        seen: &Frame,
    ) -> Result<Option<OwnedWorld>, Error> {
        let (first, world) = self.base.make(context).await?;
        let mut frame = schemas::SharedFrame::decode(first)?;
        for done in &self.done {
            let item = TickItem {
                commands: done.commands.clone(),
                expected_tick: Some(frame.tick),
                ..TickItem::new(world.id(), done.tick_count)
            };
            frame = schemas::SharedFrame::decode(context.ticker.tick(item).await?.frame)?;
        }
        let is_same = (frame.tick, frame.state_hash) == (seen.tick, seen.state_hash)
            && frame.map.digest == seen.map.digest;
        if is_same {
            return Ok(Some(world));
        }
        let of = |frame: &Frame| format!("tick {}, {:016x}", frame.tick.0, frame.state_hash);
        let (wanted, found) = (of(seen), of(&frame));
        tracing::error!(wanted, found, "a world that was made again went another way");
        Ok(None)
    }
}

impl Done {
    fn bytes(commands: usize) -> usize {
        size_of::<Self>() + commands * size_of::<Command>()
    }
}

impl Base {
    fn bytes(&self) -> usize {
        match self {
            Self::New(new) => size_of::<Self>() + new.commands.len() * size_of::<Command>(),
            Self::Snapshot(bytes) => size_of::<Self>() + bytes.len(),
        }
    }

    /// Runs to its end even if the caller is cancelled, so that no world is made that nobody owns.
    async fn make(
        &self,
        context: &Arc<SessionContext>,
    ) -> Result<(EncodedFrame, OwnedWorld), Error> {
        let (context, base) = (Arc::clone(context), self.clone());
        let made = tokio::spawn(async move {
            let CreatedWorld { world, frame, .. } = match base {
                Self::New(new) => context.port.create(new).await?,
                Self::Snapshot(bytes) => context.port.restore(bytes).await?,
            };
            Ok((frame, context.keeper.keep(world)))
        });
        let interrupted =
            |_| Err(Error::new(ErrorCode::Internal, "making a world again was interrupted"));
        made.await.unwrap_or_else(interrupted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_stays_within_the_budget_and_is_given_back() {
        let budget = RecoveryBudget::new(2_000);
        let snapshot = || Base::Snapshot(vec![0; 1_000]);
        let first = Recovery::new(snapshot(), &budget);
        assert!(first.is_some() && Recovery::new(snapshot(), &budget).is_none());
        let mut first = first.unwrap();
        while first.note(Vec::new(), 1) {}
        assert!(budget.used() <= 2_000);
        drop(first);
        assert_eq!(budget.used(), 0);
        assert!(Recovery::new(snapshot(), &RecoveryBudget::new(0)).is_none());
    }

    #[test]
    fn a_new_state_is_due_after_many_ticks() {
        let budget = RecoveryBudget::new(usize::MAX);
        let mut recovery = Recovery::new(Base::Snapshot(Vec::new()), &budget).unwrap();
        assert!(!recovery.is_long_with(0, RECOVERY_TICKS - 1));
        assert!(recovery.note(Vec::new(), RECOVERY_TICKS - 1));
        assert!(recovery.is_long_with(0, 1));
        recovery.miss();
        assert!(!recovery.is_long_with(0, 1) && recovery.is_long_with(0, RECOVERY_TICKS + 1));
    }
}
