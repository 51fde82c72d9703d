//! The threads that step worlds.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bus::{Bus, FrameListeners};
use monitoring::{Monitor, Pulse};
use schemas::{EncodedFrame, Error, Tenant, WorldId};

use super::ServiceError;
use super::figures::ShardFigures;
use super::journals::JournalFolder;
use crate::journal::Scribe;
use crate::service::{Hosted, Ids, Job, NewJournal, Outlet, Seats, Shard, Simulation};

/// Requests of several ticks are worked on for this long before others get their turn...
const SLICE: Duration = Duration::from_millis(1);
/// ...and others for so many jobs before those go on.
const JOBS_BETWEEN_MAX: usize = 64;
/// Ticks that take longer are done where nobody waits for them.
const SLOW_TICK: Duration = Duration::from_millis(2);

type Mailbox<S> = Mutex<Vec<(WorldId, Hosted<S>)>>;

/// Worlds on their way to a shard from elsewhere; bounded by the seats of the service.
pub(super) struct Mailboxes<S: Simulation> {
    boxes: Vec<Mailbox<S>>,
    jobs: Vec<SyncSender<Job<S>>>,
}

/// What a shard's thread needs of the process, and where its results go.
pub(super) struct ShardOutlet<S: Simulation> {
    pub(super) index: usize,
    pub(super) bus: Bus,
    pub(super) listeners: FrameListeners,
    pub(super) mailboxes: Arc<Mailboxes<S>>,
    pub(super) journals: Arc<JournalFolder>,
    pub(super) figures: ShardFigures,
}

/// Where the worlds of one shard are worked on: by a thread of its own, or by those who lend
/// theirs, one at a time. A world whose ticks take long is ticked by the shard's own thread, and
/// meanwhile others may work on the rest.
pub(super) struct ShardWorker<S: Simulation> {
    shard: Mutex<Shard<S>>,
    /// The shard's own thread is at a tick that takes long, and hears of nothing else.
    is_away: AtomicBool,
    outlet: ShardOutlet<S>,
    /// Turns of whoever has the shard.
    turns: Arc<Pulse>,
    /// Ticks that take long.
    away_turns: Arc<Pulse>,
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
        self.wake(index);
    }

    /// Has a shard's thread look into its box and at its clock.
    fn wake(&self, index: usize) {
        // One that is too busy to be told will look anyway.
        let _ = self.jobs[index].try_send(Job::LookAgain);
    }

    fn empty(&self, index: usize) -> Vec<(WorldId, Hosted<S>)> {
        std::mem::take(&mut *self.boxes[index].lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<S: Simulation> ShardWorker<S> {
    /// Without worlds, and nobody at work yet.
    pub(super) fn new(
        outlet: ShardOutlet<S>,
        ids: Arc<Ids>,
        seats: Seats,
        monitor: &Monitor,
    ) -> Self {
        let shard = Mutex::new(Shard::new(ids, seats, SLOW_TICK));
        let turns = monitor.pulse(&format!("shard-{}", outlet.index));
        let away_turns = monitor.pulse(&format!("slow world of shard-{}", outlet.index));
        Self { shard, is_away: AtomicBool::default(), outlet, turns, away_turns }
    }

    /// Starts the thread that works here, which ends with [`Job::Stop`].
    pub(super) fn spawn(
        self: &Arc<Self>,
        inbox: Receiver<Job<S>>,
    ) -> Result<JoinHandle<()>, ServiceError> {
        let worker = Arc::clone(self);
        std::thread::Builder::new()
            .name(format!("shard-{}", self.outlet.index))
            .spawn(move || worker.run(&inbox))
            .map_err(|cause| ServiceError::System { what: "threads", cause })
    }

    /// Does a job at once, on the caller's thread; gives it back while the shard's own thread is at
    /// work here. What is left of a request of many ticks after a slice of time, and ticks that
    /// take long, are for that thread.
    pub(super) fn work_here(&self, job: Job<S>) -> Option<Job<S>> {
        let mut shard = match self.shard.try_lock() {
            Ok(shard) => shard,
            // Others who lend their threads are done sooner.
            Err(_) if self.is_away.load(Ordering::Acquire) => self.lock(),
            Err(_) => return Some(job),
        };
        let turn = self.turns.begin(Instant::now());
        let due = shard.next_end();
        self.work(&mut shard, Some(job));
        let begun = Instant::now();
        while shard.is_running() && !shard.is_slow_next() && begun.elapsed() < SLICE {
            shard.go_on(Instant::now(), &self.outlet);
        }
        let is_due_sooner = shard.next_end().is_some_and(|end| due.is_none_or(|due| end < due));
        let is_running = shard.is_running();
        drop(turn);
        drop(shard);
        if is_due_sooner || is_running {
            self.outlet.mailboxes.wake(self.outlet.index);
        }
        None
    }

    fn run(&self, inbox: &Receiver<Job<S>>) {
        let mut jobs_since_slice = 0;
        loop {
            let (due, is_running) = {
                let shard = self.lock();
                (shard.next_end(), shard.is_running())
            };
            let received = match due {
                _ if is_running => inbox.recv_timeout(Duration::ZERO),
                None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(end) => inbox.recv_timeout(end.saturating_duration_since(Instant::now())),
            };
            let job = match received {
                Ok(Job::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(job) => Some(job),
                Err(RecvTimeoutError::Timeout) => None,
            };
            jobs_since_slice += 1;
            let is_turn = job.is_none() || jobs_since_slice >= JOBS_BETWEEN_MAX;
            {
                let mut shard = self.lock();
                let _turn = self.turns.begin(Instant::now());
                self.work(&mut shard, job);
            }
            if is_turn {
                jobs_since_slice = 0;
                self.go_on();
            }
        }
    }

    /// Goes on with requests under way for a slice of time, at least for one tick.
    fn go_on(&self) {
        let begun = Instant::now();
        let mut shard = self.lock();
        while shard.is_running() {
            if shard.is_slow_next() {
                let Some(mut turn) = shard.take_turn() else { return };
                self.is_away.store(true, Ordering::Release);
                drop(shard);
                let away_turn = self.away_turns.begin(Instant::now());
                turn.go_on(&self.outlet);
                drop(away_turn);
                shard = self.lock();
                self.is_away.store(false, Ordering::Release);
                shard.give_back(Instant::now(), turn, &self.outlet);
            } else {
                let now = Instant::now();
                let _turn = self.turns.begin(now);
                shard.go_on(now, &self.outlet);
            }
            if begun.elapsed() >= SLICE {
                return;
            }
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

impl<S: Simulation> Outlet<S> for ShardOutlet<S> {
    fn has_listeners(&self) -> bool {
        self.listeners.any()
    }

    fn publish(&self, tenant: &Tenant, world: WorldId, frame: &EncodedFrame) {
        if self.listeners.any() {
            self.figures.note_frame(frame);
            self.bus.publish_frame(tenant, world, frame);
        }
    }

    fn journal(&self, wanted: NewJournal<'_>) -> Result<(String, Box<dyn Scribe>), Error> {
        self.journals.begin(wanted)
    }

    fn ticked(&self, took: Duration) {
        self.figures.note_tick(took);
    }

    fn adopt(&self, id: WorldId, world: Hosted<S>) {
        self.mailboxes.adopt(id, world);
    }
}
