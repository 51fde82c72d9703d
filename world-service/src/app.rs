//! Wires worlds and maps to the bus; owns all threads and clocks.

mod figures;
mod journals;
mod keys;
mod load;
mod maker;
mod shard_worker;

use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bus::{Announcement, Bus, BusAddress, BusConfig, BusError, Presence, Serving};
use monitoring::{Drain, Monitor};
use schemas::{Alive, ServiceId, ServiceKind};
use signals::Termination;
use tokio::task::AbortHandle;

use crate::args::{Args, Config, ConfigError};
use crate::maps::Maps;
use crate::service::{Dispatcher, Ids, JOBS_MAX, Job, Seats, Simulation};
use figures::RequestFigures;
use journals::JournalFolder;
use maker::Maker;
use shard_worker::{Mailboxes, ShardOutlet, ShardWorker};

/// Why the service cannot start or had to end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServiceError {
    /// What was typed cannot work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The maps folder cannot work.
    #[error("the maps cannot be used: {0}")]
    Maps(schemas::Error),
    /// No place on the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The operating system refuses threads or signals.
    #[error("the operating system refuses {what}: {cause}")]
    System {
        /// What was asked of it.
        what: &'static str,
        /// What it says.
        cause: std::io::Error,
    },
}

/// A running world service. Ends in order with [`stop`](Self::stop); dropped, its threads end by
/// themselves.
pub struct WorldService {
    bus: Bus,
    jobs: Vec<SyncSender<Job<world::World>>>,
    threads: Vec<JoinHandle<()>>,
    journals: Arc<JournalFolder>,
    seats: Seats,
    tasks: [AbortHandle; 3],
    _announcement: Announcement,
    servings: Vec<Serving>,
}

/// Runs the service until it is told to end by SIGINT or SIGTERM; in the window of its monitor it
/// makes no new worlds then, and ends when those that there are have ended.
///
/// # Errors
/// [`ServiceError`] when it cannot start.
pub fn run(args: Args, monitor: &Monitor) -> Result<(), ServiceError> {
    let config = Config::resolve(args)?;
    let system = |what| move |cause| ServiceError::System { what, cause };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(system("threads"))?;
    runtime.block_on(async {
        let mut termination = Termination::follow().map_err(system("signals"))?;
        tokio::spawn(monitor.pulse("runtime").beat_for_ever());
        // A bus may hang while it is joined.
        let service = tokio::select! {
            service = start(config, monitor) => service?,
            () = termination.requested() => return Ok(()),
        };
        let seats = service.seats.clone();
        termination.drained(monitor, "worlds", move || seats.taken()).await;
        service.stop().await;
        Ok(())
    })
}

/// Starts the service inside this process; on return it is reachable.
///
/// # Errors
/// [`ServiceError`] when it cannot start.
pub async fn start(config: Config, monitor: &Monitor) -> Result<WorldService, ServiceError> {
    let begun = Instant::now();
    let maps =
        Arc::new(Maps::new(config.maps.as_deref(), world::Town::new).map_err(ServiceError::Maps)?);
    let bus = Bus::open(place(&config)).await?;
    bus.export(monitor.metrics());
    let epoch = RandomState::new().build_hasher().finish();
    let (ids, seats) = (Arc::new(Ids::new(epoch)), Seats::new(config.worlds_max));
    let (number, shard_count) = (ids.host(), config.shard_count.get());
    let (jobs, inboxes): (Vec<_>, Vec<_>) =
        (0..shard_count).map(|_| sync_channel(JOBS_MAX)).unzip();
    let mailboxes = Arc::new(Mailboxes::new(jobs.clone()));
    let journal_bytes = figures::journal_bytes(monitor.metrics());
    let journals = Arc::new(JournalFolder::new(config.journals.clone(), journal_bytes));
    let listeners = bus.frame_listeners().await?;
    let figures = figures::export(monitor.metrics(), &seats, &bus);
    let outlet = |index| ShardOutlet {
        index,
        bus: bus.clone(),
        listeners: listeners.clone(),
        mailboxes: Arc::clone(&mailboxes),
        journals: Arc::clone(&journals),
        figures: figures.clone(),
    };
    let (workers, mut threads) = start_shards(inboxes, outlet, (&ids, &seats), monitor)?;
    let dispatcher = Arc::new(Dispatcher::new(jobs.clone()));
    let maker = Maker {
        maps,
        ids,
        seats: seats.clone(),
        epoch,
        dispatcher: Arc::clone(&dispatcher),
        mailboxes,
        journals: Arc::clone(&journals),
        first_map: monitor.condition("maps", "the first map is not built yet"),
    };
    let (maker, maker_thread) = maker.spawn()?;
    threads.push(maker_thread);
    let router = keys::RequestRouter {
        dispatcher,
        maker,
        monitor: monitor.clone(),
        figures: RequestFigures::new(monitor.metrics()),
    };
    let servings = keys::serve(&bus, (&config.id, number), router, workers.into()).await?;
    let presence = follow_presence(&bus, jobs.clone()).await?;
    let load = load::tell(&bus, &config.id, &seats, (figures.tick_time, shard_count));
    let tasks = [presence, tell_draining(&bus, &config.id, monitor), load];
    let _announcement = bus.announce(alive(&config, number)).await?;
    for address in bus.listening() {
        tracing::info!(%address, threads = shard_count, "worlds live here");
    }
    tracing::debug!(millis = begun.elapsed().as_millis() as u64, "the world service is up");
    monitor.set_started();
    Ok(WorldService { bus, jobs, threads, journals, seats, tasks, _announcement, servings })
}

