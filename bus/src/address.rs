//! Addresses of the bus, as people type them.

use std::fmt;
use std::net::{TcpListener, ToSocketAddrs};
use std::str::FromStr;
use std::sync::LazyLock;

/// Where the services of a site meet unless they are told: on the host that `CARLA_HOST` names,
/// which is this one where it names none. The text of a [`BusAddress`], if that names a host.
pub fn site_address() -> &'static str {
    static ADDRESS: LazyLock<String> =
        LazyLock::new(|| site_on(std::env::var("CARLA_HOST").ok().as_deref()));
    &ADDRESS
}

fn site_on(host: Option<&str>) -> String {
    format!("tcp/{}:7460", host.filter(|host| !host.is_empty()).unwrap_or("127.0.0.1"))
}

/// An address of the bus, e.g. `tcp/127.0.0.1:7460`, or `tls/world.example:7460` where both sides
/// show certificates.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct BusAddress {
    is_tls: bool,
    host: String,
    port: u16,
}

/// Why a text is not an [`BusAddress`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a bus address is tcp/HOST:PORT, e.g. tcp/127.0.0.1:7460, or tls/HOST:PORT, not {found:?}")]
pub struct InvalidBusAddress {
    /// The text, cut to 128 characters.
    pub found: String,
}

impl BusAddress {
    /// A port of this host's loopback; port 0 means any free one.
    pub fn loopback(port: u16) -> Self {
        Self { is_tls: false, host: "127.0.0.1".to_owned(), port }
    }

    /// Whether both sides show certificates.
    pub fn is_tls(&self) -> bool {
        self.is_tls
    }

    /// The port.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// The same address with port 0 replaced by one that is free now.
    pub(crate) fn with_port(&self) -> std::io::Result<Self> {
        if self.port != 0 {
            return Ok(self.clone());
        }
        let port = self.bind()?.local_addr()?.port();
        Ok(Self { port, ..self.clone() })
    }

    /// Takes the port, to see whether it can be taken.
    pub(crate) fn bind(&self) -> std::io::Result<TcpListener> {
        let host = self.host.trim_start_matches('[').trim_end_matches(']');
        let addresses: Vec<_> = (host, self.port).to_socket_addrs()?.collect();
        TcpListener::bind(addresses.as_slice())
    }
}

impl FromStr for BusAddress {
    type Err = InvalidBusAddress;

    fn from_str(text: &str) -> Result<Self, InvalidBusAddress> {
        let parse = || {
            let (protocol, place) = text.split_once('/')?;
            let is_tls = protocol == "tls";
            if !is_tls && protocol != "tcp" {
                return None;
            }
            let (host, port) = place.rsplit_once(':')?;
            let in_brackets = host.starts_with('[') && host.ends_with(']');
            let of_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
            let of_ip6 = |c: char| c.is_ascii_hexdigit() || matches!(c, ':' | '.' | '[' | ']');
            let well_formed =
                if in_brackets { host.chars().all(of_ip6) } else { host.chars().all(of_name) };
            let port = port.parse().ok()?;
            (!host.is_empty() && well_formed).then(|| Self { is_tls, host: host.to_owned(), port })
        };
        parse().ok_or_else(|| InvalidBusAddress { found: text.chars().take(128).collect() })
    }
}

impl fmt::Display for BusAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let protocol = if self.is_tls { "tls" } else { "tcp" };
        write!(f, "{protocol}/{}:{}", self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_parses_back() {
        for text in ["tcp/127.0.0.1:7460", "tls/world-0.site:1", "tcp/[::1]:65535"] {
            assert_eq!(text.parse::<BusAddress>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn a_site_is_on_the_host_that_is_named() {
        for (host, text) in [
            (None, "tcp/127.0.0.1:7460"),
            (Some(""), "tcp/127.0.0.1:7460"),
            (Some("gpu-server.lab"), "tcp/gpu-server.lab:7460"),
        ] {
            assert_eq!(site_on(host), text);
            assert!(text.parse::<BusAddress>().is_ok());
        }
        assert!(site_on(Some("two words")).parse::<BusAddress>().is_err());
    }

    #[test]
    fn other_texts_are_refused_with_an_example() {
        for text in [
            "",
            "127.0.0.1:7460",
            "udp/127.0.0.1:1",
            "tcp/:1",
            "tcp/host",
            "tcp/host:70000",
            "tcp/a#b:1",
        ] {
            let refusal = text.parse::<BusAddress>().unwrap_err().to_string();
            assert!(refusal.contains("tcp/127.0.0.1:7460"), "{refusal}");
        }
    }

    #[test]
    fn port_zero_becomes_a_free_port() {
        assert_ne!(BusAddress::loopback(0).with_port().unwrap().port(), 0);
        assert_eq!(BusAddress::loopback(5).with_port().unwrap().port(), 5);
    }
}
