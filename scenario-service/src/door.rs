//! The face's door: it steps aside while a Traffic Manager on this machine wants the same port.
//!
//! The OpenEnv protocol and the Traffic Manager of CARLA's client both have port 8000 by default,
//! and the Traffic Manager takes it on all addresses, in the client's process. It tries for ten
//! seconds. Whoever is connected stays connected meanwhile, and a door at `[::1]` stays open, which
//! is what "localhost" means first where there is IPv6.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
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
    /// At `[::1]`, for a face at 127.0.0.1.
    beside: Option<TcpListener>,
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
        let address = listener.local_addr()?;
        let beside = match address.ip() == Ipv4Addr::LOCALHOST {
            true => TcpListener::bind((Ipv6Addr::LOCALHOST, address.port())).await.ok(),
            false => None,
        };
        Ok(Self { address, listener: Some(listener), beside, is_wanted })
    }

    /// Closes or opens the door, as others want the port or not.
    async fn follow(&mut self, is_wanted: bool) {
        if is_wanted && self.listener.take().is_some() {
            tracing::warn!(address = %self.address, "a Traffic Manager takes the port: new OpenEnv \
                clients come in at [::1], or wait for its end; --http chooses another port");
        }
        if !is_wanted && self.listener.is_none() {
            self.listener = TcpListener::bind(self.address).await.ok();
            if self.listener.is_some() {
                tracing::info!(address = %self.address, "OpenEnv face listens again");
            }
        }
    }
}

async fn accept(door: &mut Option<TcpListener>) -> (TcpStream, SocketAddr) {
    match door {
        Some(listener) => Listener::accept(listener).await,
        None => std::future::pending().await,
    }
}

impl Listener for Door {
    type Io = TcpStream;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (TcpStream, SocketAddr) {
        loop {
            let is_wanted = *self.is_wanted.borrow_and_update();
            self.follow(is_wanted).await;
            let is_shut_out = self.listener.is_none() && !is_wanted;
            tokio::select! {
                accepted = accept(&mut self.listener) => return accepted,
                accepted = accept(&mut self.beside) => return accepted,
                Ok(()) = self.is_wanted.changed() => {}
                () = tokio::time::sleep(RETRY_PAUSE), if is_shut_out => {}
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
        if TcpListener::bind((Ipv6Addr::LOCALHOST, 0)).await.is_ok() {
            TcpStream::connect((Ipv6Addr::LOCALHOST, address.port())).await.unwrap();
        }
        wishes.send_replace(false);
        tokio::time::sleep(RETRY_PAUSE * 2).await;
        drop(taken);
        while TcpStream::connect(address).await.is_err() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
}
