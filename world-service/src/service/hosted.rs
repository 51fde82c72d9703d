//! One world and what the service knows about it.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use schemas::{Command, Error, ErrorCode, Lease, Tenant, Tick, WorldId, WorldInfo};

use super::run::{Deferred, Run};
use super::{Recorded, Roster, Seat, Simulation, Waiter};

/// One world, whose it is, and whether it still may be touched.
pub struct Hosted<S> {
    /// Whose world.
    pub tenant: Tenant,
    map_name: String,
    lease: Option<Lease>,
    orphaned_since: Option<Instant>,
    /// The first of the worlds that it goes on from.
    pub(super) stands_for: Option<WorldId>,
    /// Whether others than the owner had something done since it was told last.
    is_changed_by_others: bool,
    pub(super) roster: Roster<Waiter>,
    pub(super) run: Option<Run>,
    /// What came for the world while a request was under way; in order.
    pub(super) deferred: VecDeque<Deferred>,
    /// What the last two ticks took.
    took: [Duration; 2],
    /// Ticks that take longer are slow.
    pub(super) slow: Duration,
    state: State<S>,
    seat: Seat,
}

enum State<S> {
    Healthy(Box<Recorded<S>>),
    Quarantined { reason: String, tick: Tick, actor_count: u32 },
}

impl<S: Simulation> Hosted<S> {
    /// A healthy world. One with a lease counts as orphaned until its owner is known to be up.
    pub fn new(tenant: Tenant, lease: Option<Lease>, world: S, seat: Seat) -> Self {
        seat.note_begin();
        let map_name = world.map().name.clone();
        let state = State::Healthy(Box::new(Recorded::new(world)));
        let (roster, deferred) = (Roster::default(), VecDeque::new());
        let (orphaned_since, stands_for, run, took) = (None, None, None, [Duration::ZERO; 2]);
        Self {
            tenant,
            map_name,
            lease,
            orphaned_since,
            stands_for,
            is_changed_by_others: false,
            roster,
            run,
            deferred,
            took,
            slow: Duration::MAX,
            state,
            seat,
        }
    }

    /// Whether its ticks take so long that others should not wait for one. One tick that took long
    /// may have been interrupted.
    pub(super) fn is_slow(&self) -> bool {
        self.took.iter().all(|took| *took > self.slow)
    }

    /// Notes when a tick began that is over now; gives what it took.
    pub(super) fn note_tick(&mut self, begun: Instant) -> Duration {
        self.took = [self.took[1], begun.elapsed()];
        self.took[1]
    }

    /// Works with the world; a panic or an error of [`ErrorCode::WorldQuarantined`] puts it aside
    /// for ever.
    ///
    /// # Errors
    /// [`ErrorCode::WorldQuarantined`], or what `work` refuses.
    pub(super) fn with<T>(
        &mut self,
        id: WorldId,
        work: impl FnOnce(&mut Recorded<S>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.with_tenant(id, |world, _| work(world))
    }

    /// As [`with`](Self::with), for work that tells whose world it is.
    pub(super) fn with_tenant<T>(
        &mut self,
        id: WorldId,
        work: impl FnOnce(&mut Recorded<S>, &Tenant) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let tenant = &self.tenant;
        let world = match &mut self.state {
            State::Healthy(world) => world,
            State::Quarantined { reason, tick, .. } => return Err(quarantined(id, *tick, reason)),
        };
        let (tick, actor_count) = (world.tick_number(), world.actor_count());
        // A broken world is dropped below and never seen again, so half-made changes harm nobody.
        let reason = match catch_unwind(AssertUnwindSafe(|| work(world, tenant))) {
            Ok(Err(error)) if error.code == ErrorCode::WorldQuarantined => error.message,
            Ok(result) => return result,
            Err(panic) => format!("panicked: {}", panic_text(panic.as_ref())),
        };
        tracing::error!(world = id.get(), tick = tick.0, reason, "a world is quarantined");
        self.seat.note_quarantine();
        let error = quarantined(id, tick, &reason);
        let aside = State::Quarantined { reason, tick, actor_count: actor_count as u32 };
        let broken = std::mem::replace(&mut self.state, aside);
        // Its own clean-up may panic too; a leak of one world is the lesser evil.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(broken)));
        Err(error)
    }

    /// What a list tells.
    pub(super) fn info(&self, id: WorldId) -> WorldInfo {
        let (tick, actor_count, reason) = match &self.state {
            State::Healthy(world) => (world.tick_number(), world.actor_count() as u32, None),
            State::Quarantined { reason, tick, actor_count } => {
                (*tick, *actor_count, Some(reason.clone()))
            }
        };
        WorldInfo {
            world: id,
            map: self.map_name.clone(),
            tick,
            actor_count,
            owner: self.owner().cloned(),
            quarantined: reason,
            stands_for: self.stands_for,
        }
    }

    /// Takes note of whether the owner is up.
    pub(super) fn note_owner(&mut self, now: Instant, is_up: impl Fn(&schemas::ServiceId) -> bool) {
        if let Some(lease) = &self.lease {
            let since = self.orphaned_since.unwrap_or(now);
            self.orphaned_since = if is_up(&lease.owner) { None } else { Some(since) };
        }
    }

    /// Who keeps it.
    pub(super) fn owner(&self) -> Option<&schemas::ServiceId> {
        self.lease.as_ref().map(|lease| &lease.owner)
    }

    /// Somebody has these commands carried out.
    pub(super) fn note_commands(&mut self, who: Option<&schemas::ServiceId>, commands: &[Command]) {
        self.is_changed_by_others |= !commands.is_empty() && who != self.owner();
    }

    /// Whether others than the owner had something done since this was asked last.
    pub(super) fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.is_changed_by_others)
    }

    /// When the lease of an orphan ends.
    pub(super) fn ends_at(&self) -> Option<Instant> {
        let millis = self.lease.as_ref()?.millis;
        Some(self.orphaned_since? + Duration::from_millis(u64::from(millis)))
    }

    /// When it must be looked at again, for its own lease or those of participants.
    pub(super) fn next_end(&self) -> Option<Instant> {
        [self.ends_at(), self.roster.next_end()].into_iter().flatten().min()
    }
}

/// Makes a world; a panic on the way is an error and leaves nothing behind.
///
/// # Errors
/// [`ErrorCode::Internal`] after a panic, or what `make` refuses.
pub(crate) fn guarded<T>(make: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    catch_unwind(AssertUnwindSafe(make)).unwrap_or_else(|panic| {
        Err(Error::new(ErrorCode::Internal, "the world panicked while it was made")
            .found(panic_text(panic.as_ref())))
    })
}

fn quarantined(id: WorldId, tick: Tick, reason: &str) -> Error {
    Error::new(ErrorCode::WorldQuarantined, format!("{id} was quarantined at {tick}: {reason}"))
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no text")
}
