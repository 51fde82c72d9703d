//! The world of an episode outlives its service: what is done in it is kept, and done again in
//! another one when the service is gone.

use std::sync::Arc;
use std::time::Duration;

use recording::JournalLink;
use schemas::{
    Command, EncodedFrame, Error, ErrorCode, Lease, Reply, Request, SharedFrame, TickItem, WorldId,
};
use tokio::time::Instant;
use worlds::{Budget, Maker, NewWorld, RECOVERY_TICKS, Recovery, Remade, Seen, State};

use super::worlds::{first_result, unexpected_answer};
use super::{Endpoint, journal};
use crate::recorder::JournalNames;
use crate::site::Site;

/// Before a world is moved again that could not be.
const MOVE_AGAIN: Duration = Duration::from_secs(1);

/// How long a world that is gone waits for a service with room.
const ROOM_WAIT: Duration = Duration::from_secs(20);
/// Before services are asked again that had none.
const ROOM_PAUSE: Duration = Duration::from_millis(500);

/// What it takes to make the present world again.
pub(super) struct Keep {
    /// Of all endpoints of the process.
    budget: Arc<Budget>,
    /// `None`: there is no room for it, or no world, or what was done in it is not known.
    recovery: Option<Recovery>,
    /// Ticks since there was none, or since none could be had.
    bare_ticks: u32,
    /// Somebody was told that there is no room.
    is_room_missed: bool,
    /// When the world is moved again that could not be.
    move_again_at: Option<Instant>,
}

impl Keep {
    /// Nothing yet.
    pub(super) fn new(budget: Arc<Budget>) -> Self {
        Self { budget, recovery: None, bare_ticks: 0, is_room_missed: false, move_again_at: None }
    }

    /// A world begins.
    pub(super) fn begin(&mut self, new: NewWorld) {
        self.go_on_from(State::New(new));
    }

    /// The world is gone for good.
    pub(super) fn end(&mut self) {
        self.recovery = None;
        self.bare_ticks = 0;
    }

    /// Something may have been done that is not noted: only a new state is sure, after the next
    /// tick.
    pub(super) fn doubt(&mut self) {
        self.recovery = None;
        self.bare_ticks = RECOVERY_TICKS;
    }

    /// Keeps what was done.
    pub(super) fn note(&mut self, commands: Vec<Command>, tick_count: u32, dt_secs: Option<f64>) {
        let Some(recovery) = &mut self.recovery else {
            self.bare_ticks = self.bare_ticks.saturating_add(tick_count);
            return;
        };
        if !recovery.note(commands, tick_count, dt_secs) {
            self.recovery = None;
            self.note_room();
        }
    }

    /// Whether much has been done since the state, or since there was none.
    fn is_due(&self) -> bool {
        match &self.recovery {
            Some(recovery) => recovery.is_long_with(&[], 0),
            None => self.bare_ticks >= RECOVERY_TICKS,
        }
    }

    /// No new state could be had; it is asked for again after as much again.
    fn miss(&mut self) {
        self.bare_ticks = 0;
        self.recovery.as_mut().map(Recovery::miss);
    }

    /// Says once that there is no room, until there was some again.
    fn note_room(&mut self) {
        let is_missed = self.recovery.is_none();
        if is_missed && !self.is_room_missed {
            tracing::warn!("no room to make this world again");
        }
        self.is_room_missed = is_missed;
        self.bare_ticks = 0;
    }

    /// Its room first, which the new state may need.
    fn go_on_from(&mut self, state: State) {
        self.recovery = None;
        self.recovery = Recovery::new(state, &self.budget);
        self.note_room();
    }
}

/// Where worlds are made again.
struct Fresh<'a> {
    site: &'a Arc<dyn Site>,
    lease: Lease,
    /// Those of the journals that go on beside a recording, one for each attempt.
    journals: Option<Arc<JournalNames>>,
}

/// A world that nobody uses yet: it is destroyed when this is dropped.
struct FreshWorld {
    site: Arc<dyn Site>,
    world: WorldId,
    /// Of all that was done in it, also of what is only repeated.
    journal: Option<JournalLink>,
    is_used: bool,
}

impl FreshWorld {
    /// It is used from now on.
    fn take(mut self) -> (WorldId, Option<JournalLink>) {
        self.is_used = true;
        (self.world, self.journal.take())
    }
}

impl Drop for FreshWorld {
    fn drop(&mut self) {
        if !self.is_used {
            destroy_later(Arc::clone(&self.site), self.world);
        }
    }
}

/// Frees a world while nobody waits for it.
pub(super) fn destroy_later(site: Arc<dyn Site>, world: WorldId) {
    tokio::spawn(async move {
        if let Err(error) = site.ask(Request::DestroyWorld { world }).await {
            tracing::debug!(%error, "a world could not be destroyed");
        }
    });
}

impl Maker for Fresh<'_> {
    type World = FreshWorld;

    /// Runs to its end even if the caller gives up, so that no world is made that nobody frees.
    async fn make(&self, state: &State) -> Result<(EncodedFrame, FreshWorld), Error> {
        let lease = self.lease.clone();
        let request = match state.clone() {
            State::New(new) => new.request(lease),
            State::Snapshot(snapshot) => Request::RestoreWorld { snapshot, lease: Some(lease) },
        };
        let (site, name) = (Arc::clone(self.site), self.journals.as_ref().map(|it| it.next()));
        let made = tokio::spawn(async move {
            let Reply::WorldCreated { world, frame, .. } = site.ask(request).await? else {
                return Err(unexpected_answer());
            };
            let mut fresh = FreshWorld { site, world, journal: None, is_used: false };
            if let Some(name) = name {
                fresh.journal = journal::begin(&*fresh.site, world, name).await;
            }
            Ok((frame, fresh))
        });
        made.await.unwrap_or_else(|_| Err(unexpected_answer()))
    }

    fn id(world: &FreshWorld) -> WorldId {
        world.world
    }

    async fn tick(&self, item: TickItem) -> Result<EncodedFrame, Error> {
        let ticked = self.site.ask(Request::TickWorlds(vec![item])).await?;
        Ok(first_result(ticked)?.frame)
    }
}

