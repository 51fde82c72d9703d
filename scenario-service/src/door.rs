//! The face's door: it steps aside while a Traffic Manager on this machine wants the same port.
//!
//! The OpenEnv protocol and the Traffic Manager of CARLA's client both have port 8000 by default,
//! and the Traffic Manager takes it on all addresses, in the client's process. It tries for ten
//! seconds. Whoever is connected stays connected meanwhile.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::time::Duration;

use axum::serve::Listener;
use bus::{Bus, BusError, Presence};
use schemas::ServiceKind;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// Between two attempts to open the door again.
const RETRY_PAUSE: Duration = Duration::from_millis(250);

/// Accepts connections whenever nobody else wants the port.
pub(crate) struct Door {
    address: SocketAddr,
    listener: Option<TcpListener>,
    is_wanted: watch::Receiver<bool>,
}

impl Door {
    /// Opens it.
    ///
    /// # Errors
    /// The system's, when the address cannot be used.
    pub(crate) async fn open(
        address: SocketAddr,
        is_wanted: watch::Receiver<bool>,
    ) -> std::io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        Ok(Self { address: listener.local_addr()?, listener: Some(listener), is_wanted })
    }

    async fn reopen(&mut self) {
        match TcpListener::bind(self.address).await {
            Ok(listener) => {
                tracing::info!(address = %self.address, "OpenEnv face listens again");
                self.listener = Some(listener);
            }
            Err(_) => tokio::time::sleep(RETRY_PAUSE).await,
        }
    }
}

impl Listener for Door {
    type Io = TcpStream;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (TcpStream, SocketAddr) {
        loop {
            let is_wanted = *self.is_wanted.borrow_and_update();
            match &mut self.listener {
                Some(_) if is_wanted => {
                    tracing::warn!(address = %self.address, "a Traffic Manager takes the port; \
                        new OpenEnv clients have to wait for its end, or choose another --http");
                    self.listener = None;
                }
                Some(listener) => tokio::select! {
                    accepted = Listener::accept(listener) => return accepted,
                    Ok(()) = self.is_wanted.changed() => {}
                },
                None if is_wanted => {
                    if self.is_wanted.changed().await.is_err() {
                        std::future::pending::<()>().await;
                    }
                }
                None => self.reopen().await,
            }
        }
    }

    fn local_addr(&self) -> std::io::Result<SocketAddr> {
        Ok(self.address)
    }
}

/// Tells whether a Traffic Manager that starts wants a port.
///
/// # Errors
/// The bus's, when it does not tell who is up.
pub(crate) async fn follow_wishes(
    bus: &Bus,
    port: u16,
    is_wanted: watch::Sender<bool>,
) -> Result<std::convert::Infallible, BusError> {
    let mut watch = bus.watch(Some(ServiceKind::TrafficManager)).await?;
    let mut starting = BTreeSet::new();
    loop {
        match watch.next().await {
            Presence::Up(manager) if manager.detail == port.to_string() => {
                starting.insert(manager.id);
            }
            Presence::Up(_) => {}
            Presence::Down(_, id) => {
                starting.remove(&id);
            }
        }
        is_wanted.send_replace(!starting.is_empty());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn who_wants_the_port_gets_it_and_the_door_opens_again() {
        let (wishes, is_wanted) = watch::channel(false);
        let mut door = Door::open("127.0.0.1:0".parse().unwrap(), is_wanted).await.unwrap();
        let address = door.local_addr().unwrap();
        tokio::spawn(async move {
            let mut kept = Vec::new();
            loop {
                kept.push(door.accept().await);
            }
        });
        TcpStream::connect(address).await.unwrap();
        let everywhere = SocketAddr::new([0, 0, 0, 0].into(), address.port());
        assert!(TcpListener::bind(everywhere).await.is_err());
        wishes.send_replace(true);
        let taken = loop {
            match TcpListener::bind(everywhere).await {
                Ok(listener) => break listener,
                Err(_) => tokio::time::sleep(Duration::from_millis(5)).await,
            }
        };
        wishes.send_replace(false);
        tokio::time::sleep(RETRY_PAUSE * 2).await;
        drop(taken);
        while TcpStream::connect(address).await.is_err() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
}
