//! The listener of the OpenEnv face: it steps aside while a Traffic Manager on this machine has the
//! same port.
//!
//! The OpenEnv protocol and the Traffic Manager of CARLA's client both have port 8000 by default,
//! and the Traffic Manager takes it on all addresses, in the client's process. It tries for ten
//! seconds. Whoever is connected stays connected meanwhile, and a listener at `[::1]` stays open,
//! which is what "localhost" means first where there is IPv6.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::Duration;

use port_lending::{Offer, Wish, listens};
use rustix::process::Pid;
use seats::Seats;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;

/// Between two attempts to listen again.
const RETRY_PAUSE: Duration = Duration::from_millis(250);
/// How long a Traffic Manager may take to listen on a port that it was lent.
const LENT_FOR: Duration = Duration::from_secs(12);

/// Accepts connections whenever nobody else has the port.
pub(crate) struct FaceListener {
    address: SocketAddr,
    listener: Option<TcpListener>,
    /// At `[::1]`, for a face at 127.0.0.1.
    beside: Option<TcpListener>,
    wishes: mpsc::Receiver<Wish>,
    /// Whether this face offers the port, and no other one of this machine.
    offers: watch::Receiver<bool>,
    lent: Option<Loan>,
}

/// A process that has been given the port and does not listen on it yet.
struct Loan {
    process: Pid,
    until: Instant,
}

impl FaceListener {
    /// Begins to listen; on a port that another program has, as soon as it is free.
    ///
    /// # Errors
    /// The system's, when the address cannot be used at all.
    pub(crate) async fn open(address: SocketAddr) -> io::Result<Self> {
        let listener = match TcpListener::bind(address).await {
            Ok(listener) => Some(listener),
            Err(taken) if taken.kind() == io::ErrorKind::AddrInUse => {
                tracing::warn!(%address, "another program has the port: OpenEnv clients wait until \
                    it is free; --http chooses another port");
                None
            }
            Err(cause) => return Err(cause),
        };
        let address = match &listener {
            Some(listener) => listener.local_addr()?,
            None => address,
        };
        let (wishes, offers) = follow_wishes(address.port());
        let mut face = Self { address, listener, beside: None, wishes, offers, lent: None };
        face.listen_beside().await;
        if face.listener.is_some() {
            tracing::info!(%address, "OpenEnv face listens");
        }
        Ok(face)
    }

    /// Where it listens, or will.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next connection, for which there may be no seat yet.
    pub(crate) async fn accept(&mut self, seats: &Seats) -> (TcpStream, SocketAddr) {
        loop {
            let is_shut_out = self.listener.is_none();
            tokio::select! {
                accepted = accept(self.listener.as_ref(), seats) => return accepted,
                accepted = accept(self.beside.as_ref(), seats) => return accepted,
                Some(wish) = self.wishes.recv() => self.lend(wish).await,
                () = tokio::time::sleep(RETRY_PAUSE), if is_shut_out => self.try_again().await,
            }
        }
    }

    /// Lets go of the port, so that another process can listen there.
    async fn lend(&mut self, wish: Wish) {
        if self.listener.take().is_some() {
            tracing::warn!(address = %self.address, "a Traffic Manager takes the port: new OpenEnv \
                clients come in at [::1], or where there is no IPv6 wait for its end; --http \
                chooses another port");
        }
        self.lent = Some(Loan { process: wish.process, until: Instant::now() + LENT_FOR });
        wish.grant().await;
    }

    /// Listens again as soon as nobody has the port or is to have it.
    async fn try_again(&mut self) {
        // What another face offers may be free only because it is being lent.
        if !*self.offers.borrow() {
            return;
        }
        if let Some(loan) = &self.lent {
            if listens(loan.process, self.address.port()) {
                self.lent = None;
            } else if Instant::now() < loan.until && is_alive(loan.process) {
                return;
            }
        }
        self.listener = TcpListener::bind(self.address).await.ok();
        if self.listener.is_some() {
            self.lent = None;
            tracing::info!(address = %self.address, "OpenEnv face listens");
        }
        if self.beside.is_none() {
            self.listen_beside().await;
        }
    }

    /// Also takes the port at `[::1]`, where there is IPv6 and nobody else has it.
    async fn listen_beside(&mut self) {
        if self.address.ip() == Ipv4Addr::LOCALHOST {
            self.beside = TcpListener::bind((Ipv6Addr::LOCALHOST, self.address.port())).await.ok();
        }
    }
}

