//! Where a client runs, and ports of this machine that its process needs.

use std::net::{IpAddr, SocketAddr};
use std::sync::LazyLock;

use port_lending::{Peer, ask_for};
use tokio::sync::Semaphore;

/// Clients that are looked for at once; more are not helped.
const LOOKUPS_MAX: usize = 4;

static LOOKUPS: LazyLock<Semaphore> = LazyLock::new(|| Semaphore::new(LOOKUPS_MAX));

/// Both ends of a client's connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whereabouts {
    /// Ours.
    pub(crate) here: SocketAddr,
    /// The client's.
    pub(crate) there: SocketAddr,
}

impl Whereabouts {
    /// The client's host.
    pub(crate) fn address(self) -> IpAddr {
        self.there.ip()
    }

    /// Whether that is this machine.
    pub(crate) fn is_here(self) -> bool {
        self.here.ip() == self.there.ip()
    }

    /// Has whoever offers a port lend it to the client's process, for its Traffic Manager.
    ///
    /// A question alone borrows nothing: the process must be of our user and, like every program
    /// with CARLA's client library in it, listen to a stream of this endpoint, on the port
    /// `streams`.
    pub(crate) async fn borrow_port(self, port: u16, streams: u16) {
        let Ok(_seat) = LOOKUPS.try_acquire() else { return };
        let look = move || {
            Peer::of(self.here, self.there).filter(|client| client.is_connected_to(streams))
        };
        let Ok(Some(client)) = tokio::task::spawn_blocking(look).await else {
            return tracing::debug!(port, client = %self.there, "no port is lent to a stranger");
        };
        match ask_for(port, client.pid).await {
            Ok(()) => tracing::info!(port, client = %self.there, "a Traffic Manager may start"),
            Err(cause) => tracing::debug!(port, %cause, "nobody lends the port"),
        }
    }
}
