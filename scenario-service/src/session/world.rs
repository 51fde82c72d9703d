//! The world of an episode: what is done in it is done once, also when the service that has it
//! goes.

use std::sync::Arc;
use std::time::Instant;

use schemas::{Collision, Command, CommandReply, Error, ErrorCode, Frame, SharedFrame};
use schemas::{TickItem, TickOutcome, WorldId};

use worlds::{Maker, RECOVERY_TICKS, Recovery, Remade, Seen, State};

use super::clock::{self, Others};
use super::opened::{Opened, seen as as_seen};
use super::recovery::FreshWorlds;
use super::{SessionContext, ends_the_episode};
use crate::episode::Company;
use crate::world_port::collector::OwnedWorld;

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
    /// What else the driver should know, in sentences.
    pub(super) events: Vec<String>,
    /// In a shared world.
    pub(super) company: Option<Company>,
    /// What CARLA's clients load to come into the world.
    pub(super) carla_world: Option<String>,
}

/// Why nothing came of it.
#[derive(Clone)]
pub(super) enum Trouble {
    /// A command was refused; the world is as it was.
    Refused(Error),
    /// The world is gone and cannot be made again now, but later.
    Absent(Error),
    /// The world is gone for good.
    Gone(Error),
    /// The port; whether the world is still there follows from the code.
    World(Error),
    /// Who made the shared world has begun another episode.
    Ended,
}

impl Trouble {
    /// Whether nothing can be done in the world any more.
    pub(super) fn is_for_good(&self) -> bool {
        match self {
            Self::Refused(_) | Self::Absent(_) => false,
            Self::Gone(_) | Self::Ended => true,
            Self::World(error) => ends_the_episode(error.code),
        }
    }
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
    /// Ticks since then, or since room was looked for again.
    bare_ticks: u32,
    /// Where CARLA's clients may come into it.
    opened: Option<Box<Opened>>,
}

impl EpisodeWorld {
    /// A world that has just been made; `state`: from what, if that can be repeated.
    pub(super) async fn new(
        owned: OwnedWorld,
        state: Option<State>,
        context: &SessionContext,
    ) -> Self {
        let owned = Some(owned);
        let mut world = Self { owned, recovery: None, bare_ticks: 0, opened: None };
        match state {
            Some(state) => world.recovery = Recovery::new(state, &context.recovery),
            None => _ = world.renew(context).await,
        }
        world
    }

    /// Has CARLA's clients come into the world if they like: they share its clock.
    ///
    /// # Errors
    /// Those of the port, or that the world is gone.
    pub(super) async fn open(&mut self, context: &SessionContext) -> Result<(), Error> {
        let Some(world) = self.owned.as_ref().map(OwnedWorld::id) else { return Err(gone()) };
        self.opened = Some(Box::new(Opened::begin(context, world).await?));
        Ok(())
    }

    pub(super) fn is_open(&self) -> bool {
        self.opened.is_some()
    }

    /// What CARLA's clients load to come into the world, if they may.
    pub(super) fn carla_world(&self) -> Option<String> {
        let world = self.owned.as_ref()?.id();
        self.opened.as_ref().map(|_| schemas::carla::name_of_world(world))
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
        let told = match self.owned.as_ref().map(OwnedWorld::id) {
            Some(world) => match self.try_work(&work, world, context, seen).await {
                Err(Trouble::World(error)) if self.may_come_back(error.code) => {
                    tracing::warn!(%world, %error, "a world is made again");
                    None
                }
                told => Some(told?),
            },
            None => None,
        };
        let told = match told {
            Some(told) => told,
            None => {
                let world = self.come_back(context, seen).await?;
                self.try_work(&work, world, context, seen).await?
            }
        };
        self.note(context, work).await;
        Ok(Told { carla_world: self.carla_world(), ..told })
    }

