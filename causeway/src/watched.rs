//! What every service takes besides its own settings: where it is asked how it is, how long it may
//! take to end, and where who did what is written down.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
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

/// Where who did what is written down.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct AuditArgs {
    /// Folder for who came and did what, in lines of JSON, a file for each kind of service; at most
    /// two of 16 MiB each [default: nothing is written]
    #[arg(long, env = "CAUSEWAY_AUDIT", value_name = "DIR")]
    pub(crate) audit: Option<PathBuf>,
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
    #[command(flatten)]
    audit: AuditArgs,
}

impl<A: clap::Args> Watched<A> {
    /// Where who did what is written down.
    pub(crate) fn audit(&self) -> Option<&Path> {
        self.audit.audit.as_deref()
    }

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
