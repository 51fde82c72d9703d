//! Wires everything together; the only place that starts a runtime and opens sockets.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::serve::{Listener as _, ListenerExt as _};
use bus::{Bus, BusConfig};
use schemas::{Alive, ServiceKind};
use tokio::sync::watch;

use crate::config::{Args, Config, ConfigError};
use crate::door::{self, Door};
use crate::limits::REAP_EVERY;
use crate::openenv::{self, Face};
use crate::session::Backstage;
use crate::session::table::Sessions;
use crate::world_port::on_bus::BusWorlds;

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
    /// The bus refused.
    #[error(transparent)]
    Bus(#[from] bus::BusError),
    /// The system refused threads or sockets.
    #[error("the system refused: {0}")]
    System(#[from] std::io::Error),
}

/// Runs the service until the process is told to end.
///
/// # Errors
/// [`RunError`] when it cannot start or go on.
pub fn run(args: &Args) -> Result<(), RunError> {
    let config = Config::resolve(args)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let result = runtime.block_on(serve(config));
    runtime.shutdown_timeout(Duration::from_millis(500));
    result
}

async fn serve(config: Config) -> Result<(), RunError> {
    // Before anybody can see that the service is up.
    let told_to_end = told_to_end()?;
    // The port opens before the bus is there: a client that comes at once waits instead of failing.
    let address = config.http;
    let listen_error = |cause| RunError::Listen { address, cause };
    let (wishes, is_wanted) = watch::channel(false);
    let door = Door::open(address, is_wanted).await.map_err(listen_error)?;
    let address = door.local_addr().map_err(listen_error)?;

    let (bus_sender, bus) = watch::channel(None);
    let port = Arc::new(BusWorlds::start(bus, config.tenant.clone(), config.id.clone()));
    let backstage = Arc::new(Backstage::new(port, config.default_scenario.clone(), config.profile));
    let sessions =
        Arc::new(Sessions::new(Arc::clone(&backstage), config.sessions_max, config.idle));
    let face = Face { sessions: Arc::clone(&sessions), mode: config.mode };
    let router = openenv::router(Arc::new(face));
    tokio::spawn(reap(Arc::clone(&sessions)));
    tokio::spawn(warm_up(backstage));
    tracing::info!(%address, "OpenEnv face listens");

    let on_bus = join_bus(&config, address, bus_sender, wishes);
    // Small answers must not wait for the acknowledgement of earlier ones.
    let door = door.tap_io(|stream| {
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "a connection stays with delayed sending");
        }
    });
    tokio::select! {
        served = axum::serve(door, router).into_future() => served.map_err(RunError::System),
        joined = on_bus => joined.map(|never| match never {}),
        () = told_to_end => Ok(()),
    }
}

/// Connects, says that this service is up, and stays.
async fn join_bus(
    config: &Config,
    address: SocketAddr,
    bus_sender: watch::Sender<Option<Bus>>,
    wishes: watch::Sender<bool>,
) -> Result<std::convert::Infallible, RunError> {
    let bus =
        Bus::open(BusConfig { connect: config.connect.clone(), ..BusConfig::default() }).await?;
    let alive = Alive {
        kind: ServiceKind::Scenario,
        id: config.id.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        pid: std::process::id(),
        capacity: config.sessions_max,
        detail: format!("http://{address}"),
    };
    let _announcement = bus.announce(alive).await?;
    bus_sender.send_replace(Some(bus.clone()));
    Ok(door::follow_wishes(&bus, address.port(), wishes).await?)
}

/// Has the default map ready before the first client asks for it.
async fn warm_up(backstage: Arc<Backstage>) {
    if let Err(error) = backstage.warm_up().await {
        tracing::warn!(%error, "the default map is not ready yet");
    }
}

async fn reap(sessions: Arc<Sessions>) {
    let mut every = tokio::time::interval(REAP_EVERY);
    loop {
        every.tick().await;
        sessions.reap();
    }
}

/// Follows signals from now on; the future ends with the first that ends the service.
fn told_to_end() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    })
}
