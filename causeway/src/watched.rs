//! What every service takes besides its own settings: where it is asked how it is, and how long it
//! may take to end.

use std::net::SocketAddr;
use std::time::Duration;

use monitoring::Monitor;

use crate::failure::Failure;

/// A day: whoever wants to wait longer does not want an end.
const DRAIN_SECS_MAX: u64 = 86_400;

/// Where a process is asked how it is.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct AdminArgs {
    /// Where probes and Prometheus ask how this process is: /livez, /readyz, /startupz, /metrics;
    /// `causeway health` asks there too [default: nowhere]
    #[arg(long, env = "CAUSEWAY_ADMIN", value_name = "[IP:]PORT", value_parser = admin::address)]
    pub(crate) admin: Option<SocketAddr>,
}

/// How long a process may take to end.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct DrainArgs {
    /// After the first SIGTERM or SIGINT take nothing new, and end when all that goes on has ended
    /// or after so many seconds; a second signal ends at once
    #[arg(long, value_name = "SECS", default_value_t = 0,
        value_parser = clap::value_parser!(u64).range(..=DRAIN_SECS_MAX))]
    pub(crate) drain_secs: u64,
}

/// A service with what watches over it.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Watched<A: clap::Args> {
    #[command(flatten)]
    pub(crate) service: A,
    #[command(flatten)]
    admin: AdminArgs,
    #[command(flatten)]
    drain: DrainArgs,
}

impl<A: clap::Args> Watched<A> {
    /// The service's settings, and its monitor, which answers from now on.
    ///
    /// # Errors
    /// When the address cannot be used.
    pub(crate) fn begin(self, service: &'static str) -> Result<(A, Monitor), Failure> {
        let monitor = begin(service, self.admin, Duration::from_secs(self.drain.drain_secs))?;
        Ok((self.service, monitor))
    }
}

/// A monitor that answers from now on.
///
/// # Errors
/// When the address cannot be used.
pub(crate) fn begin(
    service: &'static str,
    AdminArgs { admin }: AdminArgs,
    window: Duration,
) -> Result<Monitor, Failure> {
    let monitor = Monitor::new(service, env!("CARGO_PKG_VERSION"), window);
    if let Some(address) = admin {
        let refused = |cause| Failure::usage(&AdminTaken { address, cause });
        let address = admin::serve(address, &monitor).map_err(refused)?;
        tracing::info!(%address, "probes and figures");
    }
    Ok(monitor)
}

/// Where nobody can be asked.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address} for probes: {cause}; free it, or choose another with --admin")]
struct AdminTaken {
    address: SocketAddr,
    cause: std::io::Error,
}
