//! A look at a site's bus, as one of its clients.

use std::time::Duration;

use bus::{Bus, BusAddress, BusConfig, Presence};
use schemas::{Error, Reply, Request, ServiceId, ServiceKind, Tenant, WorldId, WorldInfo, keys};
use tokio::runtime::Runtime;

use crate::{SOON, eventually};

/// Answer time of a request.
const DEADLINE: Duration = Duration::from_secs(30);

/// A client of the bus, of the tenant that the scenario service uses.
pub struct Probe {
    bus: Bus,
    tenant: Tenant,
    runtime: Runtime,
}

impl Probe {
    /// Connects.
    pub fn open(address: BusAddress) -> Self {
        let runtime = Runtime::new().unwrap();
        let config = BusConfig { connect_deadline: Some(SOON), ..BusConfig::connecting(address) };
        let bus = runtime.block_on(Bus::open(config)).unwrap();
        Self { bus, tenant: "local".parse().unwrap(), runtime }
    }

    /// The answer to a request about worlds.
    ///
    /// # Errors
    /// The service's refusal.
    pub fn ask(&self, request: &Request) -> Result<Reply, Error> {
        let key = keys::worlds(&self.tenant);
        self.runtime.block_on(self.bus.request(&key, request, DEADLINE))
    }

    /// The answer of one world service to a request about worlds.
    ///
    /// # Errors
    /// The service's refusal.
    pub fn ask_host(&self, host: &ServiceId, request: &Request) -> Result<Reply, Error> {
        let key = keys::worlds_of(&self.tenant, host);
        self.runtime.block_on(self.bus.request(&key, request, DEADLINE))
    }

    /// The answer to a request to one world.
    ///
    /// # Errors
    /// The service's refusal.
    pub fn ask_world(&self, world: WorldId, request: &Request) -> Result<Reply, Error> {
        let key = keys::world(&self.tenant, world);
        self.runtime.block_on(self.bus.request(&key, request, DEADLINE))
    }

    /// The OpenDRIVE text of a map.
    ///
    /// # Errors
    /// The refusal of a service when none has it.
    pub fn asset(&self, digest: &str) -> Result<Vec<u8>, Error> {
        self.runtime.block_on(self.bus.asset(digest, DEADLINE))
    }

    /// The answer to bytes that may be no request at all.
    ///
    /// # Errors
    /// The service's refusal.
    pub fn send_bytes(&self, key: &str, bytes: Vec<u8>) -> Result<Reply, Error> {
        self.runtime.block_on(self.bus.request_bytes(key, bytes, DEADLINE))
    }

    /// Every key on which the world service answers requests.
    pub fn keys(&self, world: WorldId) -> Vec<String> {
        let host = self.runtime.block_on(self.host());
        let tenant = &self.tenant;
        vec![keys::worlds(tenant), keys::world(tenant, world), keys::batch_tick(&host)]
    }

    /// The world service of the site.
    async fn host(&self) -> ServiceId {
        let mut watch = self.bus.watch(Some(ServiceKind::World)).await.unwrap();
        loop {
            if let Presence::Up(alive) = watch.next().await {
                return alive.id;
            }
        }
    }

    /// The worlds that exist.
    pub fn worlds(&self) -> Vec<WorldInfo> {
        match self.ask(&Request::ListWorlds) {
            Ok(Reply::Worlds(worlds)) => worlds,
            other => panic!("no list of worlds: {other:?}"),
        }
    }

    /// Returns when exactly this many worlds exist.
    pub fn wait_for_worlds(&self, count: usize) {
        eventually(&format!("site with {count} worlds"), SOON, || {
            let worlds = self.worlds();
            if worlds.len() == count { Ok(()) } else { Err(worlds) }
        });
    }

    /// Returns when a service of this kind is up.
    pub fn wait_for(&self, kind: ServiceKind) {
        let up = async {
            let mut watch = self.bus.watch(Some(kind)).await.unwrap();
            while !matches!(watch.next().await, Presence::Up(_)) {}
        };
        let waited = self.runtime.block_on(async { tokio::time::timeout(SOON, up).await });
        waited.unwrap_or_else(|_| panic!("no {kind:?} came up within {SOON:?}"));
    }
}
