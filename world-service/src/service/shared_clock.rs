//! Ticks of a world whose clock is shared: one tick, when all have asked for it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use schemas::{Error, ErrorCode, Reply, ServiceId, TickItem, TickOutcome, TickResult, WorldId};

use super::hosted::Hosted;
use super::run::Run;
use super::tick::{check_item, tick_world};
use super::{Gather, Outlet, Simulation};

/// A participant's tick that waits for the others'.
pub(super) struct Waiter {
    index: usize,
    pub(super) item: TickItem,
    gather: Arc<Gather<TickResult>>,
}

impl Waiter {
    /// With where the result goes.
    pub(super) fn new(index: usize, item: TickItem, gather: Arc<Gather<TickResult>>) -> Self {
        Self { index, item, gather }
    }

    pub(super) fn world(&self) -> WorldId {
        self.item.world
    }

    pub(super) fn give(self, outcome: Result<TickOutcome, Error>) {
        self.gather.give([(self.index, TickResult { world: self.item.world, outcome })]);
    }
}

impl<S: Simulation> Hosted<S> {
    /// Ticks of a world that may be shared: done, refused, kept until the others ask too, or, if
    /// they are several or slow, begun.
    pub(super) fn tick(&mut self, now: Instant, waiter: Waiter, outlet: &impl Outlet<S>) {
        let item = &waiter.item;
        // Commands alone take no time.
        let is_for_the_clock = item.tick_count > 0;
        let checked = match is_for_the_clock {
            true => self.roster.check(item.participant.as_ref()).and_then(|()| check_shared(item)),
            false => Ok(()),
        };
        let id = item.world;
        let checked =
            checked.and_then(|()| self.with(id, |world| check_item(&**world, &waiter.item)));
        if checked.is_ok() {
            self.note_commands(waiter.item.participant.as_ref(), &waiter.item.commands);
        }
        let participant = waiter.item.participant.clone().filter(|_| is_for_the_clock);
        match (checked, participant) {
            (Err(error), _) => waiter.give(Err(error)),
            (Ok(()), Some(name)) => {
                self.roster.wait(now, &name, waiter);
                self.advance(id, outlet);
            }
            (Ok(()), None) if waiter.item.tick_count > 1 => self.begin(waiter),
            (Ok(()), None) if waiter.item.tick_count == 1 && self.is_slow() => self.begin(waiter),
            (Ok(()), None) => {
                let outcome = self.tick_now(&waiter.item, outlet);
                let told = outcome.map(|outcome| self.with_others(&waiter, outcome));
                waiter.give(told);
            }
        }
    }

    /// A tick that waits for nobody.
    fn tick_now(&mut self, item: &TickItem, outlet: &impl Outlet<S>) -> Result<TickOutcome, Error> {
        let begun = Instant::now();
        let outcome =
            self.with_tenant(item.world, |world, tenant| tick_world(world, tenant, item, outlet));
        if item.tick_count > 0 {
            outlet.ticked(self.note_tick(begun));
        }
        outcome
    }

    /// Ticks once for all participants, if none is missing.
    fn advance(&mut self, id: WorldId, outlet: &impl Outlet<S>) {
        let waiters = self.roster.complete();
        if waiters.is_empty() {
            return;
        }
        let commands = waiters.iter().flat_map(|waiter| waiter.item.commands.clone()).collect();
        let together = TickItem { commands, ..TickItem::new(id, 1) };
        let outcome = self.tick_now(&together, outlet);
        let mut from = 0;
        for waiter in waiters {
            let to = from + waiter.item.commands.len();
            let own = outcome.clone().map(|outcome| {
                let replies = outcome.replies.get(from..to).unwrap_or_default().to_vec();
                self.with_others(&waiter, TickOutcome { replies, ..outcome })
            });
            from = to;
            waiter.give(own);
        }
    }

    /// What somebody is told: where it is the owner, of the others, too.
    fn with_others(&mut self, waiter: &Waiter, outcome: TickOutcome) -> TickOutcome {
        let name = waiter.item.participant.as_ref();
        let Some(owner) = self.owner().filter(|owner| name == Some(owner)) else {
            return outcome;
        };
        let guests = self.roster.others(owner);
        TickOutcome { guests, is_changed_by_others: self.take_changed(), ..outcome }
    }

    /// Somebody takes part in the clock from now on, or, without a lease, no more.
    ///
    /// # Errors
    /// `Capacity`, and `InvalidArgument` for others than the owner while that one does not.
    pub(super) fn share(
        &mut self,
        now: Instant,
        id: WorldId,
        (name, lease): (ServiceId, Option<Duration>),
        outlet: &impl Outlet<S>,
    ) -> Result<Reply, Error> {
        match lease {
            Some(lease) => {
                self.check_shares(&name)?;
                self.roster.join(now, name, lease)?;
            }
            None => {
                if let Some(waiter) = self.roster.leave(&name) {
                    let gone = Error::new(ErrorCode::InvalidArgument, "the participant has left");
                    waiter.give(Err(gone));
                }
                self.advance(id, outlet);
            }
        }
        Ok(Reply::Done)
    }

    /// Whether somebody may take part: where a world has an owner, with that one only, who could
    /// not tick it otherwise.
    ///
    /// # Errors
    /// `InvalidArgument`.
    fn check_shares(&self, name: &ServiceId) -> Result<(), Error> {
        let may = |owner: &ServiceId| owner == name || self.roster.has(owner);
        if self.owner().is_none_or(may) {
            return Ok(());
        }
        Err(Error::new(ErrorCode::InvalidArgument, "this world is not shared")
            .wanted("one whose owner takes part in its clock"))
    }

    /// Goes on without those who let the others wait for too long, and tells those who have waited
    /// for long themselves.
    pub(super) fn expire_participants(
        &mut self,
        now: Instant,
        id: WorldId,
        outlet: &impl Outlet<S>,
    ) {
        let gone = self.roster.expire(now);
        for name in &gone {
            tracing::warn!(world = id.get(), %name, "a participant is gone: its lease is over");
        }
        if !gone.is_empty() {
            self.advance(id, outlet);
        }
        for waiter in self.roster.take_overdue(now) {
            let text = "the others have not asked for the next tick yet; ask again";
            waiter.give(Err(Error::new(ErrorCode::TimedOut, text)));
        }
    }

    /// Tells those who wait that the world is no more.
    pub(super) fn dismiss(&mut self) {
        let ended = || Error::new(ErrorCode::UnknownWorld, "the world has ended");
        let running = self.run.take().map(Run::into_waiter);
        for waiter in self.roster.drain().into_iter().chain(running) {
            waiter.give(Err(ended()));
        }
        for deferred in std::mem::take(&mut self.deferred) {
            deferred.refuse(ended());
        }
    }
}

/// Everybody asks for the same: one tick of the world's own length.
fn check_shared(item: &TickItem) -> Result<(), Error> {
    if item.participant.is_none() || (item.tick_count == 1 && item.dt_secs.is_none()) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, "a shared clock goes on by single ticks")
        .wanted("one tick of the world's own length")
        .found(format_args!("{} ticks of {:?} s", item.tick_count, item.dt_secs)))
}
