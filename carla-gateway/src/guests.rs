//! From which addresses clients may connect: CARLA's client has no place for a secret, so a port is
//! its tenant's, and who reaches it is decided by address.

use std::fmt;
use std::net::IpAddr;
use std::str::FromStr;
use std::time::Instant;

use ipnetwork::IpNetwork;
use schemas::Tenant;
use seats::{Seat, Seats};
use tenancy::Seldom;
use tokio::net::{TcpListener, TcpStream};

/// Networks of one endpoint; without any, everybody who reaches its ports.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Guests(pub(crate) Vec<IpNetwork>);

/// A port of an endpoint, by which its guests come in.
pub(crate) struct Entrance {
    listener: TcpListener,
    guests: Guests,
    /// Whose the port is.
    pub(crate) tenant: Tenant,
    seats: Seats,
    /// As they are written down: whoever tries on and on fills no log.
    refusals: Seldom<()>,
}

/// A network that an endpoint may be reached from, as typed: `PORT=ADDRESS/BITS`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allowed {
    pub(crate) port: u16,
    pub(crate) network: IpNetwork,
}

impl Allowed {
    /// Of the endpoint.
    pub fn port(&self) -> u16 {
        self.port
    }
}

impl FromStr for Allowed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let read = |(port, network): (&str, &str)| {
            let network: IpNetwork = network.parse().ok()?;
            // Addresses of IPv4 are compared as such.
            let is_canonical = network.ip().to_canonical() == network.ip();
            is_canonical.then_some(Self { port: port.parse().ok()?, network })
        };
        let found = || format!("wanted PORT=ADDRESS/BITS, e.g. 2000=10.0.3.0/24, found {text:?}");
        text.split_once('=').and_then(read).ok_or_else(found)
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.port, self.network)
    }
}

impl Guests {
    fn admits(&self, address: IpAddr) -> bool {
        let address = address.to_canonical();
        self.0.is_empty() || self.0.iter().any(|network| network.contains(address))
    }
}

impl Entrance {
    /// With these seats.
    pub(crate) fn new(listener: TcpListener, guests: Guests, tenant: Tenant, seats: Seats) -> Self {
        Self { listener, guests, tenant, seats, refusals: Seldom::default() }
    }

    /// The next connection of a guest, and its seat. Others are closed before they say anything.
    pub(crate) async fn accept(&self) -> (TcpStream, Seat) {
        loop {
            let (socket, address) = self.seats.accept(&self.listener).await;
            if self.guests.admits(address.ip()) {
                return (socket, self.seats.take(address.ip()).await);
            }
            if self.refusals.may_tell((), Instant::now()) {
                let port = self.listener.local_addr().map_or(0, |here| here.port());
                let (tenant, what) = (&self.tenant, "connection refused: not in --allow");
                tracing::warn!(target: "audit", %tenant, peer = %address, port, "{what}");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_network_admits_its_addresses_only() {
        let allowed: Allowed = "2000=10.0.3.0/24".parse().unwrap();
        assert_eq!(allowed.port, 2000);
        let guests = Guests(vec![allowed.network]);
        for (address, admitted) in
            [("10.0.3.9", true), ("::ffff:10.0.3.9", true), ("10.0.4.9", false), ("::1", false)]
        {
            assert_eq!(guests.admits(address.parse().unwrap()), admitted, "{address}");
        }
        assert!(Guests::default().admits("10.0.4.9".parse().unwrap()));
    }

    #[test]
    fn what_is_no_network_is_refused() {
        for text in
            ["", "2000", "2000=", "2000=10.0.3.0/33", "x=10.0.3.0/24", "2000=::ffff:10.0.3.0/120"]
        {
            assert!(text.parse::<Allowed>().unwrap_err().contains("PORT=ADDRESS/BITS"), "{text}");
        }
    }

    #[tokio::test]
    async fn a_stranger_is_closed_and_the_next_guest_is_served() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let nobody = Guests(vec!["10.0.3.0/24".parse().unwrap()]);
        let entrance = Entrance::new(listener, nobody, "alice".parse().unwrap(), Seats::new(1));
        let refused = tokio::spawn(async move { entrance.accept().await });
        let stranger = TcpStream::connect(address).await.unwrap();
        stranger.readable().await.unwrap();
        assert_eq!(stranger.try_read(&mut [0; 1]).unwrap_or(0), 0, "closed without a word");
        assert!(!refused.is_finished());
        refused.abort();
    }
}
