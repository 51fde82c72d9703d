//! The conversation between who holds a port and who knows of a process that wants it.
//!
//! A connection carries four bytes, the number of the process, and one byte back: that the port was
//! let go, or that it was not.

use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener as StdListener, UnixStream as StdStream};
use std::time::Duration;

use rustix::process::{Pid, geteuid};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{UnixListener, UnixStream};

/// How long either side may take for its words.
const WORDS_DEADLINE: Duration = Duration::from_secs(1);

/// Whoever listens on a port offers to lend it.
#[derive(Debug)]
pub struct Offer {
    listener: UnixListener,
}

/// A process that wants the port, and who waits to hear whether it may have it.
#[derive(Debug)]
pub struct Wish {
    /// Who wants it.
    pub process: Pid,
    asker: UnixStream,
}

impl Offer {
    /// Begins to listen for wishes.
    ///
    /// # Errors
    /// The system's, when another process offers the same port.
    pub fn new(port: u16) -> io::Result<Self> {
        let listener = StdListener::bind_addr(&name_of(port)?)?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener: UnixListener::from_std(listener)? })
    }

    /// The next wish of a process of our own user. May be dropped and called again; a wish that was
    /// being read is refused then.
    pub async fn wish(&self) -> Wish {
        loop {
            let heard = match self.listener.accept().await {
                Ok((asker, _)) => hear(asker).await,
                Err(cause) => Err(cause),
            };
            match heard {
                Ok(wish) => return wish,
                Err(cause) => {
                    tracing::warn!(%cause, "a wish for the port is refused");
                    // The system may have no room for a connection; it is not asked in a hurry.
                    tokio::time::sleep(Duration::from_millis(10)).await;
                }
            }
        }
    }
}

impl Wish {
    /// Tells the asker that nobody listens on the port now.
    pub async fn grant(mut self) {
        if let Err(cause) = self.asker.write_all(&[1]).await {
            tracing::debug!(%cause, "who asked for the port is gone");
        }
    }
}

async fn hear(mut asker: UnixStream) -> io::Result<Wish> {
    if asker.peer_cred()?.uid() != geteuid().as_raw() {
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, "it is another user's"));
    }
    let process = tokio::time::timeout(WORDS_DEADLINE, asker.read_i32_le()).await??;
    let process = Pid::from_raw(process).filter(|pid| pid.as_raw_nonzero().get() > 0);
    let process = process.ok_or_else(|| io::Error::other("it names no process"))?;
    Ok(Wish { process, asker })
}

/// Asks whoever offers a port to let a process have it; on return it may be free.
///
/// # Errors
/// The system's, when nobody of our user offers it or the holder keeps it.
pub async fn ask_for(port: u16, process: Pid) -> io::Result<()> {
    let stream = StdStream::connect_addr(&name_of(port)?)?;
    stream.set_nonblocking(true)?;
    let mut holder = UnixStream::from_std(stream)?;
    if holder.peer_cred()?.uid() != geteuid().as_raw() {
        return Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            "its holder is another user's",
        ));
    }
    let conversation = async {
        holder.write_i32_le(process.as_raw_nonzero().get()).await?;
        holder.read_u8().await.map(drop)
    };
    tokio::time::timeout(WORDS_DEADLINE, conversation).await?
}

/// Abstract: no file is left behind, and it ends with its process.
fn name_of(port: u16) -> io::Result<SocketAddr> {
    SocketAddr::from_abstract_name(format!("causeway-port-{port}"))
}

#[cfg(test)]
mod tests {
    use rustix::process::getpid;

    use super::*;

    /// Ports below 1024 are nobody's in tests: other tests take the ones above.
    #[tokio::test]
    async fn a_wish_is_heard_and_granted() {
        let offer = Offer::new(901).unwrap();
        assert!(Offer::new(901).is_err(), "one holder at a time");
        let asking = tokio::spawn(ask_for(901, getpid()));
        let wish = offer.wish().await;
        assert_eq!(wish.process, getpid());
        wish.grant().await;
        asking.await.unwrap().unwrap();
    }

    #[tokio::test]
    async fn who_does_not_say_what_it_wants_or_finds_no_offer_gets_nothing() {
        assert!(ask_for(902, getpid()).await.is_err());
        let offer = Offer::new(903).unwrap();
        drop(StdStream::connect_addr(&name_of(903).unwrap()).unwrap());
        let asking = tokio::spawn(ask_for(903, getpid()));
        drop(offer.wish().await);
        assert!(asking.await.unwrap().is_err(), "a wish that is dropped is not granted");
    }
}
