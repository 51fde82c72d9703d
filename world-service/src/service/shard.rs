//! The worlds of one thread.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use schemas::{Command, CommandReply, EncodedFrame, Error, ErrorCode, Lease, Reply, ServiceId};
use schemas::{Tenant, WorldId, WorldInfo};

use super::hosted::guarded;
use super::inbox::{JOBS_MAX, WorldWork};
use super::run::{Deferred, too_many};
use super::tick::furnish;
use super::{
    Answer, Hosted, Ids, Job, NewJournal, NewWorld, Outlet, Recorded, Seats, Simulation, Waiter,
};
use crate::journal::{Head, Moment};

/// The worlds of one thread, and who of their owners is up.
pub struct Shard<S> {
    worlds: BTreeMap<WorldId, Hosted<S>>,
    owners_up: BTreeSet<ServiceId>,
    ids: Arc<Ids>,
    seats: Seats,
    /// Looked at before every job, so not searched for each time.
    next_end: Option<Instant>,
    /// Worlds with a request under way, in the order of their turns.
    running: VecDeque<WorldId>,
    away: Option<Away>,
    slow: Duration,
}

/// A world with a request under way, on its own for a tick.
pub struct Turn<S> {
    id: WorldId,
    world: Hosted<S>,
}

/// What is known here of a world that has its turn elsewhere.
struct Away {
    tenant: Tenant,
    info: WorldInfo,
    /// What has come for it meanwhile, in order.
    deferred: Vec<Deferred>,
}

impl Away {
    /// Keeps what must wait for the world's return.
    fn defer(&mut self, deferred: Deferred) {
        if self.deferred.len() < JOBS_MAX {
            self.deferred.push(deferred);
        } else {
            deferred.refuse(too_many());
        }
    }
}

impl<S: Simulation> Turn<S> {
    /// Does one tick of the request under way.
    pub fn go_on(&mut self, outlet: &impl Outlet<S>) {
        self.world.go_on(self.id, outlet);
    }
}

impl<S: Simulation> Shard<S> {
    /// No worlds. Ticks that take longer than `slow` are done one by one as requests for several
    /// are, so that others do not wait for them.
    pub fn new(ids: Arc<Ids>, seats: Seats, slow: Duration) -> Self {
        let (worlds, owners_up) = (BTreeMap::new(), BTreeSet::new());
        let running = VecDeque::new();
        Self { worlds, owners_up, ids, seats, next_end: None, running, away: None, slow }
    }

    /// Takes a world in.
    pub fn adopt(&mut self, now: Instant, id: WorldId, mut world: Hosted<S>) {
        world.note_owner(now, |owner| self.owners_up.contains(owner));
        world.slow = self.slow;
        self.next_end = [self.next_end, world.next_end()].into_iter().flatten().min();
        self.worlds.insert(id, world);
    }

    /// When the next lease ends, if no owner or participant comes back.
    pub fn next_end(&self) -> Option<Instant> {
        self.next_end
    }

    /// Ends the worlds whose lease is over, and goes on without participants whose lease is.
    pub fn expire_leases(&mut self, now: Instant, outlet: &impl Outlet<S>) {
        if self.next_end.is_none_or(|end| end > now) {
            return;
        }
        self.worlds.retain(|id, world| {
            let is_over = world.ends_at().is_some_and(|end| end <= now);
            if is_over {
                let (tenant, world_id) = (&world.tenant, id.get());
                let what = "a world ends with its lease: its owner is gone";
                tracing::info!(target: "audit", %tenant, world = world_id, "{what}");
                world.dismiss();
            }
            !is_over
        });
        for (id, world) in &mut self.worlds {
            world.expire_participants(now, *id, outlet);
        }
        self.find_next_end();
    }

    fn find_next_end(&mut self) {
        self.next_end = self.worlds.values().filter_map(Hosted::next_end).min();
    }

    /// Whether requests are under way; [`go_on`](Self::go_on) goes on with them.
    pub fn is_running(&self) -> bool {
        !self.running.is_empty()
    }

    /// Whether the request that is next in turn is one whose ticks take long.
    pub fn is_slow_next(&self) -> bool {
        self.running.front().and_then(|id| self.worlds.get(id)).is_some_and(Hosted::is_slow)
    }

    /// Does one tick of the request that is next in turn.
    pub fn go_on(&mut self, now: Instant, outlet: &impl Outlet<S>) {
        let Some(id) = self.running.pop_front() else { return };
        if let Some(hosted) = self.worlds.get_mut(&id) {
            hosted.go_on(id, outlet);
        }
        self.go_on_after(now, id, outlet);
    }

