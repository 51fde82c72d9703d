//! The worlds of one thread.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use schemas::{Command, CommandReply, EncodedFrame, Error, ErrorCode, Lease, Reply, ServiceId};
use schemas::{Tenant, WorldId};

use super::hosted::guarded;
use super::inbox::WorldWork;
use super::tick::furnish;
use super::{Answer, Hosted, Ids, Job, NewWorld, Outlet, Recorded, Seats, Simulation, Waiter};
use crate::journal::Journal;

/// The worlds of one thread, and who of their owners is up.
pub struct Shard<S> {
    worlds: BTreeMap<WorldId, Hosted<S>>,
    owners_up: BTreeSet<ServiceId>,
    ids: Arc<Ids>,
    seats: Seats,
    /// Looked at before every job, so not searched for each time.
    next_end: Option<Instant>,
}

impl<S: Simulation> Shard<S> {
    /// No worlds.
    pub fn new(ids: Arc<Ids>, seats: Seats) -> Self {
        Self { worlds: BTreeMap::new(), owners_up: BTreeSet::new(), ids, seats, next_end: None }
    }

    /// Takes a world in.
    pub fn adopt(&mut self, now: Instant, id: WorldId, mut world: Hosted<S>) {
        world.note_owner(now, |owner| self.owners_up.contains(owner));
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
                tracing::info!(world = id.get(), "a world ends with its lease: its owner is gone");
            }
            if is_over {
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

    /// Does one job; its answer is given before this returns, except for pictures.
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
                self.work(now, (&tenant, world), work, answer, outlet)
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
                gather.give([(index, own.map(|(id, world)| world.info(*id)).collect())]);
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
        match find(&mut self.worlds, tenant, waiter.world()) {
            Ok(hosted) => {
                hosted.tick(now, waiter, outlet);
                let end = hosted.roster.next_end();
                self.next_end = [self.next_end, end].into_iter().flatten().min();
            }
            Err(error) => waiter.give(Err(error)),
        }
    }

    fn work(
        &mut self,
        now: Instant,
        (tenant, id): (&Tenant, WorldId),
        work: WorldWork,
        answer: Answer,
        outlet: &impl Outlet<S>,
    ) {
        let hosted = match find(&mut self.worlds, Some(tenant), id) {
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
                hosted.with(id, |world| Ok(Reply::CommandReplies(world.run(id, &commands))))
            }
            WorldWork::Look(question) => hosted.with(id, |world| world.answer(&question)),
            WorldWork::Share { participant, lease } => {
                let shared = hosted.share(now, id, (participant, lease), outlet);
                self.find_next_end();
                shared
            }
            WorldWork::Record(on) => hosted.with(id, |world| record(world, id, on, outlet)),
            WorldWork::Fork { count, lease } => self.fork(tenant, id, count, lease, outlet),
        };
        answer(reply.unwrap_or_else(Reply::Error));
    }

    fn fork(
        &mut self,
        tenant: &Tenant,
        id: WorldId,
        count: u32,
        lease: Option<Lease>,
        outlet: &impl Outlet<S>,
    ) -> Result<Reply, Error> {
        let seats = self.seats.take(count as usize)?;
        let hosted = find(&mut self.worlds, Some(tenant), id)?;
        let copies = hosted.with(id, |world| {
            let copy = |_: &_| {
                let copy_id = self.ids.next();
                (copy_id, world.fork(copy_id))
            };
            Ok(seats.iter().map(copy).collect::<Vec<_>>())
        })?;
        let ids = copies.iter().map(|(copy_id, _)| *copy_id).collect();
        for ((copy_id, copy), seat) in copies.into_iter().zip(seats) {
            let copy = Hosted::new(tenant.clone(), lease.clone(), copy, seat);
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

/// Begins or ends a journal.
fn record<S: Simulation>(
    world: &mut Recorded<S>,
    id: WorldId,
    on: bool,
    outlet: &impl Outlet<S>,
) -> Result<Reply, Error> {
    if !on {
        world.record(None);
        return Ok(Reply::Done);
    }
    let (out, bytes_max) = outlet.journal(id)?;
    let (map, text, snapshot) = (&world.map().name, world.map_text(), world.snapshot());
    let journal = Journal::begin(out, bytes_max, map, text, &snapshot).map_err(|cause| {
        Error::new(ErrorCode::Capacity, "the journal cannot be begun").found(cause)
    })?;
    world.record(Some(journal));
    Ok(Reply::Done)
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
