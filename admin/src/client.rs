//! One question to a process, by whoever has no other HTTP client.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream};
use std::time::Duration;

/// An answer is shorter.
const ANSWER_BYTES_MAX: u64 = 4 * 1024 * 1024;

/// What a process tells.
#[derive(Debug, PartialEq, Eq)]
pub struct Told {
    /// Of HTTP.
    pub status: u16,
    /// What follows the head.
    pub body: String,
}

impl Told {
    /// Whether it says yes.
    pub fn is_good(&self) -> bool {
        self.status == 200
    }
}

/// Why there is no answer.
#[derive(Debug)]
pub enum AskError {
    /// Nobody is there, or says anything in time.
    Silent(io::Error),
    /// Somebody is there who speaks otherwise.
    Strange(String),
}

impl std::fmt::Display for AskError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Silent(cause) => write!(f, "no answer: {cause}"),
            Self::Strange(found) => write!(f, "wanted an answer of HTTP, found {found:?}"),
        }
    }
}

impl std::error::Error for AskError {}

impl From<io::Error> for AskError {
    fn from(cause: io::Error) -> Self {
        Self::Silent(cause)
    }
}

/// Asks once. All addresses of a machine stand for its loopback.
///
/// # Errors
/// [`AskError`].
pub fn ask(
    address: SocketAddr,
    method: &str,
    path: &str,
    patience: Duration,
) -> Result<Told, AskError> {
    let mut address = address;
    match address {
        SocketAddr::V4(all) if all.ip().is_unspecified() => {
            address.set_ip(Ipv4Addr::LOCALHOST.into());
        }
        SocketAddr::V6(all) if all.ip().is_unspecified() => {
            address.set_ip(Ipv6Addr::LOCALHOST.into());
        }
        _ => {}
    }
    let mut stream = TcpStream::connect_timeout(&address, patience)?;
    stream.set_read_timeout(Some(patience))?;
    stream.set_write_timeout(Some(patience))?;
    let head = format!(
        "{method} {path} HTTP/1.0\r\nHost: {address}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    let mut answer = String::new();
    stream.take(ANSWER_BYTES_MAX).read_to_string(&mut answer)?;
    parsed(&answer).ok_or_else(|| AskError::Strange(answer.chars().take(64).collect()))
}

fn parsed(answer: &str) -> Option<Told> {
    let (head, body) = answer.split_once("\r\n\r\n")?;
    let (version, rest) = head.split_once(' ')?;
    let status = rest.get(..3)?.parse().ok().filter(|_| version.starts_with("HTTP/1."))?;
    Some(Told { status, body: body.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_cut_into_status_and_body() {
        let answer = "HTTP/1.0 503 Service Unavailable\r\ncontent-length: 2\r\n\r\n{}";
        let told = parsed(answer).unwrap();
        assert_eq!(told, Told { status: 503, body: "{}".to_owned() });
        assert!(!told.is_good());
        for strange in ["", "SSH-2.0\r\n\r\n", "HTTP/1.1\r\n\r\n", "HTTP/1.1 x\r\n\r\n"] {
            assert_eq!(parsed(strange), None, "{strange:?}");
        }
    }

    #[test]
    fn nobody_there_is_told_as_such() {
        // Bound, so that nobody else takes it, and not listening.
        let held = tokio::net::TcpSocket::new_v4().unwrap();
        held.bind(([127, 0, 0, 1], 0).into()).unwrap();
        let address = held.local_addr().unwrap();
        let asked = ask(address, "GET", "/livez", Duration::from_secs(30));
        assert!(matches!(asked, Err(AskError::Silent(_))), "{asked:?}");
    }
}
