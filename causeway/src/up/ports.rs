//! Are the ports free? Asked before anything starts, so that the answer is one line.

use std::io;
use std::net::{SocketAddr, TcpListener};

use bus::Endpoint;

/// A port that cannot be taken.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot listen on {address} for {purpose}: {cause}; free it, or choose another with {flag}"
)]
pub(crate) struct PortTaken {
    address: String,
    purpose: &'static str,
    flag: &'static str,
    cause: io::Error,
}

/// The address itself, with port 0 replaced by a free one.
pub(crate) fn free_http(address: SocketAddr) -> Result<SocketAddr, PortTaken> {
    TcpListener::bind(address).and_then(|listener| listener.local_addr()).map_err(|cause| {
        PortTaken {
            address: address.to_string(),
            purpose: "OpenEnv clients",
            flag: "--http",
            cause,
        }
    })
}

/// The port itself, with port 0 replaced by a free one whose successor is free too: streams take
/// it.
pub(crate) fn free_carla(port: u16) -> Result<u16, PortTaken> {
    /// Ports that are tried for a pair.
    const ATTEMPTS: usize = 64;
    let mut outcome = bind_pair(port);
    for _ in 0..ATTEMPTS {
        if port != 0 || outcome.is_ok() {
            break;
        }
        outcome = bind_pair(0);
    }
    outcome.map_err(|(port, cause)| PortTaken {
        address: format!("127.0.0.1:{port}"),
        purpose: "CARLA clients",
        flag: "--carla",
        cause,
    })
}

fn bind_pair(port: u16) -> Result<u16, (u16, io::Error)> {
    let bind = |port: u16| TcpListener::bind(("127.0.0.1", port)).map_err(|cause| (port, cause));
    let calls = bind(port)?;
    let port = calls.local_addr().map_err(|cause| (port, cause))?.port();
    let next = port.checked_add(1).ok_or_else(|| (port, io::ErrorKind::AddrInUse.into()))?;
    bind(next).map(|_| port)
}

/// The endpoint itself, with port 0 replaced by a free one.
pub(crate) fn free_bus(endpoint: &Endpoint) -> Result<Endpoint, PortTaken> {
    bind_endpoint(endpoint).map_err(|cause| PortTaken {
        address: endpoint.to_string(),
        purpose: "the bus",
        flag: "--bus",
        cause,
    })
}

fn bind_endpoint(endpoint: &Endpoint) -> io::Result<Endpoint> {
    let text = endpoint.to_string();
    let address = text.trim_start_matches("tcp/");
    let port = TcpListener::bind(address)?.local_addr()?.port();
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
    format!("tcp/{host}:{port}").parse().map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_taken_port_is_named_with_the_flag_that_chooses_another() {
        let holder = TcpListener::bind("127.0.0.1:0").unwrap();
        let taken = holder.local_addr().unwrap();
        let refusal = free_http(taken).unwrap_err().to_string();
        assert!(refusal.contains(&taken.to_string()), "{refusal}");
        assert!(refusal.contains("--http"), "{refusal}");
        let refusal = free_bus(&Endpoint::loopback(taken.port())).unwrap_err().to_string();
        assert!(refusal.contains("--bus"), "{refusal}");
    }

    #[test]
    fn port_zero_becomes_a_free_one() {
        assert_ne!(free_http(([127, 0, 0, 1], 0).into()).unwrap().port(), 0);
        assert_ne!(free_bus(&Endpoint::loopback(0)).unwrap().port(), 0);
    }
}
