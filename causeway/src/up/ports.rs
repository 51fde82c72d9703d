//! Are the ports free? Asked before anything starts, so that the answer is one line.

use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener};

use bus::BusAddress;

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

/// The address itself, with port 0 replaced by a free one. One that somebody holds is as good: the
/// OpenEnv face takes it when it is free, and the rest of the site works meanwhile.
pub(crate) fn usable_http(address: SocketAddr) -> Result<SocketAddr, PortTaken> {
    match TcpListener::bind(address).and_then(|listener| listener.local_addr()) {
        Ok(address) => Ok(address),
        Err(taken) if taken.kind() == io::ErrorKind::AddrInUse => Ok(address),
        Err(cause) => Err(PortTaken {
            address: address.to_string(),
            purpose: "OpenEnv clients",
            flag: "--http",
            cause,
        }),
    }
}

/// The ports of calls and of streams, with port 0 replaced by a free one; that of the streams is
/// the next one unless told.
pub(crate) fn free_carla(
    host: IpAddr,
    port: u16,
    streams: Option<u16>,
) -> Result<(u16, u16), PortTaken> {
    /// Ports that are tried for a pair.
    const ATTEMPTS: usize = 64;
    let mut outcome = bind_pair(host, port, streams);
    for _ in 0..ATTEMPTS {
        if port != 0 || outcome.is_ok() {
            break;
        }
        outcome = bind_pair(host, 0, streams);
    }
    outcome.map_err(|(port, cause)| PortTaken {
        address: SocketAddr::from((host, port)).to_string(),
        purpose: "CARLA clients",
        flag: if Some(port) == streams { "--carla-stream" } else { "--carla" },
        cause,
    })
}

/// A port that was asked for, and why it cannot be had.
type Refused = (u16, io::Error);

fn bind_pair(host: IpAddr, port: u16, streams: Option<u16>) -> Result<(u16, u16), Refused> {
    let (calls, _held) = bind(host, port)?;
    let none = || (calls, io::Error::other("streams have the port after it, and there is none"));
    let next = || calls.checked_add(1).ok_or_else(none);
    let (streams, _) = bind(host, streams.map_or_else(next, Ok)?)?;
    Ok((calls, streams))
}

/// The port itself, with port 0 replaced by a free one, while the listener lives.
fn bind(host: IpAddr, port: u16) -> Result<(u16, TcpListener), Refused> {
    let listener = TcpListener::bind((host, port)).map_err(|cause| (port, cause))?;
    let port = listener.local_addr().map_err(|cause| (port, cause))?.port();
    Ok((port, listener))
}

/// The address itself, with port 0 replaced by a free one, if the `count` ports after it are free
/// too.
pub(crate) fn free_admin(address: SocketAddr, count: usize) -> Result<SocketAddr, PortTaken> {
    /// Places that are tried for a row.
    const ATTEMPTS: usize = 64;
    let mut outcome = bind_row(address, count);
    for _ in 0..ATTEMPTS {
        if address.port() != 0 || outcome.is_ok() {
            break;
        }
        outcome = bind_row(address, count);
    }
    outcome.map_err(|(address, cause)| PortTaken {
        address: address.to_string(),
        purpose: "probes",
        flag: "--admin",
        cause,
    })
}

fn bind_row(address: SocketAddr, count: usize) -> Result<SocketAddr, (SocketAddr, io::Error)> {
    let bind = |address| TcpListener::bind(address).map_err(|cause| (address, cause));
    let first = bind(address)?;
    let address = first.local_addr().map_err(|cause| (address, cause))?;
    let after = (1..=count).map(|offset| u16::try_from(usize::from(address.port()) + offset));
    for port in after {
        let none = |_| (address, io::Error::other("too few ports after it"));
        bind(SocketAddr::new(address.ip(), port.map_err(none)?))?;
    }
    Ok(address)
}

/// The address itself, with port 0 replaced by a free one.
pub(crate) fn free_bus(address: &BusAddress) -> Result<BusAddress, PortTaken> {
    bind_bus(address).map_err(|cause| PortTaken {
        address: address.to_string(),
        purpose: "the bus",
        flag: "--bus",
        cause,
    })
}

fn bind_bus(address: &BusAddress) -> io::Result<BusAddress> {
    let text = address.to_string();
    let (protocol, address) = text.split_once('/').unwrap_or(("tcp", &text));
    let port = TcpListener::bind(address)?.local_addr()?.port();
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
    format!("{protocol}/{host}:{port}").parse().map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_taken_port_is_named_with_the_flag_that_chooses_another() {
        let holder = TcpListener::bind("127.0.0.1:0").unwrap();
        let taken = holder.local_addr().unwrap();
        let refusal = free_bus(&BusAddress::loopback(taken.port())).unwrap_err().to_string();
        assert!(refusal.contains(&taken.to_string()), "{refusal}");
        assert!(refusal.contains("--bus"), "{refusal}");
    }

    #[test]
    fn a_port_of_openenv_clients_may_be_taken_but_its_address_must_be_ours() {
        let holder = TcpListener::bind("127.0.0.1:0").unwrap();
        let taken = holder.local_addr().unwrap();
        assert_eq!(usable_http(taken).unwrap(), taken);
        let foreign = "192.0.2.1:8000".parse().unwrap();
        let refusal = usable_http(foreign).unwrap_err().to_string();
        assert!(refusal.contains("192.0.2.1:8000") && refusal.contains("--http"), "{refusal}");
    }

    #[test]
    fn streams_have_the_next_port_or_any_free_one() {
        let host = IpAddr::from([127, 0, 0, 1]);
        let (calls, streams) = free_carla(host, 0, None).unwrap();
        assert_eq!(streams, calls + 1);
        let (calls, streams) = free_carla(host, calls, Some(0)).unwrap();
        assert!(streams != 0 && streams != calls);
        let refusal = free_carla(host, u16::MAX, None).unwrap_err().to_string();
        assert!(refusal.contains("the port after it, and there is none"), "{refusal}");
        let holder = TcpListener::bind((host, 0)).unwrap();
        let taken = holder.local_addr().unwrap().port();
        let refusal = free_carla(host, 0, Some(taken)).unwrap_err().to_string();
        assert!(refusal.contains("--carla-stream"), "{refusal}");
    }

    #[test]
    fn port_zero_becomes_a_free_one() {
        assert_ne!(usable_http(([127, 0, 0, 1], 0).into()).unwrap().port(), 0);
        assert_ne!(free_bus(&BusAddress::loopback(0)).unwrap().port(), 0);
        let secured = free_bus(&"tls/127.0.0.1:0".parse().unwrap()).unwrap();
        assert!(secured.is_tls() && secured.port() != 0, "{secured}");
    }
}