fn has_no_room<W>(remade: &Remade<W>) -> bool {
    matches!(remade, Remade::Later(error) if error.code == ErrorCode::Capacity)
}

fn millis_since(begun: Instant) -> u64 {
    begun.elapsed().as_millis() as u64
}

impl Endpoint {
    /// Makes the world of the episode again, as clients saw it last; whether it could be.
    pub(super) async fn come_back(&mut self, why: &Error) -> bool {
        if self.visit.is_some() {
            return self.follow_session(why).await;
        }
        // A second loss meanwhile is not made good by this.
        let Some(recovery) = self.keep.recovery.take() else { return false };
        let Some(seen) = self.episode.as_ref().map(|episode| episode.frame.clone()) else {
            return false;
        };
        tracing::warn!(port = self.port, %why, "a world is made again");
        let begun = Instant::now();
        let fresh = self.fresh();
        let until = Instant::now() + ROOM_WAIT;
        let mut remade = recovery.remake(&fresh, Seen::Alone(&seen)).await;
        // One that drains has no room either, and another may be about to come.
        while has_no_room(&remade) && Instant::now() < until {
            tokio::time::sleep(ROOM_PAUSE).await;
            remade = recovery.remake(&fresh, Seen::Alone(&seen)).await;
        }
        match remade {
            Remade::Whole(fresh) => {
                let Some(episode) = &mut self.episode else { return false };
                let (world, journal) = fresh.take();
                // What may be left of the old one is freed as soon as it can be.
                let old = std::mem::replace(&mut episode.world, world);
                destroy_later(Arc::clone(&self.site), old);
                self.keep.recovery = Some(recovery);
                self.note_journal(journal);
                self.figures.recovered.inc();
                let (tenant, millis) = (self.config.allowance.tenant(), millis_since(begun));
                tracing::info!(target: "audit", %tenant, port = self.port, millis, "recover world");
                true
            }
            Remade::Later(error) | Remade::Never(error) => {
                tracing::warn!(port = self.port, %error, "a world could not be made again");
                false
            }
        }
    }

    fn fresh(&self) -> Fresh<'_> {
        Fresh { site: &self.site, lease: self.config.lease(), journals: self.next_journals() }
    }

    /// Moves the world to another service if the one that has it ends and another is there.
    pub(crate) async fn move_away(&mut self) {
        let begun = Instant::now();
        if self.keep.move_again_at.is_some_and(|at| begun < at) {
            return;
        }
        self.keep.move_again_at = None;
        let Some(old) = self.episode.as_ref().map(|episode| episode.world) else { return };
        // A world of a session moves with that one.
        if self.lost.is_some() || self.visit.is_some() || !self.site.should_move(old) {
            return;
        }
        match self.moved(old).await {
            Ok((fresh, state)) => {
                let Some(episode) = &mut self.episode else { return };
                let journal;
                (episode.world, journal) = fresh.take();
                destroy_later(Arc::clone(&self.site), old);
                self.keep.go_on_from(state);
                self.note_journal(journal);
                self.figures.move_seconds.observe(begun.elapsed());
                let (tenant, millis) = (self.config.allowance.tenant(), millis_since(begun));
                tracing::info!(target: "audit", %tenant, port = self.port, millis, "move world");
            }
            Err(error) => {
                tracing::warn!(port = self.port, %error, "a world could not be moved");
                self.keep.move_again_at = Some(Instant::now() + MOVE_AGAIN);
            }
        }
    }

    /// When a world is moved again that could not be.
    pub(crate) fn move_again_at(&self) -> Option<Instant> {
        self.keep.move_again_at
    }

    /// A world on another service that is as clients saw theirs last.
    async fn moved(&self, old: WorldId) -> Result<(FreshWorld, State), Error> {
        let Some(episode) = &self.episode else { return Err(unexpected_answer()) };
        let snapshot = self.site.ask(Request::SnapshotWorld { world: old }).await?;
        let Reply::Snapshot(bytes) = snapshot else { return Err(unexpected_answer()) };
        let state = State::Snapshot(bytes);
        let (frame, world) = self.fresh().make(&state).await?;
        let frame = SharedFrame::decode(frame)?;
        if Seen::Alone(&episode.frame).fits(&frame) {
            return Ok((world, state));
        }
        Err(Error::new(ErrorCode::Internal, "the world went another way"))
    }

    /// Keeps the present state, from which less has to be repeated than from the one before.
    pub(super) async fn keep_state(&mut self) {
        let Some(world) = self.episode.as_ref().map(|episode| episode.world) else { return };
        match self.site.ask(Request::SnapshotWorld { world }).await {
            Ok(Reply::Snapshot(bytes)) => self.keep.go_on_from(State::Snapshot(bytes)),
            Ok(_) => tracing::warn!("the world service answered something else"),
            Err(error) => {
                tracing::debug!(%error, "no state of a world to go on from");
                self.keep.miss();
            }
        }
    }

    /// The same, when much has been done since the one before.
    pub(super) async fn keep_state_if_due(&mut self) {
        if self.visit.is_none() && self.keep.is_due() {
            self.keep_state().await;
        }
    }
}
