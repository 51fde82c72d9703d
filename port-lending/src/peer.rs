//! Which process has a socket, as the kernel tells in `/proc`.
//!
//! **Source:** proc(5), `/proc/net/tcp` and `/proc/pid/fd`.

use std::fs;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use rustix::process::{Pid, geteuid};

/// States of a socket in the kernel's table.
const ESTABLISHED: &str = "01";
const LISTEN: &str = "0A";

/// One row of the kernel's table of TCP sockets.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Row {
    local: SocketAddr,
    remote: SocketAddr,
    state: String,
    uid: u32,
    inode: u64,
}

/// A process of our user at the other end of a TCP connection within this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// The process.
    pub pid: Pid,
    /// Numbers of its sockets.
    sockets: Vec<u64>,
}

impl Peer {
    /// Who is at the other end of a connection from `here` to `there`; `None` when it is on another
    /// machine, in another network namespace or of another user.
    ///
    /// **Cost:** milliseconds, as it looks at every process; not for a thread that others wait for.
    pub fn of(here: SocketAddr, there: SocketAddr) -> Option<Self> {
        let is_its_end = |row: &Row| {
            row.state == ESTABLISHED && row.local == plain(there) && row.remote == plain(here)
        };
        let row = rows().into_iter().find(is_its_end)?;
        if row.uid != geteuid().as_raw() {
            return None;
        }
        let pids = fs::read_dir("/proc").ok()?.flatten();
        let pids = pids.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        pids.filter_map(Pid::from_raw)
            .map(|pid| Self { pid, sockets: sockets_of(pid) })
            .find(|peer| peer.sockets.contains(&row.inode))
    }

    /// Whether it also has a connection to this port of ours.
    pub fn is_connected_to(&self, port: u16) -> bool {
        rows().iter().any(|row| {
            row.state == ESTABLISHED
                && row.remote.port() == port
                && self.sockets.contains(&row.inode)
        })
    }
}

/// Whether a process of our user listens on a port.
pub fn listens(process: Pid, port: u16) -> bool {
    let sockets = sockets_of(process);
    let listens = |row: &Row| row.state == LISTEN && row.local.port() == port;
    rows().iter().any(|row| listens(row) && sockets.contains(&row.inode))
}

fn rows() -> Vec<Row> {
    let tables = ["/proc/self/net/tcp", "/proc/self/net/tcp6"].map(fs::read_to_string);
    tables.iter().flatten().flat_map(|table| table.lines().skip(1).filter_map(row)).collect()
}

fn row(line: &str) -> Option<Row> {
    let mut words = line.split_whitespace().skip(1);
    let (local, remote) = (address(words.next()?)?, address(words.next()?)?);
    let state = words.next()?.to_owned();
    let mut words = words.skip(3);
    let uid = words.next()?.parse().ok()?;
    let inode = words.nth(1)?.parse().ok()?;
    Some(Row { local, remote, state, uid, inode })
}

/// `0100007F:1F90` is 127.0.0.1:8080: every four bytes of the address stand as the machine has
/// them.
fn address(text: &str) -> Option<SocketAddr> {
    let (ip, port) = text.split_once(':')?;
    let port = u16::from_str_radix(port, 16).ok()?;
    let words = ip.as_bytes().chunks(8).map(|word| {
        let word = std::str::from_utf8(word).ok()?;
        Some(u32::from_str_radix(word, 16).ok()?.to_ne_bytes())
    });
    let bytes: Vec<u8> = words.collect::<Option<Vec<_>>>()?.concat();
    let ip: IpAddr = match <[u8; 4]>::try_from(bytes.as_slice()) {
        Ok(four) => Ipv4Addr::from(four).into(),
        Err(_) => Ipv6Addr::from(<[u8; 16]>::try_from(bytes.as_slice()).ok()?).into(),
    };
    Some(plain(SocketAddr::new(ip, port)))
}

/// An IPv4 address that was written as an IPv6 one is itself.
fn plain(address: SocketAddr) -> SocketAddr {
    SocketAddr::new(address.ip().to_canonical(), address.port())
}

fn sockets_of(pid: Pid) -> Vec<u64> {
    let folder = format!("/proc/{}/fd", pid.as_raw_nonzero());
    // Those of other users cannot be looked at, and a process may end meanwhile.
    let Ok(files) = fs::read_dir(folder) else { return Vec::new() };
    let inode = |entry: fs::DirEntry| {
        let target = fs::read_link(entry.path()).ok()?;
        target.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok()
    };
    files.flatten().filter_map(inode).collect()
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use rustix::process::getpid;

    use super::*;

    #[test]
    fn the_process_behind_a_connection_is_found_with_its_other_connections() {
        for host in ["127.0.0.1:0", "[::1]:0"] {
            // Where there is no IPv6, one of the two says enough.
            let Ok(listener) = TcpListener::bind(host) else { continue };
            let other = TcpListener::bind("127.0.0.1:0").unwrap();
            let here = listener.local_addr().unwrap();
            let stream = TcpStream::connect(here).unwrap();
            let there = stream.local_addr().unwrap();
            let other_port = other.local_addr().unwrap().port();
            let peer = Peer::of(here, there).unwrap();
            assert_eq!(peer.pid, getpid());
            assert!(peer.is_connected_to(here.port()));
            assert!(!peer.is_connected_to(other_port));
            assert!(listens(getpid(), here.port()));
            assert!(!listens(getpid(), there.port()));
            assert_eq!(Peer::of(here, SocketAddr::new(there.ip(), 1)), None);
        }
    }

    #[test]
    fn rows_of_the_kernel_are_read_as_it_writes_them() {
        let line = "   0: 0100007F:1F90 00000000:0000 0A 00000000:00000000 00:00000000 00000000  \
                    1000        0 4711 1 0000000000000000 100 0 0 10 0";
        let found = row(line).unwrap();
        assert_eq!((found.uid, found.inode, found.state.as_str()), (1000, 4711, LISTEN));
        assert_eq!(found.local, "127.0.0.1:8080".parse().unwrap());
        assert_eq!(row("  sl  local_address rem_address"), None);
    }
}
