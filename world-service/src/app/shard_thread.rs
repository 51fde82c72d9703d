//! The threads that step worlds.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use bus::{Bus, FrameListeners, Renderers};
use schemas::{EncodedFrame, Error, ErrorCode, RenderJob, Tenant, WorldId};
use tokio::sync::Semaphore;

use super::ServiceError;
use crate::args::Journals;
use crate::service::{Answer, Answered, Hosted, Ids, Job, Outlet, Seats, Shard, Simulation};

/// Pictures that may wait for renderers, per shard.
const CAPTURES_MAX: usize = 256;
/// Journals of one world, one after the other.
const JOURNALS_PER_WORLD_MAX: u32 = 1_000;

type Mailbox<S> = Mutex<Vec<(WorldId, Hosted<S>)>>;

/// Worlds on their way to a shard from elsewhere; bounded by the seats of the service.
pub(super) struct Mailboxes<S: Simulation> {
    boxes: Vec<Mailbox<S>>,
    jobs: Vec<SyncSender<Job<S>>>,
}

/// What a shard's thread needs of the process.
pub(super) struct ShardThread<S: Simulation> {
    pub(super) index: usize,
    pub(super) bus: Bus,
    pub(super) listeners: FrameListeners,
    pub(super) mailboxes: Arc<Mailboxes<S>>,
    pub(super) renderers: Arc<Renderers>,
    pub(super) runtime: tokio::runtime::Handle,
    pub(super) journals: Option<Journals>,
}

/// Where the results of one shard's thread go.
struct BusOutlet<S: Simulation> {
    thread: ShardThread<S>,
    captures: Arc<Semaphore>,
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
        // A shard that is too busy to be told will look into its box anyway.
        let _ = self.jobs[index].try_send(Job::Adopted);
    }

    fn empty(&self, index: usize) -> Vec<(WorldId, Hosted<S>)> {
        std::mem::take(&mut *self.boxes[index].lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<S: Simulation> ShardThread<S> {
    /// Starts the thread, which ends with [`Job::Stop`].
    pub(super) fn spawn(
        self,
        ids: Arc<Ids>,
        seats: Seats,
        inbox: Receiver<Job<S>>,
    ) -> Result<JoinHandle<()>, ServiceError> {
        let shard = Shard::new(ids, seats);
        let outlet = BusOutlet { thread: self, captures: Arc::new(Semaphore::new(CAPTURES_MAX)) };
        std::thread::Builder::new()
            .name(format!("shard-{}", outlet.thread.index))
            .spawn(move || run(shard, &outlet, &inbox))
            .map_err(|cause| ServiceError::System { what: "threads", cause })
    }
}

fn run<S: Simulation>(mut shard: Shard<S>, outlet: &BusOutlet<S>, inbox: &Receiver<Job<S>>) {
    loop {
        let received = match shard.next_end() {
            None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(end) => inbox.recv_timeout(end.saturating_duration_since(Instant::now())),
        };
        let now = Instant::now();
        for (id, world) in outlet.thread.mailboxes.empty(outlet.thread.index) {
            shard.adopt(now, id, world);
        }
        match received {
            Ok(Job::Stop) | Err(RecvTimeoutError::Disconnected) => return,
            Ok(job) => shard.handle(now, job, outlet),
            Err(RecvTimeoutError::Timeout) => {}
        }
        shard.expire_leases(now, outlet);
    }
}

impl<S: Simulation> Outlet<S> for BusOutlet<S> {
    fn has_listeners(&self) -> bool {
        self.thread.listeners.any()
    }

    fn publish(&self, tenant: &Tenant, world: WorldId, frame: &EncodedFrame) {
        if self.thread.listeners.any() {
            self.thread.bus.publish_frame(tenant, world, frame);
        }
    }

    fn journal(&self, world: WorldId) -> Result<(Box<dyn Write + Send>, u64), Error> {
        let Some(journals) = &self.thread.journals else {
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

    fn capture(&self, job: RenderJob, answer: Answer) {
        let Ok(permit) = Arc::clone(&self.captures).try_acquire_owned() else {
            let busy = Error::new(ErrorCode::Capacity, "too many pictures are waiting")
                .wanted(format_args!("at most {CAPTURES_MAX}"));
            return answer(busy.into());
        };
        let (bus, renderers) = (self.thread.bus.clone(), Arc::clone(&self.thread.renderers));
        self.thread.runtime.spawn(async move {
            let drawn = renderers.draw(&bus, &job).await;
            answer(drawn.map_or_else(Answered::from, Answered::Drawn));
            drop(permit);
        });
    }

    fn adopt(&self, id: WorldId, world: Hosted<S>) {
        self.thread.mailboxes.adopt(id, world);
    }
}
