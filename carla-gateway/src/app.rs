//! Wires endpoints to sockets and the bus; the only place that starts a runtime.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bus::{Bus, BusConfig, BusError};
use monitoring::Monitor;
use schemas::{Alive, ServiceId, ServiceKind};
use seats::Seats;
use signals::Termination;
use tenancy::{Door, DoorError, FOLLOW_EVERY};
use tokio::net::TcpListener;
use tokio::runtime::{self, Runtime};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::Instant;
use worlds::Worlds;

use crate::allowance::Allowance;
use crate::collecting_site::CollectingSite;
use crate::config::{Args, Config, ConfigError, EndpointConfig};
use crate::endpoint::Endpoint;
use crate::figures::Figures;
use crate::guests::{Entrance, Guests};
use crate::lobby::Lobby;
use crate::maps::Maps;
use crate::server::{EVENTS_MAX, LateComers, Server};
use crate::site::{PATIENCE, Site};
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
    /// The file of tenants cannot be used.
    #[error("--tokens: {0}")]
    Tokens(#[from] DoorError),
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
    endpoint: EndpointConfig,
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
    let door = Arc::new(match &config.tokens {
        Some(path) => Door::with_tokens(path)?,
        None => Door::open(config.tenant.clone()),
    });
    let mut termination = Termination::follow()?;
    tokio::spawn(monitor.pulse("runtime").beat_for_ever());
    let figures = Figures::new(monitor.metrics());
    let clients = figures.clients.clone();
    // The ports open before the bus is there: a client that comes at once waits instead of failing.
    let mut sockets = Vec::with_capacity(config.endpoints.len());
    for endpoint in &config.endpoints {
        sockets.push(open(&config, endpoint).await?);
    }
    tokio::select! {
        result = gateway(config, door, sockets, (monitor, figures)) => result,
        () = termination.drained(monitor, "clients", move || clients.count()) => Ok(()),
    }
}

async fn open(config: &Config, endpoint: &EndpointConfig) -> Result<Sockets, RunError> {
    let listen = async |port| {
        let address = SocketAddr::new(config.host, port);
        let listening = TcpListener::bind(address).await;
        listening.map_err(|cause| RunError::Listen { address, cause })
    };
    let ports = endpoint.ports;
    let (calls, streams) = (listen(ports.calls).await?, listen(ports.streams).await?);
    let address = SocketAddr::new(config.host, ports.calls);
    let (tenant, version) = (&endpoint.tenant, endpoint.version.name());
    tracing::info!(%address, %tenant, version, "CARLA clients may connect");
    Ok(Sockets { endpoint: endpoint.clone(), calls, streams })
}

/// Why nobody can be served.
const NO_WORLDS: &str = "no world service is up that makes new worlds";

