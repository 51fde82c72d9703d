//! From a verified request to the shards that do it.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::{Duration, Instant};

use schemas::{Command, Error, ErrorCode, Lease, Reply, Request, ServiceId, Tenant};
use schemas::{TickItem, TickResult, WorldId, WorldInfo};

use super::{Answer, Gather, Ids, Question, Seat};

/// Jobs a shard may have waiting; more are refused with [`ErrorCode::Capacity`].
pub(crate) const JOBS_MAX: usize = 4_096;

/// Work for one shard.
pub enum Job<S: super::Simulation> {
    /// A world that is to be made here.
    Create {
        /// What it starts from.
        new: super::NewWorld<S::Town>,
        /// Whose it will be.
        tenant: Tenant,
        /// Applied before the first frame; one refused means no world.
        commands: Vec<Command>,
        /// Who keeps it.
        lease: Option<Lease>,
        /// Its right to exist.
        seat: Seat,
        /// Hears of it.
        answer: Answer,
    },
    /// Ticks of worlds of this shard.
    Tick {
        /// Only worlds of this tenant exist; `None`: of any.
        tenant: Option<Tenant>,
        /// With the index of the result.
        items: Vec<(usize, TickItem)>,
        /// Takes the results.
        gather: Arc<Gather<TickResult>>,
    },
    /// The worlds of a tenant.
    List {
        /// Whose.
        tenant: Tenant,
        /// Which part of the result this shard gives.
        index: usize,
        /// Takes the results.
        gather: Arc<Gather<Vec<WorldInfo>>>,
    },
    /// Work on one world.
    World {
        /// Whose it must be.
        tenant: Tenant,
        /// Which.
        world: WorldId,
        /// What.
        work: WorldWork,
        /// Hears of it.
        answer: Answer,
    },
    /// A service came up or is gone.
    Owner {
        /// Which.
        id: ServiceId,
        /// Up or gone.
        is_up: bool,
        /// When that was noticed.
        now: Instant,
    },
    /// A world was adopted, or a lease begun that may end before the next job.
    LookAgain,
    /// The end of the shard.
    Stop,
}

/// Work on one world that is not a tick.
pub enum WorldWork {
    /// Ends it.
    Destroy,
    /// Its bytes.
    Snapshot,
    /// Copies of it.
    Fork {
        /// How many.
        count: u32,
        /// Who keeps them.
        lease: Option<Lease>,
    },
    /// Changes without a tick.
    Commands(Vec<Command>),
    /// A look at it.
    Look(Question),
    /// Somebody takes part in its clock; without a lease, no more.
    Share {
        /// Who.
        participant: ServiceId,
        /// How long the others wait.
        lease: Option<Duration>,
        /// The first of the worlds that it goes on from.
        stands_for: Option<WorldId>,
    },
    /// A journal from now on, or none.
    Record {
        /// Begin or end.
        on: bool,
        /// Its file in the folder of the tenant; `None`: a new one.
        name: Option<String>,
    },
}

/// Hands requests to shards. Never waits.
pub struct Dispatcher<S: super::Simulation> {
    shards: Vec<SyncSender<Job<S>>>,
}

impl<S: super::Simulation> Dispatcher<S> {
    /// The inboxes in order of the shards' indices; at least one.
    pub fn new(shards: Vec<SyncSender<Job<S>>>) -> Self {
        Self { shards }
    }

    /// The inbox of the shard that owns a world.
    pub fn shard(&self, world: WorldId) -> &SyncSender<Job<S>> {
        &self.shards[Ids::shard_of(world, self.shards.len())]
    }

