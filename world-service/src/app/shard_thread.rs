//! The threads that step worlds.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use bus::{Bus, FrameListeners};
use schemas::{EncodedFrame, Error, ErrorCode, Tenant, WorldId};

use super::ServiceError;
use crate::args::Journals;
use crate::service::{Hosted, Ids, Job, Outlet, Seats, Shard, Simulation};

/// Journals of one world, one after the other.
const JOURNALS_PER_WORLD_MAX: u32 = 1_000;

type Mailbox<S> = Mutex<Vec<(WorldId, Hosted<S>)>>;

/// Worlds on their way to a shard from elsewhere; bounded by the seats of the service.
pub(super) struct Mailboxes<S: Simulation> {
    boxes: Vec<Mailbox<S>>,
    jobs: Vec<SyncSender<Job<S>>>,
}

/// What a shard's thread needs of the process, and where its results go.
pub(super) struct ShardThread<S: Simulation> {
    pub(super) index: usize,
    pub(super) bus: Bus,
    pub(super) listeners: FrameListeners,
    pub(super) mailboxes: Arc<Mailboxes<S>>,
    pub(super) journals: Option<Journals>,
}

/// Where the worlds of one shard are worked on: by a thread of its own, or by those who lend
/// theirs, one at a time.
pub(super) struct Workshop<S: Simulation> {
    shard: Mutex<Shard<S>>,
    outlet: ShardThread<S>,
}

impl<S: Simulation> Mailboxes<S> {
    /// One per shard.
    pub(super) fn new(jobs: Vec<SyncSender<Job<S>>>) -> Self {
        Self { boxes: jobs.iter().map(|_| Mutex::default()).collect(), jobs }
    }

    /// Gives a world to the shard of its id, which has it before any later job.
    pub(super) fn adopt(&self, id: WorldId, world: Hosted<S>) {
        let index = Ids::shard_of(id, self.boxes.len());
        self.boxes[index].lock().unwrap_or_else(PoisonError::into_inner).push((id, world));
        self.knock(index);
    }

    /// Has a shard's thread look into its box and at its clock.
    fn knock(&self, index: usize) {
        // One that is too busy to be told will look anyway.
        let _ = self.jobs[index].try_send(Job::LookAgain);
    }

    fn empty(&self, index: usize) -> Vec<(WorldId, Hosted<S>)> {
        std::mem::take(&mut *self.boxes[index].lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<S: Simulation> Workshop<S> {
    /// Without worlds, and nobody at work yet.
    pub(super) fn new(outlet: ShardThread<S>, ids: Arc<Ids>, seats: Seats) -> Self {
        Self { shard: Mutex::new(Shard::new(ids, seats)), outlet }
    }

    /// Starts the thread that works here, which ends with [`Job::Stop`].
    pub(super) fn open(
        self: &Arc<Self>,
        inbox: Receiver<Job<S>>,
    ) -> Result<JoinHandle<()>, ServiceError> {
        let workshop = Arc::clone(self);
        std::thread::Builder::new()
            .name(format!("shard-{}", self.outlet.index))
            .spawn(move || workshop.run(&inbox))
            .map_err(|cause| ServiceError::System { what: "threads", cause })
    }

    /// Does a job at once, on the caller's thread; gives it back while somebody is at work here.
    pub(super) fn lend_a_hand(&self, job: Job<S>) -> Option<Job<S>> {
        let Ok(mut shard) = self.shard.try_lock() else { return Some(job) };
        let due = shard.next_end();
        self.work(&mut shard, Some(job));
        let is_due_sooner = shard.next_end().is_some_and(|end| due.is_none_or(|due| end < due));
        drop(shard);
        if is_due_sooner {
            self.outlet.mailboxes.knock(self.outlet.index);
        }
        None
    }

    fn run(&self, inbox: &Receiver<Job<S>>) {
        loop {
            let due = self.lock().next_end();
            let received = match due {
                None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(end) => inbox.recv_timeout(end.saturating_duration_since(Instant::now())),
            };
            let job = match received {
                Ok(Job::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(job) => Some(job),
                Err(RecvTimeoutError::Timeout) => None,
            };
            self.work(&mut self.lock(), job);
        }
    }

    fn work(&self, shard: &mut Shard<S>, job: Option<Job<S>>) {
        let now = Instant::now();
        for (id, world) in self.outlet.mailboxes.empty(self.outlet.index) {
            shard.adopt(now, id, world);
        }
        if let Some(job) = job {
            shard.handle(now, job, &self.outlet);
        }
        shard.expire_leases(now, &self.outlet);
    }

    fn lock(&self) -> MutexGuard<'_, Shard<S>> {
        // Worlds that panic are put aside; the rest is as good as before.
        self.shard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: Simulation> Outlet<S> for ShardThread<S> {
    fn has_listeners(&self) -> bool {
        self.listeners.any()
    }

    fn publish(&self, tenant: &Tenant, world: WorldId, frame: &EncodedFrame) {
        if self.listeners.any() {
            self.bus.publish_frame(tenant, world, frame);
        }
    }

    fn journal(&self, world: WorldId) -> Result<(Box<dyn Write + Send>, u64), Error> {
        let Some(journals) = &self.journals else {
            return Err(Error::new(ErrorCode::Unsupported, "this world service keeps no journals")
                .wanted("one started with --journals DIR"));
        };
        // A world may have several, one after the other.
        let of =
            |count: u32| journals.folder.join(format!("world-{}-{count}.journal", world.get()));
        let made =
            (1..=JOURNALS_PER_WORLD_MAX).find_map(|count| match File::create_new(of(count)) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => None,
                other => Some(other),
            });
        match made {
            Some(Ok(file)) => Ok((Box::new(BufWriter::new(file)), journals.bytes_max)),
            Some(Err(cause)) => Err(Error::new(ErrorCode::Internal, "no journal can be made")
                .found(format_args!("{}: {cause}", journals.folder.display()))),
            None => Err(Error::new(ErrorCode::Capacity, "the world has too many journals")
                .wanted(format_args!("at most {JOURNALS_PER_WORLD_MAX}"))),
        }
    }

    fn adopt(&self, id: WorldId, world: Hosted<S>) {
        self.mailboxes.adopt(id, world);
    }
}
