//! `causeway router`: a meeting point of the bus for services on several machines.

use std::time::Duration;

use bus::{Bus, BusAddress, BusConfig, BusError, IdentityArgs};
use schemas::Tenant;
use signals::Termination;

use crate::failure::Failure;
use crate::watched::{self, AdminArgs};

/// Settings of a router.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Where services and clients connect. With tcp/ anybody who reaches it may do anything, with
    /// tls/ the common name of a certificate says what.
    #[arg(long, value_name = "(tcp|tls)/HOST:PORT", default_value = "tcp/127.0.0.1:7460")]
    listen: Vec<BusAddress>,
    /// Other routers to join.
    #[arg(long, value_name = "(tcp|tls)/HOST:PORT")]
    connect: Vec<BusAddress>,
    #[command(flatten)]
    identity: IdentityArgs,
    /// Tenants whose certificates, tenant-NAME, may watch their own worlds
    #[arg(long, value_name = "TENANT")]
    watcher: Vec<Tenant>,
    #[command(flatten)]
    admin: AdminArgs,
}

/// Passes traffic on until SIGINT or SIGTERM.
///
/// # Errors
/// When an address cannot be taken.
pub(crate) fn run(args: Args) -> Result<(), Failure> {
    let monitor = watched::begin("router", args.admin, Duration::ZERO)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::of(&error))?;
    runtime.block_on(async {
        let mut termination = Termination::follow().map_err(|error| Failure::of(&error))?;
        tokio::spawn(monitor.pulse("runtime").beat_for_ever());
        // A router that is to be joined may hang.
        let routing = async {
            let bus = open(args).await?;
            bus.export(monitor.metrics());
            monitor.set_started();
            std::future::pending::<Result<(), BusError>>().await
        };
        tokio::select! {
            routed = routing => routed.map_err(|error| Failure::of(&error)),
            () = termination.requested() => Ok(()),
        }
    })
}

async fn open(args: Args) -> Result<Bus, BusError> {
    let config = BusConfig {
        listen: args.listen,
        connect: args.connect,
        identity: args.identity.identity(),
        watchers: args.watcher,
        ..BusConfig::default()
    };
    let bus = Bus::open(config).await?;
    for address in bus.listening() {
        tracing::info!("routing on {address}");
    }
    Ok(bus)
}
