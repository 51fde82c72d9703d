//! Wires everything together; the only place that starts a runtime and opens sockets.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Bus, BusConfig};
use monitoring::Monitor;
use schemas::{Alive, ServiceKind};
use signals::Termination;
use tenancy::{Door, DoorError, FOLLOW_EVERY};
use tokio::sync::watch;
use worlds::{Worlds, until_sweep};

use crate::config::{Args, Config, ConfigError};
use crate::limits::{MOVE_AGAIN, REAP_EVERY};
use crate::listener::FaceListener;
use crate::openenv::{self, Face, OriginRule};
use crate::session::table::Sessions;
use crate::session::{Contexts, SessionContext};
use crate::world_port::on_bus::PATIENCE;
use crate::world_port::{DT_SECS, WorldPort};

/// Why the service ended.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A setting cannot work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The face's address cannot be used.
    #[error("cannot listen on {address}: {cause}")]
    Listen {
        /// As configured.
        address: SocketAddr,
        /// The system's reason.
        #[source]
        cause: std::io::Error,
    },
    /// The file of tenants cannot be used.
    #[error("--tokens: {0}")]
    Tokens(#[from] DoorError),
    /// The bus refused.
    #[error(transparent)]
    Bus(#[from] bus::BusError),
    /// The system refused threads or sockets.
    #[error("the system refused: {0}")]
    System(#[from] std::io::Error),
}

/// Runs the service until the process is told to end; in the window of its monitor it takes no new
/// sessions then, and ends when those that there are have ended.
///
/// # Errors
/// [`RunError`] when it cannot start or go on.
pub fn run(args: &Args, monitor: &Monitor) -> Result<(), RunError> {
    let config = Config::resolve(args)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let result = runtime.block_on(serve(config, monitor));
    runtime.shutdown_timeout(Duration::from_millis(500));
    result
}

async fn serve(config: Config, monitor: &Monitor) -> Result<(), RunError> {
    let door = Arc::new(match &config.tokens {
        Some(path) => Door::with_tokens(path)?,
        None => Door::open(config.tenant.clone()),
    });
    // Before anybody can see that the service is up.
    let mut termination = Termination::follow()?;
    tokio::spawn(monitor.pulse("runtime").beat_for_ever());
    // The port opens before the bus is there: a client that comes at once waits instead of failing.
    let address = config.http;
    let listen_error = |cause| RunError::Listen { address, cause };
    let listener = FaceListener::open(address).await.map_err(listen_error)?;
    let address = listener.address();

    let (bus_sender, bus) = watch::channel(None);
    let (tenant, owner) = (config.tenant.clone(), config.id.clone());
    let port = Arc::new(Worlds::follow(bus, tenant, owner, PATIENCE));
    let (worlds, hosts) = (monitor.condition("worlds", NO_WORLDS), port.hosts().clone());
    tokio::spawn(async move { hosts.tell_open(|is_open| worlds.set(is_open, NO_WORLDS)).await });
    let changes = port.hosts().changes();
    let shared = Arc::clone(&port) as Arc<dyn WorldPort>;
    let (tenant, scenario) = (config.tenant.clone(), config.default_scenario.clone());
    let context = SessionContext::new(tenant, shared, scenario, config.profile);
    let context = context.playing(config.files.clone()).watched(monitor);
    let context = Arc::new(context.recovering(config.recovery_bytes));
    let contexts = Contexts::new(config.tenant.clone(), Arc::clone(&context), move |tenant| {
        Arc::new(port.for_tenant(tenant.clone()))
    });
    let sessions = Arc::new(Sessions::new(contexts, config.sessions_max, config.idle));
    export(monitor, &sessions);
    let origins = OriginRule {
        is_loopback: address.ip().is_loopback(),
        is_open: config.tokens.is_none(),
        allowed: config.allow_origin.clone(),
    };
    let face = Face {
        sessions: Arc::clone(&sessions),
        mode: config.mode,
        web: config.web_interface.then(openenv::WebSessions::default),
        door: Arc::clone(&door),
        origins,
    };
    let bounds = openenv::Bounds::for_sessions(config.sessions_max);
    let served = openenv::serve(listener, Arc::new(face), bounds);
    tokio::spawn(follow(door));
    tokio::spawn(reap(Arc::clone(&sessions)));
    tokio::spawn(keep_pace(Arc::clone(&sessions)));
    tokio::spawn(sweep(Arc::clone(&sessions), changes.clone()));
    tokio::spawn(move_worlds(Arc::clone(&sessions), changes));
    tokio::spawn(warm_up(context));

    let on_bus = join_bus(&config, address, bus_sender, monitor);
    let left = || sessions.load().0 as usize;
    tokio::select! {
        never = served => match never {},
        joined = on_bus => joined.map(|never| match never {}),
        () = termination.drained(monitor, "sessions", left) => Ok(()),
    }
}

/// Why nobody can be served.
const NO_WORLDS: &str = "no world service is up that makes new worlds";

/// Exports what sessions and their ticker know.
fn export(monitor: &Monitor, sessions: &Arc<Sessions>) {
    let metrics = monitor.metrics();
    let of = |read: fn((u32, u32)) -> u32| {
        let sessions = Arc::clone(sessions);
        move || f64::from(read(sessions.load()))
    };
    metrics.read_gauge("causeway_scenario_sessions", "Sessions", of(|(now, _)| now));
    metrics.read_gauge("causeway_scenario_sessions_max", "Sessions at once", of(|(_, max)| max));
    let recovery = Arc::clone(&sessions.contexts().first().recovery);
    metrics.read_gauge(
        "causeway_scenario_recovery_bytes",
        "Bytes kept to make worlds again",
        move || recovery.used() as f64,
    );
    let sessions = Arc::clone(sessions);
    metrics.read_gauge(
        "causeway_scenario_steps_waiting",
        "Steps that wait for the round trip before theirs",
        move || {
            let contexts = sessions.contexts().all();
            contexts.iter().map(|context| context.ticker.waiting() as f64).sum()
        },
    );
}

/// Connects, says that this service is up, and stays.
async fn join_bus(
    config: &Config,
    address: SocketAddr,
    bus_sender: watch::Sender<Option<Bus>>,
    monitor: &Monitor,
) -> Result<std::convert::Infallible, RunError> {
    let (connect, identity) = (config.connect.clone(), config.identity.clone());
    let bus = Bus::open(BusConfig { connect, identity, ..BusConfig::default() }).await?;
    bus.export(monitor.metrics());
    let alive = Alive {
        kind: ServiceKind::Scenario,
        id: config.id.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        pid: std::process::id(),
        capacity: config.sessions_max,
        detail: format!("http://{address}"),
        number: 0,
    };
    let _announcement = bus.announce(alive).await?;
    bus_sender.send_replace(Some(bus));
    monitor.set_started();
    std::future::pending().await
}

/// Has the default map ready before the first client asks for it.
async fn warm_up(context: Arc<SessionContext>) {
    if let Err(error) = context.warm_up().await {
        tracing::warn!(%error, "the default map is not ready yet");
    }
}

/// Frees worlds that no session uses.
async fn sweep(sessions: Arc<Sessions>, mut changes: watch::Receiver<u64>) {
    loop {
        until_sweep(&mut changes).await;
        for context in sessions.contexts().all() {
            context.collector.sweep(Instant::now()).await;
        }
    }
}

/// Moves worlds away from services that end, as soon as there is another one.
async fn move_worlds(sessions: Arc<Sessions>, mut changes: watch::Receiver<u64>) {
    while changes.changed().await.is_ok() {
        while sessions.move_worlds().await {
            tokio::time::sleep(MOVE_AGAIN).await;
        }
    }
}

/// Notices that the file of tenants has changed.
async fn follow(door: Arc<Door>) {
    loop {
        tokio::time::sleep(FOLLOW_EVERY).await;
        door.follow();
    }
}

async fn keep_pace(sessions: Arc<Sessions>) {
    let mut every = tokio::time::interval(Duration::from_secs_f64(DT_SECS));
    every.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    loop {
        every.tick().await;
        sessions.keep_pace();
    }
}

async fn reap(sessions: Arc<Sessions>) {
    let mut every = tokio::time::interval(REAP_EVERY);
    loop {
        every.tick().await;
        sessions.reap();
    }
}