/// Wishes of those who ask for the port, as long as they are received, and whether they come here:
/// one face of a machine offers a port, and when it is gone another one does.
fn follow_wishes(port: u16) -> (mpsc::Receiver<Wish>, watch::Receiver<bool>) {
    let (sender, wishes) = mpsc::channel(1);
    let mut offer = Offer::new(port);
    let (is_ours, offers) = watch::channel(offer.is_ok());
    tokio::spawn(async move {
        let offer = loop {
            match offer {
                Ok(offer) => break offer,
                Err(cause) => tracing::trace!(port, %cause, "another face offers the port"),
            }
            tokio::select! {
                () = tokio::time::sleep(RETRY_PAUSE) => offer = Offer::new(port),
                () = sender.closed() => return,
            }
        };
        is_ours.send_replace(true);
        loop {
            tokio::select! {
                wish = offer.wish() => if sender.send(wish).await.is_err() { return },
                () = sender.closed() => return,
            }
        }
    });
    (wishes, offers)
}

fn is_alive(process: Pid) -> bool {
    rustix::process::test_kill_process(process).is_ok()
}

async fn accept(listener: Option<&TcpListener>, seats: &Seats) -> (TcpStream, SocketAddr) {
    match listener {
        Some(listener) => seats.accept(listener).await,
        None => std::future::pending().await,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Accepts and keeps what comes, for ever.
    fn keep_accepting(mut face: FaceListener) {
        tokio::spawn(async move {
            let (seats, mut kept) = (Seats::new(1), Vec::new());
            loop {
                kept.push(face.accept(&seats).await);
            }
        });
    }

    async fn until_it_listens(address: SocketAddr) {
        while TcpStream::connect(address).await.is_err() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    #[tokio::test]
    async fn a_process_that_is_lent_the_port_gets_it_and_the_face_listens_again_after_it() {
        let face = FaceListener::open("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = face.address();
        keep_accepting(face);
        TcpStream::connect(address).await.unwrap();
        let everywhere = SocketAddr::new([0, 0, 0, 0].into(), address.port());
        assert!(TcpListener::bind(everywhere).await.is_err());
        port_lending::ask_for(address.port(), rustix::process::getpid()).await.unwrap();
        let taken = TcpListener::bind(everywhere).await.unwrap();
        if TcpListener::bind((Ipv6Addr::LOCALHOST, 0)).await.is_ok() {
            TcpStream::connect((Ipv6Addr::LOCALHOST, address.port())).await.unwrap();
        }
        tokio::time::sleep(RETRY_PAUSE * 2).await;
        drop(taken);
        until_it_listens(address).await;
    }

    #[tokio::test]
    async fn a_process_that_ends_without_listening_gives_the_port_back() {
        // Before the listener, which it would hold for the moment that it takes to begin.
        let mut asker = std::process::Command::new("sleep").arg("600").spawn().unwrap();
        let face = FaceListener::open("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = face.address();
        keep_accepting(face);
        let pid = Pid::from_raw(asker.id() as i32).unwrap();
        port_lending::ask_for(address.port(), pid).await.unwrap();
        assert!(TcpStream::connect(address).await.is_err());
        asker.kill().unwrap();
        asker.wait().unwrap();
        tokio::time::timeout(LENT_FOR / 2, until_it_listens(address)).await.unwrap();
    }

    #[tokio::test]
    async fn a_port_that_another_program_has_is_taken_as_soon_as_it_is_free() {
        let other = TcpListener::bind("0.0.0.0:0").await.unwrap();
        let address = SocketAddr::new([127, 0, 0, 1].into(), other.local_addr().unwrap().port());
        let face = FaceListener::open(address).await.unwrap();
        assert_eq!(face.address(), address);
        keep_accepting(face);
        drop(other);
        until_it_listens(address).await;
    }

    #[tokio::test]
    async fn a_face_that_takes_the_port_after_another_one_lends_it_too() {
        let first = FaceListener::open("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = first.address;
        keep_accepting(FaceListener::open(address).await.unwrap());
        tokio::time::sleep(RETRY_PAUSE * 2).await;
        drop(first);
        until_it_listens(address).await;
        port_lending::ask_for(address.port(), rustix::process::getpid()).await.unwrap();
        TcpListener::bind((Ipv4Addr::UNSPECIFIED, address.port())).await.unwrap();
    }

    #[tokio::test]
    async fn a_port_that_one_face_lends_is_not_taken_by_another_one() {
        // Before the listener, which it would hold for the moment that it takes to begin.
        let mut borrower = std::process::Command::new("sleep").arg("600").spawn().unwrap();
        let first = FaceListener::open("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = first.address;
        keep_accepting(first);
        keep_accepting(FaceListener::open(address).await.unwrap());
        let pid = Pid::from_raw(borrower.id() as i32).unwrap();
        port_lending::ask_for(address.port(), pid).await.unwrap();
        tokio::time::sleep(RETRY_PAUSE * 3).await;
        assert!(TcpStream::connect(address).await.is_err(), "it is the borrower's");
        borrower.kill().unwrap();
        borrower.wait().unwrap();
        until_it_listens(address).await;
    }
}
