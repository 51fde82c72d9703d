//! Two places on one private bus.
use std::time::{Duration, Instant};

use bus::{Bus, BusConfig};
use schemas::{Tenant, keys};

/// A service that listens and a client that is connected to it.
pub(crate) struct Site {
    pub(crate) service: Bus,
    pub(crate) client: Bus,
}

impl Site {
    pub(crate) async fn open() -> Self {
        let service = Bus::open(BusConfig::listening(bus::Endpoint::loopback(0))).await.unwrap();
        let client =
            Bus::open(BusConfig::connecting(service.listening()[0].clone())).await.unwrap();
        Self { service, client }
    }

    pub(crate) fn worlds(&self) -> String {
        keys::worlds(&tenant())
    }
}

pub(crate) fn tenant() -> Tenant {
    "local".parse().unwrap()
}

/// Long enough for a busy machine.
pub(crate) fn deadline() -> Duration {
    Duration::from_secs(10)
}

/// Waits for a condition, with a deadline.
pub(crate) async fn until<F: Future<Output = bool>>(what: &str, condition: impl Fn() -> F) {
    let begun = Instant::now();
    while !condition().await {
        assert!(begun.elapsed() < deadline(), "never: {what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