    async fn try_work(
        &mut self,
        work: &Work,
        world: WorldId,
        context: &SessionContext,
        seen: &Frame,
    ) -> Result<Told, Trouble> {
        if work.is_checked
            && let Some(refusal) = try_out(context, world, &work.commands).await?
        {
            return Err(Trouble::Refused(refusal));
        }
        let item = TickItem {
            commands: work.commands.clone(),
            expected_tick: Some(seen.tick),
            ..TickItem::new(world, work.tick_count)
        };
        let Some(opened) = self.opened.as_mut() else {
            return Ok(Told::of(context.ticker.tick(item).await?)?);
        };
        let mut others = Others::default();
        let together =
            clock::tick_together(&context.ticker, item, &opened.participant, &mut others);
        let told = together.await;
        match told {
            Ok(_) => opened.note_step(others),
            Err(_) => opened.note_broken_step(others),
        }
        told
    }

    /// Whether the world, if it is there, would carry out what is to be done.
    ///
    /// # Errors
    /// [`Trouble`]; the world has heard nothing.
    pub(super) async fn check(&self, context: &SessionContext, work: &Work) -> Result<(), Trouble> {
        let Some(owned) = &self.owned else { return Ok(()) };
        match try_out(context, owned.id(), &work.commands).await? {
            Some(refusal) => Err(Trouble::Refused(refusal)),
            None => Ok(()),
        }
    }

    /// Moves the world to another service if the one that has it ends and another is there: nothing
    /// is under way in it.
    ///
    /// # Errors
    /// Why it could not be; it should be tried again.
    pub(super) async fn move_away(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
    ) -> Result<(), Error> {
        let old = self.owned.as_ref().map(OwnedWorld::id);
        if self.opened.is_some() && old.is_none_or(|old| context.port.is_gone(old)) {
            return self.come_back_for_guests(context, seen).await;
        }
        let Some(old) = old.filter(|old| context.port.should_move(*old)) else { return Ok(()) };
        let begun = Instant::now();
        let (world, state) = moved(context, old, seen, self.opened.is_some()).await?;
        self.open_again(context, world.id()).await?;
        let (tenant, new) = (&context.tenant, world.id().get());
        tracing::debug!(target: "audit", %tenant, old = old.get(), new, "move world");
        // The old one is destroyed.
        self.owned = Some(world);
        if let Some(opened) = &mut self.opened {
            opened.note_kept();
        }
        // Its room first, which the new state may need.
        self.recovery = None;
        self.recovery = Recovery::new(state, &context.recovery);
        context.figures.move_seconds.observe(begun.elapsed());
        Ok(())
    }

    /// One that is slow is still there, and one that panics would panic again.
    fn may_come_back(&self, code: ErrorCode) -> bool {
        let is_elsewhere = matches!(code, ErrorCode::WrongTick | ErrorCode::InvalidMessage);
        (worlds::is_gone(code) || is_elsewhere) && self.recovery.is_some()
    }

    /// Lets go of the world, wherever it may be, and makes it again.
    async fn come_back(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
    ) -> Result<WorldId, Trouble> {
        self.owned = None;
        let Some(recovery) = &self.recovery else {
            let text = "no world service has it, and there was no room to keep it";
            return Err(Trouble::Gone(Error::new(ErrorCode::UnknownWorld, text)));
        };
        match recovery.remake(&FreshWorlds(context), as_seen(self.opened.as_deref(), seen)).await {
            Remade::Whole(owned) => {
                let world = owned.id();
                self.open_again(context, world).await.map_err(Trouble::Absent)?;
                self.owned = Some(owned);
                context.figures.recovered.inc();
                let (tenant, new) = (&context.tenant, world.get());
                tracing::debug!(target: "audit", %tenant, new, "recover world");
                Ok(world)
            }
            Remade::Later(error) => Err(Trouble::Absent(error)),
            Remade::Never(error) => Err(Trouble::Gone(error)),
        }
    }

    /// The same while nobody steps: guests wait for the world, which somebody has to make again. On
    /// errors it should be tried again.
    async fn come_back_for_guests(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
    ) -> Result<(), Error> {
        match self.come_back(context, seen).await {
            Err(Trouble::Absent(error)) => Err(error),
            // The next step says so, or that it is there.
            _ => Ok(()),
        }
    }

