//! Wires endpoints to sockets and the bus; the only place that starts a runtime.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bus::{Bus, BusConfig, BusError};
use monitoring::Monitor;
use schemas::{Alive, ServiceKind};
use signals::Termination;
use tokio::net::TcpListener;
use tokio::runtime::{self, Runtime};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::config::{Args, Config, ConfigError, Ports, WorldConfig};
use crate::endpoint::Endpoint;
use crate::figures::Figures;
use crate::lobby::Lobby;
use crate::maps::Maps;
use crate::server::{EVENTS_MAX, LateComers, Server};
use crate::site::{BusSite, Site};
use crate::{rpc, stream};

/// Clients of one endpoint; told to others as its capacity.
const CAPACITY: u32 = 256;

/// Why the gateway ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A setting cannot work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A port is taken or the address is not ours.
    #[error("cannot listen on {address}: {cause}; free it or choose another --port")]
    Listen {
        /// As configured.
        address: SocketAddr,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The bus refused.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A defect ended an endpoint.
    #[error("an endpoint ended: {0}")]
    Endpoint(tokio::task::JoinError),
    /// The system refused threads or signals.
    #[error("the system refused: {0}")]
    System(#[from] std::io::Error),
}

/// Both sockets of one endpoint.
struct Sockets {
    ports: Ports,
    calls: TcpListener,
    streams: TcpListener,
}

/// Runs the gateway until the process is told to end; in the window of its monitor it takes no new
/// clients then, and ends when those that there are have gone.
///
/// # Errors
/// [`RunError`] when it cannot start or go on.
pub fn run(args: &Args, monitor: &Monitor) -> Result<(), RunError> {
    let config = Config::resolve(args)?;
    let runtime = runtime::Builder::new_multi_thread().enable_all().build()?;
    let result = runtime.block_on(serve(config, monitor));
    runtime.shutdown_timeout(Duration::from_millis(500));
    result
}

async fn serve(config: Config, monitor: &Monitor) -> Result<(), RunError> {
    let mut termination = Termination::follow()?;
    tokio::spawn(monitor.pulse("runtime").beat_for_ever());
    let figures = Figures::new(monitor.metrics());
    let clients = figures.clients.clone();
    // The ports open before the bus is there: a client that comes at once waits instead of failing.
    let mut sockets = Vec::with_capacity(config.endpoints.len());
    for ports in &config.endpoints {
        sockets.push(open(&config, *ports).await?);
    }
    tokio::select! {
        result = gateway(config, sockets, monitor, figures) => result,
        () = termination.drained(monitor, "clients", move || clients.count()) => Ok(()),
    }
}

async fn open(config: &Config, ports: Ports) -> Result<Sockets, RunError> {
    let listen = async |port| {
        let address = SocketAddr::new(config.host, port);
        let listening = TcpListener::bind(address).await;
        listening.map_err(|cause| RunError::Listen { address, cause })
    };
    let (calls, streams) = (listen(ports.calls).await?, listen(ports.streams).await?);
    tracing::info!(address = %SocketAddr::new(config.host, ports.calls), "CARLA clients may connect");
    Ok(Sockets { ports, calls, streams })
}

/// Why nobody can be served.
const NO_WORLDS: &str = "no world service is up that makes new worlds";

async fn gateway(
    config: Config,
    sockets: Vec<Sockets>,
    monitor: &Monitor,
    figures: Figures,
) -> Result<(), RunError> {
    let worlds = monitor.condition("worlds", NO_WORLDS);
    let bus =
        Bus::open(BusConfig { connect: config.connect.clone(), ..BusConfig::default() }).await?;
    let ports: Vec<String> = config.endpoints.iter().map(|ports| ports.calls.to_string()).collect();
    let alive = Alive {
        kind: ServiceKind::Gateway,
        id: config.id.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        pid: std::process::id(),
        capacity: CAPACITY,
        detail: format!("{}:{}", config.host, ports.join(",")),
    };
    let _announcement = bus.announce(alive).await?;
    let site = BusSite::start(bus, config.tenant.clone());
    let hosts = site.hosts().clone();
    tokio::spawn(async move { hosts.tell_open(|is_open| worlds.set(is_open, NO_WORLDS)).await });
    let site: Arc<dyn Site> = Arc::new(site);
    let maps = Arc::new(Maps::new(Arc::clone(&site)));
    let mut endpoints = JoinSet::new();
    let mut threads: Vec<Threads> = Vec::with_capacity(sockets.len());
    for sockets in sockets {
        let endpoint = Endpoint::new(
            Arc::clone(&site),
            Arc::clone(&maps),
            config.world.clone(),
            sockets.ports,
            runtime::Handle::current(),
            figures.streams.clone(),
        );
        let (calls, streams) = (sockets.calls.into_std()?, sockets.streams.into_std()?);
        let own = threads_of(sockets.ports.calls)?;
        own.spawn(monitor.pulse(&format!("carla-{}", sockets.ports.calls)).beat_for_ever());
        let late_comers = LateComers::new(monitor.clone());
        let attending = attend(endpoint, calls, streams, late_comers, figures.clone());
        endpoints.spawn_on(attending, own.handle());
        threads.push(Threads(Some(own)));
    }
    monitor.set_started();
    // None ends unless something is wrong; whoever watches over this process starts it again.
    match endpoints.join_next().await {
        Some(Ok(ended)) => Ok(ended?),
        Some(Err(cause)) => Err(RunError::Endpoint(cause)),
        None => Ok(()),
    }
}

/// An endpoint's own threads, which nobody waits for at the end.
struct Threads(Option<Runtime>);

impl Drop for Threads {
    fn drop(&mut self) {
        if let Some(runtime) = self.0.take() {
            runtime.shutdown_background();
        }
    }
}

/// One thread that works: on its way through many a call would wait for four of them to wake.
fn threads_of(port: u16) -> Result<Runtime, std::io::Error> {
    let mut threads = runtime::Builder::new_multi_thread();
    threads.worker_threads(1).thread_name(format!("carla-{port}")).enable_all().build()
}

/// Serves an endpoint with all its sockets.
async fn attend(
    endpoint: Endpoint,
    calls: std::net::TcpListener,
    streams: std::net::TcpListener,
    late_comers: LateComers,
    figures: Figures,
) -> Result<(), std::io::Error> {
    let (calls, streams) = (TcpListener::from_std(calls)?, TcpListener::from_std(streams)?);
    let (events, told) = mpsc::channel(EVENTS_MAX);
    tokio::spawn(stream::serve(streams, Arc::clone(&endpoint.hub)));
    tokio::spawn(rpc::serve(calls, events));
    let WorldConfig { period, sync_lease, .. } = endpoint.config;
    let lobby = Lobby::new(period, sync_lease, Instant::now());
    let server = Server::new(lobby, told, endpoint.stream_port, late_comers, figures);
    server.run(endpoint).await;
    Ok(())
}
