//! Where a process is asked how it is.

use std::net::{Ipv4Addr, SocketAddr};

/// The usual port.
pub const PORT: u16 = 9464;

/// An address as typed: a port of the loopback, or an address and a port.
///
/// # Errors
/// What was wanted instead.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    match text.parse() {
        Ok(port) => Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port))),
        Err(_) => {
            text.parse().map_err(|_| format!("wanted a port or IP:PORT, e.g. 0.0.0.0:{PORT}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_one_of_the_loopback() {
        assert_eq!(address("9464").unwrap().to_string(), "127.0.0.1:9464");
        assert_eq!(address("0.0.0.0:80").unwrap().to_string(), "0.0.0.0:80");
        assert!(address("somewhere").unwrap_err().contains("IP:PORT"));
    }
}
