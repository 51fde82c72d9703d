//! Two places on one private bus.
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Announcement, Bus, BusConfig, Renderers};
use schemas::{Alive, Frame, MapRef, RenderJob, ServiceId, ServiceKind, Tenant, WorldId, keys};
use tokio::sync::watch;

/// A service that listens and a client that is connected to it.
pub(crate) struct Site {
    pub(crate) service: Bus,
    pub(crate) client: Bus,
}

impl Site {
    pub(crate) async fn open() -> Self {
        let service = Bus::open(BusConfig::listening(bus::BusAddress::loopback(0))).await.unwrap();
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

pub(crate) fn renderer() -> ServiceId {
    "render-0".parse().unwrap()
}

/// Says that [`renderer`] is up.
pub(crate) async fn announce_renderer(bus: &Bus) -> Announcement {
    let alive = Alive {
        kind: ServiceKind::Render,
        id: renderer(),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
        number: 0,
    };
    bus.announce(alive).await.unwrap()
}

/// Who can draw, as seen from here.
pub(crate) fn renderers(bus: &Bus) -> Arc<Renderers> {
    Renderers::follow(watch::Sender::new(Some(bus.clone())).subscribe())
}

/// A job without cameras, of a world with this seed.
pub(crate) fn job(seed: u64) -> RenderJob {
    let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
    let frame = Frame { seed, ..Frame::empty(WorldId::new(1).unwrap(), map) };
    RenderJob { tenant: tenant(), frame, cameras: Vec::new(), staging: schemas::Staging::default() }
}

/// Long enough for a busy machine.
pub(crate) fn deadline() -> Duration {
    Duration::from_secs(30)
}

/// Waits for a condition, with a deadline.
pub(crate) async fn until<F: Future<Output = bool>>(what: &str, condition: impl Fn() -> F) {
    let begun = Instant::now();
    while !condition().await {
        assert!(begun.elapsed() < deadline(), "never: {what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
