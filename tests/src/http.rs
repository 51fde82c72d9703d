//! The smallest HTTP client.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};

use crate::SOON;

/// The whole answer to a GET, status line first.
///
/// # Errors
/// When nobody listens or the connection ends early.
pub fn get(address: SocketAddr, path: &str) -> io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&address, SOON)?;
    stream.set_read_timeout(Some(SOON))?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer)
}
