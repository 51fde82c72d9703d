//! The world of an episode: what is done in it is done once, also when the service that has it
//! goes.

use std::sync::Arc;
use std::time::Duration;

use schemas::{Collision, Command, CommandReply, Error, ErrorCode, Frame, SharedFrame};
use schemas::{TickItem, TickOutcome, WorldId};

use super::SessionContext;
use super::recovery::{Base, Recovery};
use crate::limits::{RECOVERY_PATIENCE, REPEATED_TICK};
use crate::world_port::keeper::OwnedWorld;

/// What is to be done in a world.
pub(super) struct Work {
    pub(super) commands: Vec<Command>,
    pub(super) tick_count: u32,
    /// A refused command ends it before anything is done.
    pub(super) is_checked: bool,
}

/// What came of it.
pub(super) struct Told {
    pub(super) frame: SharedFrame,
    pub(super) replies: Vec<CommandReply>,
    pub(super) collisions: Vec<Collision>,
}

/// Why nothing came of it.
pub(super) enum Trouble {
    /// A command was refused; the world is as it was.
    Refused(Error),
    /// The world is gone and cannot be made again now, but later.
    Absent(Error),
    /// The world is gone for good.
    Gone(Error),
    /// The port; whether the world is still there follows from the code.
    World(Error),
}

impl From<Error> for Trouble {
    fn from(error: Error) -> Self {
        Self::World(error)
    }
}

/// The world of an episode.
pub(super) struct EpisodeWorld {
    /// `None`: it is gone, and has to be made again before anything is done in it.
    owned: Option<OwnedWorld>,
    /// `None`: there was no room for it.
    recovery: Option<Recovery>,
}

impl EpisodeWorld {
    /// A world that has just been made; `base`: from what, if that can be repeated.
    pub(super) async fn new(
        owned: OwnedWorld,
        base: Option<Base>,
        context: &SessionContext,
    ) -> Self {
        let mut world = Self { owned: Some(owned), recovery: None };
        match base {
            Some(base) => world.recovery = Recovery::new(base, &context.recovery),
            None => _ = world.renew(context).await,
        }
        world
    }

    /// Which world, if it is not gone.
    #[cfg(test)]
    pub(super) fn id(&self) -> Option<WorldId> {
        self.owned.as_ref().map(OwnedWorld::id)
    }

    /// Does something in the world, which is as `seen` shows it; if it is gone, in one that is
    /// made again.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(super) async fn advance(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
        work: Work,
    ) -> Result<Told, Trouble> {
        let told = match &self.owned {
            Some(owned) => match work.try_in(owned.id(), context, seen).await {
                Err(Trouble::World(error)) if self.may_come_back(error.code) => {
                    tracing::warn!(world = %owned.id(), %error, "a world is made again");
                    None
                }
                told => Some(told?),
            },
            None => None,
        };
        let told = match told {
            Some(told) => told,
            None => work.try_in(self.come_back(context, seen).await?, context, seen).await?,
        };
        self.note(context, work).await;
        Ok(told)
    }

    /// One that is slow is still there, and one that panics would panic again.
    fn may_come_back(&self, code: ErrorCode) -> bool {
        use ErrorCode::{InvalidMessage, UnknownWorld, Unreachable, WrongTick};
        let is_gone = matches!(code, UnknownWorld | Unreachable | WrongTick | InvalidMessage);
        is_gone && self.recovery.is_some()
    }

    /// Lets go of the world, wherever it may be, and makes it again.
    async fn come_back(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
    ) -> Result<WorldId, Trouble> {
        self.owned = None;
        let Some(recovery) = &self.recovery else { return Err(Trouble::Gone(gone())) };
        let more = REPEATED_TICK * recovery.ticks();
        let again = patiently(more, || recovery.remake(context, seen)).await;
        let again = again.map_err(|error| match is_passing(error.code) {
            true => Trouble::Absent(error),
            false => Trouble::Gone(error),
        })?;
        let owned = again.ok_or_else(|| Trouble::Gone(gone()))?;
        context.figures.recovered.inc();
        Ok(self.owned.insert(owned).id())
    }

    /// Keeps what was done for the next time. Cancelled it keeps nothing, as if it had not been
    /// done.
    async fn note(&mut self, context: &SessionContext, work: Work) {
        let Some(recovery) = &mut self.recovery else { return };
        if recovery.is_long_with(work.commands.len(), work.tick_count) {
            if self.renew(context).await {
                return;
            }
            self.recovery.as_mut().map(Recovery::miss);
        }
        let Some(recovery) = &mut self.recovery else { return };
        if !recovery.note(work.commands, work.tick_count) {
            tracing::debug!("no room to make this world again");
            self.recovery = None;
        }
    }

    /// Begins anew with the present state; whether it could be had.
    async fn renew(&mut self, context: &SessionContext) -> bool {
        let Some(owned) = &self.owned else { return false };
        match context.port.snapshot(owned.id()).await {
            Ok(bytes) => {
                // Its room first, which the new one may need.
                self.recovery = None;
                self.recovery = Recovery::new(Base::Snapshot(bytes), &context.recovery);
                true
            }
            Err(error) => {
                tracing::debug!(%error, "no state of a world to go on from");
                false
            }
        }
    }
}

/// Tries again while services come and go: a question that was on its way to one that died may
/// never be answered.
async fn patiently<T, F>(more: Duration, attempt: impl Fn() -> F) -> Result<T, Error>
where
    F: Future<Output = Result<T, Error>>,
{
    let mut last = gone();
    for patience in RECOVERY_PATIENCE {
        match tokio::time::timeout(patience + more, attempt()).await {
            Ok(Err(error)) if is_passing(error.code) && error.code != ErrorCode::Capacity => {
                last = error
            }
            Ok(done) => return done,
            Err(_) => {
                last = Error::new(ErrorCode::TimedOut, "the world was not made again in time")
            }
        }
    }
    Err(last)
}

/// Whether a later attempt may find another service, or room.
fn is_passing(code: ErrorCode) -> bool {
    use ErrorCode::{Capacity, TimedOut, UnknownWorld, Unreachable};
    matches!(code, TimedOut | Unreachable | UnknownWorld | Capacity)
}

fn gone() -> Error {
    Error::new(ErrorCode::UnknownWorld, "no world service has it, and it cannot be made again")
}

impl Work {
    async fn try_in(
        &self,
        world: WorldId,
        context: &SessionContext,
        seen: &Frame,
    ) -> Result<Told, Trouble> {
        if self.is_checked
            && let Some(refusal) = try_out(context, world, &self.commands).await?
        {
            return Err(Trouble::Refused(refusal));
        }
        let item = TickItem {
            commands: self.commands.clone(),
            expected_tick: Some(seen.tick),
            ..TickItem::new(world, self.tick_count)
        };
        let TickOutcome { frame, replies, collisions, .. } = context.ticker.tick(item).await?;
        Ok(Told { frame: SharedFrame::decode(frame)?, replies, collisions })
    }
}

/// Has a copy of the world carry out commands, without a tick; gives the first refusal. The world
/// itself hears nothing.
///
/// # Errors
/// Those of the port.
async fn try_out(
    context: &SessionContext,
    world: WorldId,
    commands: &[Command],
) -> Result<Option<Error>, Error> {
    let copy = context.keeper.keep(context.port.fork(world).await?);
    let item = TickItem { commands: commands.to_vec(), ..TickItem::new(copy.id(), 0) };
    let outcome = context.ticker.tick(item).await?;
    Ok(outcome.replies.into_iter().find_map(Result::err))
}