    /// Hands out the world that is next in turn, so that others need not wait for its tick; there
    /// is one at a time. What comes for it meanwhile waits.
    pub fn take_turn(&mut self) -> Option<Turn<S>> {
        if self.away.is_some() {
            return None;
        }
        let id = self.running.pop_front()?;
        let world = self.worlds.remove(&id)?;
        let (tenant, info) = (world.tenant.clone(), world.info(id));
        self.away = Some(Away { tenant, info, deferred: Vec::new() });
        Some(Turn { id, world })
    }

    /// Takes back what [`take_turn`](Self::take_turn) gave.
    pub fn give_back(&mut self, now: Instant, turn: Turn<S>, outlet: &impl Outlet<S>) {
        let Turn { id, mut world } = turn;
        for deferred in self.away.take().into_iter().flat_map(|away| away.deferred) {
            world.defer(deferred);
        }
        self.adopt(now, id, world);
        self.go_on_after(now, id, outlet);
    }

    /// Does what has waited for the last tick of a request, and gives the world its next turn.
    fn go_on_after(&mut self, now: Instant, id: WorldId, outlet: &impl Outlet<S>) {
        while let Some(hosted) = self.worlds.get_mut(&id).filter(|hosted| !hosted.is_running()) {
            match hosted.deferred.pop_front() {
                Some(Deferred::Tick(waiter)) => hosted.tick(now, waiter, outlet),
                Some(Deferred::Work(work, answer)) => self.work(now, id, work, answer, outlet),
                None => break,
            }
        }
        if self.worlds.get(&id).is_some_and(Hosted::is_running) {
            self.running.push_back(id);
        }
    }

    /// Does one job. Its answer is given before this returns, but for requests of several ticks,
    /// which only begin, those that come for such a world meanwhile, and those that wait for the
    /// other participants of a shared clock.
    pub fn handle(&mut self, now: Instant, job: Job<S>, outlet: &impl Outlet<S>) {
        match job {
            Job::Tick { tenant, items, gather } => {
                for (index, item) in items {
                    self.tick(
                        now,
                        tenant.as_ref(),
                        Waiter::new(index, item, Arc::clone(&gather)),
                        outlet,
                    );
                }
            }
            Job::World { tenant, world, work, answer } => {
                if let Some(away) = self.away(Some(&tenant), world) {
                    return away.defer(Deferred::Work(work, answer));
                }
                match find(&mut self.worlds, Some(&tenant), world) {
                    Ok(hosted) if hosted.is_running() => {
                        hosted.defer(Deferred::Work(work, answer));
                    }
                    Ok(_) => self.work(now, world, work, answer, outlet),
                    Err(error) => answer(Reply::Error(error)),
                }
            }
            Job::Create { new, tenant, commands, lease, seat, answer } => {
                let world = new.id;
                let reply = match furnished::<S>(new, &commands) {
                    Ok((simulation, frame, replies)) => {
                        self.adopt(now, world, Hosted::new(tenant, lease, simulation, seat));
                        Reply::WorldCreated { world, frame, replies }
                    }
                    Err(error) => Reply::Error(error),
                };
                answer(reply);
            }
            Job::List { tenant, index, gather } => {
                let own = self.worlds.iter().filter(|(_, world)| world.tenant == tenant);
                let away = self.away.iter().filter(|away| away.tenant == tenant);
                let infos = own.map(|(id, world)| world.info(*id));
                let infos = infos.chain(away.map(|away| away.info.clone()));
                gather.give([(index, infos.collect())]);
            }
            Job::Owner { id, is_up, now } => self.note_owner(now, id, is_up),
            Job::LookAgain | Job::Stop => {}
        }
    }

    fn tick(
        &mut self,
        now: Instant,
        tenant: Option<&Tenant>,
        waiter: Waiter,
        outlet: &impl Outlet<S>,
    ) {
        let id = waiter.world();
        if let Some(away) = self.away(tenant, id) {
            return away.defer(Deferred::Tick(waiter));
        }
        match find(&mut self.worlds, tenant, id) {
            Ok(hosted) if hosted.is_running() => hosted.defer(Deferred::Tick(waiter)),
            Ok(hosted) => {
                hosted.tick(now, waiter, outlet);
                if hosted.is_running() {
                    self.running.push_back(id);
                }
                let end = hosted.roster.next_end();
                self.next_end = [self.next_end, end].into_iter().flatten().min();
            }
            Err(error) => waiter.give(Err(error)),
        }
    }