/// Its place on the bus.
fn place(config: &Config) -> BusConfig {
    BusConfig {
        listen: config.listen.clone(),
        connect: config.connect.clone(),
        identity: config.identity.clone(),
        ..BusConfig::default()
    }
}

type Worker = Arc<ShardWorker<world::World>>;
type Inbox = Receiver<Job<world::World>>;

/// Starts a shard for each inbox.
fn start_shards(
    inboxes: Vec<Inbox>,
    outlet: impl Fn(usize) -> ShardOutlet<world::World>,
    (ids, seats): (&Arc<Ids>, &Seats),
    monitor: &Monitor,
) -> Result<(Vec<Worker>, Vec<JoinHandle<()>>), ServiceError> {
    let start = |(index, inbox)| {
        let worker = ShardWorker::new(outlet(index), Arc::clone(ids), seats.clone(), monitor);
        let worker = Arc::new(worker);
        let thread = worker.spawn(inbox)?;
        Ok((worker, thread))
    };
    inboxes.into_iter().enumerate().map(start).collect()
}

impl WorldService {
    /// Where clients and services may connect.
    pub fn listening(&self) -> &[BusAddress] {
        self.bus.listening()
    }

    /// Ends all worlds; every request that still waits is answered or told that nobody does.
    pub async fn stop(mut self) {
        self.tasks.iter().for_each(AbortHandle::abort);
        self.bus.close().await;
        self.servings.clear();
        self.stop_shards();
        let threads = std::mem::take(&mut self.threads);
        let journals = Arc::clone(&self.journals);
        let panicked = move || {
            let ended = threads.into_iter().map(JoinHandle::join);
            let panics = ended.filter(Result::is_err).count();
            journals.settle();
            panics
        };
        match tokio::task::spawn_blocking(panicked).await {
            Ok(0) => tracing::info!("the world service has ended"),
            Ok(panics) => tracing::error!(panics, "threads of the world service had panicked"),
            Err(cause) => tracing::error!(%cause, "the world service could not end in order"),
        }
    }

    fn stop_shards(&self) {
        for shard in &self.jobs {
            // Waits while the shard is busy. One that is gone already needs no telling.
            let _ = shard.send(Job::Stop);
        }
    }
}

impl Drop for WorldService {
    fn drop(&mut self) {
        self.tasks.iter().for_each(AbortHandle::abort);
        self.stop_shards();
    }
}

/// Tells faces while no new worlds are made.
fn tell_draining(bus: &Bus, id: &ServiceId, monitor: &Monitor) -> AbortHandle {
    let (bus, service, drain) =
        (bus.clone(), (ServiceKind::World, id.clone()), monitor.follow_drain());
    let telling = async move {
        bus.tell_draining(service, drain, |drain: &Drain| drain.is_on()).await;
    };
    tokio::spawn(telling).abort_handle()
}

fn alive(config: &Config, number: u32) -> Alive {
    Alive {
        kind: ServiceKind::World,
        id: config.id.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        pid: std::process::id(),
        capacity: config.worlds_max as u32,
        detail: config.listen.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "),
        number,
    }
}

/// Tells shards which owners are up.
async fn follow_presence<S: Simulation>(
    bus: &Bus,
    shards: Vec<SyncSender<Job<S>>>,
) -> Result<AbortHandle, BusError> {
    let mut watch = bus.watch(None).await?;
    let task = tokio::spawn(async move {
        loop {
            let (kind, id, is_up) = match watch.next().await {
                Presence::Up(alive) => (alive.kind, alive.id, true),
                Presence::Down(kind, id) => (kind, id, false),
            };
            tracing::info!(kind = kind.as_str(), %id, is_up, "presence");
            for shard in &shards {
                tell(shard, &id, is_up).await;
            }
        }
    });
    Ok(task.abort_handle())
}

/// Must arrive, else worlds would outlive their owners; waits while the shard is too busy.
async fn tell<S: Simulation>(shard: &SyncSender<Job<S>>, id: &schemas::ServiceId, is_up: bool) {
    let now = Instant::now();
    while let Err(TrySendError::Full(_)) = shard.try_send(Job::Owner { id: id.clone(), is_up, now })
    {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