    /// Starts a request that worlds can do; gives back one that needs maps.
    pub(crate) fn dispatch(
        &self,
        tenant: Tenant,
        request: Request,
        answer: Answer,
    ) -> Option<(Tenant, Request, Answer)> {
        let (world, work) = match request {
            Request::TickWorlds(items) => {
                self.tick(Some(tenant), items, answer, |_, job| Some(job));
                return None;
            }
            Request::ListWorlds => {
                self.list(&tenant, answer);
                return None;
            }
            Request::DestroyWorld { world } => (world, WorldWork::Destroy),
            Request::SnapshotWorld { world } => (world, WorldWork::Snapshot),
            Request::ForkWorld { world, count, lease } => (world, WorldWork::Fork { count, lease }),
            Request::RunCommands { world, commands } => (world, WorldWork::Commands(commands)),
            Request::DescribeActors { world, actors } => {
                (world, WorldWork::Look(Question::Actors(actors)))
            }
            Request::InspectVehicles { world, actors } => {
                (world, WorldWork::Look(Question::Vehicles(actors)))
            }
            Request::CastRays { world, rays } => (world, WorldWork::Look(Question::Rays(rays))),
            Request::ShareClock { world, participant, lease_millis, stands_for } => {
                let lease = Duration::from_millis(lease_millis.into());
                let lease = Some(lease).filter(|lease| !lease.is_zero());
                (world, WorldWork::Share { participant, lease, stands_for })
            }
            Request::RecordWorld { world, on, name } => (world, WorldWork::Record { on, name }),
            other @ (Request::CreateWorld { .. }
            | Request::RestoreWorld { .. }
            | Request::BranchJournal { .. }
            | Request::PutMap { .. }
            | Request::ListMaps) => {
                return Some((tenant, other, answer));
            }
        };
        self.send(world, Job::World { tenant, world, work, answer });
        None
    }

    /// Ticks many worlds at once, of one tenant or of any. Work for one shard alone is offered to
    /// `here`, which does it or gives it back; several shards begin sooner when each is told.
    pub fn tick(
        &self,
        tenant: Option<Tenant>,
        items: Vec<TickItem>,
        answer: Answer,
        here: impl FnOnce(usize, Job<S>) -> Option<Job<S>>,
    ) {
        if items.is_empty() {
            return answer(Reply::Ticked(Vec::new()));
        }
        let gather = Gather::new(items.len(), answer, Reply::Ticked);
        let mut parts: Vec<Vec<(usize, TickItem)>> = vec![Vec::new(); self.shards.len()];
        for (index, item) in items.into_iter().enumerate() {
            parts[Ids::shard_of(item.world, self.shards.len())].push((index, item));
        }
        let parts = parts.into_iter().enumerate().filter(|(_, items)| !items.is_empty());
        let mut jobs: Vec<(usize, Job<S>)> = parts
            .map(|(shard, items)| {
                let gather = Arc::clone(&gather);
                (shard, Job::Tick { tenant: tenant.clone(), items, gather })
            })
            .collect();
        if jobs.len() == 1 {
            let left = jobs.pop().and_then(|(shard, job)| Some((shard, here(shard, job)?)));
            jobs.extend(left);
        }
        for (shard, job) in jobs {
            self.send_ticks(shard, job);
        }
    }

    fn send_ticks(&self, shard: usize, job: Job<S>) {
        if let Err(refused) = self.shards[shard].try_send(job)
            && let Job::Tick { items, gather, .. } = refused_job(refused)
        {
            let busy = |(index, item): (usize, TickItem)| {
                (index, TickResult { world: item.world, outcome: Err(too_busy()) })
            };
            gather.give(items.into_iter().map(busy));
        }
    }

    fn list(&self, tenant: &Tenant, answer: Answer) {
        let finish = |parts: Vec<Vec<WorldInfo>>| {
            let mut worlds = parts.concat();
            worlds.sort_by_key(|info| info.world);
            Reply::Worlds(worlds)
        };
        let gather = Gather::new(self.shards.len(), answer, finish);
        for (index, shard) in self.shards.iter().enumerate() {
            let job = Job::List { tenant: tenant.clone(), index, gather: Arc::clone(&gather) };
            if shard.try_send(job).is_err() {
                // The gathering is dropped unfinished, which tells the asker.
                return;
            }
        }
    }

    fn send(&self, world: WorldId, job: Job<S>) {
        if let Err(refused) = self.shard(world).try_send(job)
            && let Job::World { answer, .. } = refused_job(refused)
        {
            answer(Reply::Error(too_busy()));
        }
    }
}

fn refused_job<T>(refused: TrySendError<T>) -> T {
    match refused {
        TrySendError::Full(job) | TrySendError::Disconnected(job) => job,
    }
}

fn too_busy() -> Error {
    Error::new(ErrorCode::Capacity, "the world service is too busy; nothing was done")
        .wanted(format_args!("at most {JOBS_MAX} requests waiting"))
}