    fn work(
        &mut self,
        now: Instant,
        id: WorldId,
        work: WorldWork,
        answer: Answer,
        outlet: &impl Outlet<S>,
    ) {
        let hosted = match find(&mut self.worlds, None, id) {
            Ok(hosted) => hosted,
            Err(error) => return answer(Reply::Error(error)),
        };
        let reply = match work {
            WorldWork::Destroy => {
                let mut ended = self.worlds.remove(&id);
                ended.iter_mut().for_each(Hosted::dismiss);
                // A world that breaks even while it ends must not take its neighbours along.
                let _ = catch_unwind(AssertUnwindSafe(|| drop(ended)));
                Ok(Reply::Done)
            }
            WorldWork::Snapshot => hosted.with(id, |world| Ok(Reply::Snapshot(world.snapshot()))),
            WorldWork::Commands(commands) => {
                hosted.note_commands(None, &commands);
                hosted.with(id, |world| Ok(Reply::CommandReplies(world.run(id, &commands))))
            }
            WorldWork::Look(question) => hosted.with(id, |world| world.answer(&question)),
            WorldWork::Share { participant, lease, stands_for } => {
                hosted.stands_for = stands_for.or(hosted.stands_for);
                let shared = hosted.share(now, id, (participant, lease), outlet);
                self.find_next_end();
                shared
            }
            WorldWork::Record { on: true, name } => hosted.with_tenant(id, |world, tenant| {
                record(world, (id, tenant), name.as_deref(), outlet)
            }),
            WorldWork::Record { on: false, .. } => {
                match hosted.with(id, |world| Ok(world.record(None))) {
                    Ok(Some(journal)) => {
                        return journal.end(Box::new(move || answer(Reply::Done)));
                    }
                    ended => ended.map(|_| Reply::Done),
                }
            }
            WorldWork::Fork { count, lease } => self.fork(id, count, lease, outlet),
        };
        answer(reply.unwrap_or_else(Reply::Error));
    }

    /// The world of this id, if it has its turn elsewhere.
    fn away(&mut self, tenant: Option<&Tenant>, id: WorldId) -> Option<&mut Away> {
        let is_it = |away: &&mut Away| {
            away.info.world == id && tenant.is_none_or(|tenant| away.tenant == *tenant)
        };
        self.away.as_mut().filter(is_it)
    }

    fn fork(
        &mut self,
        id: WorldId,
        count: u32,
        lease: Option<Lease>,
        outlet: &impl Outlet<S>,
    ) -> Result<Reply, Error> {
        let seats = self.seats.take(count as usize)?;
        let hosted = find(&mut self.worlds, None, id)?;
        let copies = hosted.with(id, |world| {
            let copy = |_: &_| {
                let copy_id = self.ids.next();
                (copy_id, world.fork(copy_id))
            };
            Ok(seats.iter().map(copy).collect::<Vec<_>>())
        })?;
        let ids = copies.iter().map(|(copy_id, _)| *copy_id).collect();
        for ((copy_id, copy), seat) in copies.into_iter().zip(seats) {
            let copy = Hosted::new(hosted.tenant.clone(), lease.clone(), copy, seat);
            outlet.adopt(copy_id, copy);
        }
        Ok(Reply::Forked(ids))
    }

    fn note_owner(&mut self, now: Instant, id: ServiceId, is_up: bool) {
        if is_up {
            self.owners_up.insert(id);
        } else {
            self.owners_up.remove(&id);
        }
        for world in self.worlds.values_mut() {
            world.note_owner(now, |owner| self.owners_up.contains(owner));
        }
        self.find_next_end();
    }
}

/// A world of this tenant; those of others do not exist for it.
fn find<'a, S>(
    worlds: &'a mut BTreeMap<WorldId, Hosted<S>>,
    tenant: Option<&Tenant>,
    id: WorldId,
) -> Result<&'a mut Hosted<S>, Error> {
    worlds
        .get_mut(&id)
        .filter(|world| tenant.is_none_or(|tenant| world.tenant == *tenant))
        .ok_or_else(|| {
            Error::new(ErrorCode::UnknownWorld, "no such world; it may have ended").found(id)
        })
}

/// Begins a journal, and ends the one before.
fn record<S: Simulation>(
    world: &mut Recorded<S>,
    (id, tenant): (WorldId, &Tenant),
    name: Option<&str>,
    outlet: &impl Outlet<S>,
) -> Result<Reply, Error> {
    let first = Moment::of(&world.frame());
    let (map_name, map_text) = (world.map().name.clone(), world.map_text().to_owned());
    let head = Head { map_name, map_text, snapshot: world.snapshot(), first };
    let digest = head.digest();
    let (name, scribe) = outlet.journal(NewJournal { tenant, world: id, name, head })?;
    if let Some(before) = world.record(Some(scribe)) {
        before.end(Box::new(|| ()));
    }
    let Moment { tick, state_hash, .. } = first;
    Ok(Reply::JournalBegun { name, digest, tick, state_hash })
}

type Furnished<S> = (S, EncodedFrame, Vec<CommandReply>);

/// A new world with its first frame; a panic on the way is an error and leaves nothing behind.
fn furnished<S: Simulation>(
    new: NewWorld<S::Town>,
    commands: &[Command],
) -> Result<Furnished<S>, Error> {
    guarded(|| {
        let mut world = S::create(new)?;
        let (frame, replies) = furnish(&mut world, commands)?;
        Ok((world, frame, replies))
    })
}