    async fn open_again(&self, context: &SessionContext, world: WorldId) -> Result<(), Error> {
        match &self.opened {
            Some(opened) => opened.again(context, world).await,
            None => Ok(()),
        }
    }

    /// Keeps what was done for the next time. Cancelled it keeps nothing, as if it had not been
    /// done.
    async fn note(&mut self, context: &SessionContext, work: Work) {
        // What guests do is not known here, only what comes of it.
        let is_behind = self.opened.as_deref().is_some_and(Opened::is_behind);
        if is_behind && self.renew(context).await {
            return;
        }
        let Some(recovery) = &mut self.recovery else {
            self.bare_ticks = self.bare_ticks.saturating_add(work.tick_count);
            if self.bare_ticks >= RECOVERY_TICKS {
                self.bare_ticks = 0;
                self.renew(context).await;
            }
            return;
        };
        if recovery.is_long_with(&work.commands, work.tick_count) {
            if self.renew(context).await {
                return;
            }
            self.recovery.as_mut().map(Recovery::miss);
        }
        let Some(recovery) = &mut self.recovery else { return };
        let Work { commands, tick_count, .. } = work;
        if !recovery.note(commands, tick_count, None) {
            tracing::debug!("no room to make this world again");
            self.recovery = None;
        }
    }

    /// The state of the world.
    ///
    /// # Errors
    /// Those of the port, or that the world is gone.
    pub(super) async fn snapshot(&self, context: &SessionContext) -> Result<Vec<u8>, Error> {
        match &self.owned {
            Some(owned) => context.port.snapshot(owned.id()).await,
            None => Err(gone()),
        }
    }

    /// Begins anew with the present state; whether it could be had.
    async fn renew(&mut self, context: &SessionContext) -> bool {
        let Some(owned) = &self.owned else { return false };
        match context.port.snapshot(owned.id()).await {
            Ok(bytes) => {
                // Its room first, which the new one may need.
                self.recovery = None;
                self.recovery = Recovery::new(State::Snapshot(bytes), &context.recovery);
                if let Some(opened) = &mut self.opened {
                    opened.note_kept();
                }
                true
            }
            Err(error) => {
                tracing::debug!(%error, "no state of a world to go on from");
                false
            }
        }
    }
}

/// A world on another service that is as one was seen last, and the state from which it goes on.
async fn moved(
    context: &Arc<SessionContext>,
    old: WorldId,
    seen: &Frame,
    has_guests: bool,
) -> Result<(OwnedWorld, State), Error> {
    let state = State::Snapshot(context.port.snapshot(old).await?);
    let (frame, world) = FreshWorlds(context).make(&state).await?;
    let frame = SharedFrame::decode(frame)?;
    let seen = if has_guests { Seen::WithOthers(seen) } else { Seen::Alone(seen) };
    if seen.fits(&frame) {
        return Ok((world, state));
    }
    Err(Error::new(ErrorCode::Internal, "the world went another way"))
}

impl Told {
    /// # Errors
    /// The frame cannot be read.
    pub(super) fn of(outcome: TickOutcome) -> Result<Self, Error> {
        let TickOutcome { frame, replies, collisions, .. } = outcome;
        let frame = SharedFrame::decode(frame)?;
        let (events, company, carla_world) = (Vec::new(), None, None);
        Ok(Self { frame, replies, collisions, events, company, carla_world })
    }
}

fn gone() -> Error {
    Error::new(ErrorCode::UnknownWorld, "the world of this episode is gone")
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
    let copy = context.collector.keep(context.port.fork(world).await?);
    let item = TickItem { commands: commands.to_vec(), ..TickItem::new(copy.id(), 0) };
    let outcome = context.ticker.tick(item).await?;
    Ok(outcome.replies.into_iter().find_map(Result::err))
}