async fn gateway(
    config: Config,
    door: Arc<Door>,
    sockets: Vec<Sockets>,
    (monitor, figures): (&Monitor, Figures),
) -> Result<(), RunError> {
    let worlds = monitor.condition("worlds", NO_WORLDS);
    let recovery = config.recovery();
    monitor.metrics().read_gauge(
        "causeway_gateway_recovery_bytes",
        "Bytes kept to make worlds again",
        move || recovery.used() as f64,
    );
    let (connect, identity) = (config.connect.clone(), config.identity.clone());
    let bus = Bus::open(BusConfig { connect, identity, ..BusConfig::default() }).await?;
    bus.export(monitor.metrics());
    let _announcement = bus.announce(alive(&config)).await?;
    let connected = watch::Sender::new(Some(bus)).subscribe();
    let (tenant, owner) = (config.tenant.clone(), config.id.clone());
    let services = Worlds::follow(connected, tenant, owner, PATIENCE);
    let hosts = services.hosts().clone();
    tokio::spawn(async move { hosts.tell_open(|is_open| worlds.set(is_open, NO_WORLDS)).await });
    tokio::spawn(follow(Arc::clone(&door)));
    let (mut sites, mut allowances) = (BTreeMap::new(), BTreeMap::new());
    let mut endpoints = JoinSet::new();
    let mut threads: Vec<Threads> = Vec::with_capacity(sockets.len());
    for Sockets { endpoint: own, calls, streams } in sockets {
        let tenant = &own.tenant;
        let (site, maps) = sites
            .entry(tenant.clone())
            .or_insert_with(|| site_of(services.for_tenant(tenant.clone()), &config.id));
        let allowance = allowances.entry(tenant.clone()).or_insert_with(|| {
            Allowance::new(Arc::clone(&door), tenant.clone(), figures.quotas.clone())
        });
        let endpoint = Endpoint::new(
            Arc::clone(site),
            Arc::clone(maps),
            config.world_of(&own, allowance.clone()),
            own.ports,
            runtime::Handle::current(),
            (figures.streams.clone(), figures.worlds.clone()),
        );
        let doors =
            Doors { calls: calls.into_std()?, streams: streams.into_std()?, guests: own.guests };
        let thread = threads_of(own.ports.calls)?;
        thread.spawn(monitor.pulse(&format!("carla-{}", own.ports.calls)).beat_for_ever());
        let late_comers = LateComers::new(monitor.clone());
        let attending = attend(endpoint, doors, late_comers, figures.clone());
        endpoints.spawn_on(attending, thread.handle());
        threads.push(Threads(Some(thread)));
    }
    monitor.set_started();
    // None ends unless something is wrong; whoever watches over this process starts it again.
    match endpoints.join_next().await {
        Some(Ok(ended)) => Ok(ended?),
        Some(Err(cause)) => Err(RunError::Endpoint(cause)),
        None => Ok(()),
    }
}

/// What others are told of this service.
fn alive(config: &Config) -> Alive {
    let ports: Vec<String> =
        config.endpoints.iter().map(|endpoint| endpoint.ports.calls.to_string()).collect();
    Alive {
        kind: ServiceKind::Gateway,
        id: config.id.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        pid: std::process::id(),
        capacity: CAPACITY,
        detail: format!("{}:{}", config.host, ports.join(",")),
        number: 0,
    }
}

/// What endpoints of a tenant share: worlds of which strays are freed for ever, and maps.
fn site_of(worlds: Worlds, owner: &ServiceId) -> (Arc<dyn Site>, Arc<Maps>) {
    let site: Arc<dyn Site> = CollectingSite::start(Arc::new(worlds), owner.clone());
    let maps = Arc::new(Maps::new(Arc::clone(&site)));
    (site, maps)
}

/// Notices that the file of tenants has changed.
async fn follow(door: Arc<Door>) {
    loop {
        tokio::time::sleep(FOLLOW_EVERY).await;
        door.follow();
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

/// Both sockets of an endpoint on their way to its thread, and who may come in by them.
struct Doors {
    calls: std::net::TcpListener,
    streams: std::net::TcpListener,
    guests: Guests,
}

/// Serves an endpoint with all its sockets.
async fn attend(
    endpoint: Endpoint,
    doors: Doors,
    late_comers: LateComers,
    figures: Figures,
) -> Result<(), std::io::Error> {
    let Doors { calls, streams, guests } = doors;
    let (calls, streams) = (TcpListener::from_std(calls)?, TcpListener::from_std(streams)?);
    let (events, told) = mpsc::channel(EVENTS_MAX);
    let tenant = endpoint.config.allowance.tenant();
    let entrance = |listener, seats| Entrance::new(listener, guests.clone(), tenant.clone(), seats);
    let streams = entrance(streams, stream::seats());
    let calls = entrance(calls, Seats::new(rpc::CONNECTIONS_MAX));
    tokio::spawn(stream::serve(streams, Arc::clone(&endpoint.hub)));
    tokio::spawn(rpc::serve(calls, events));
    let lobby = Lobby::new(endpoint.config.pacing, endpoint.config.version, Instant::now());
    let server = Server::new(lobby, told, endpoint.stream_port, late_comers, figures);
    server.run(endpoint).await;
    Ok(())
}
