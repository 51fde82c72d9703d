//! A running world service and a client of it.
use std::time::{Duration, Instant};

use bus::{Bus, BusAddress, BusConfig};
use monitoring::Monitor;
use schemas::{Command, EncodedFrame, Error, Frame, Lease, Reply, Request, Tenant, TickItem};
use schemas::{TickOutcome, Vec3, WorldId, WorldInfo, keys, level_pose, wire};
use world_service::{Config, WorldService};

/// The map of all tests.
pub(crate) const MAP: &str = "Town10HD_Opt";

/// A world service on a private bus, and a client connected to it.
pub(crate) struct Site {
    pub(crate) service: WorldService,
    pub(crate) client: Bus,
}

pub(crate) fn config() -> Config {
    Config {
        listen: vec![BusAddress::loopback(0)],
        connect: Vec::new(),
        identity: None,
        id: "world".parse().unwrap(),
        shard_count: 2.try_into().unwrap(),
        maps: None,
        journals: None,
        worlds_max: 64,
    }
}

/// Long enough for a busy machine.
pub(crate) fn deadline() -> Duration {
    Duration::from_secs(60)
}

pub(crate) fn tenant() -> Tenant {
    "local".parse().unwrap()
}

impl Site {
    pub(crate) async fn open(config: Config) -> Self {
        let service = world_service::start(config, &Monitor::default()).await.unwrap();
        let client = connect(&service).await;
        Self { service, client }
    }

    /// Asks about worlds in general.
    pub(crate) async fn ask(&self, request: &Request) -> Result<Reply, Error> {
        self.client.request(&keys::worlds(&tenant()), request, deadline()).await
    }

    pub(crate) async fn create(&self, seed: u64, lease: Option<Lease>) -> Result<WorldId, Error> {
        match self.ask(&create(seed, lease)).await? {
            Reply::WorldCreated { world, .. } => Ok(world),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) async fn tick(&self, item: TickItem) -> Result<TickOutcome, Error> {
        let key = keys::world(&tenant(), item.world);
        let world = item.world;
        match self.client.request(&key, &Request::TickWorlds(vec![item]), deadline()).await? {
            Reply::Ticked(results) => {
                let [result] = <[_; 1]>::try_from(results).unwrap();
                assert_eq!(result.world, world);
                result.outcome
            }
            other => panic!("{other:?}"),
        }
    }

    pub(crate) async fn list(&self) -> Vec<WorldInfo> {
        match self.ask(&Request::ListWorlds).await {
            Ok(Reply::Worlds(worlds)) => worlds,
            other => panic!("{other:?}"),
        }
    }

    pub(crate) async fn snapshot(&self, world: WorldId) -> Vec<u8> {
        match self.ask(&Request::SnapshotWorld { world }).await {
            Ok(Reply::Snapshot(snapshot)) => snapshot,
            other => panic!("{other:?}"),
        }
    }
}

pub(crate) async fn connect(service: &WorldService) -> Bus {
    Bus::open(BusConfig::connecting(service.listening()[0].clone())).await.unwrap()
}

/// A world with a car that already drives.
pub(crate) fn create(seed: u64, lease: Option<Lease>) -> Request {
    Request::CreateWorld {
        map: MAP.to_owned(),
        seed,
        dt_secs: 0.05,
        commands: vec![car()],
        lease,
        traffic: false,
        first_actor: schemas::ActorId::FIRST,
    }
}

pub(crate) fn car() -> Command {
    let text = roads::town::build(MAP).unwrap();
    let map = roads::Map::parse(MAP, &text).unwrap();
    let spawn = map.spawn_points()[0].cast::<f32>();
    let yaw_rad = schemas::yaw_rad(&spawn);
    let velocity_mps = Vec3::new(yaw_rad.cos(), yaw_rad.sin(), 0.0) * 10.0;
    let start = level_pose(spawn.translation.vector, yaw_rad);
    Command::spawn("vehicle.lincoln.mkz", start, velocity_mps)
}

pub(crate) fn ticks(world: WorldId, tick_count: u32) -> TickItem {
    TickItem::new(world, tick_count)
}

pub(crate) fn decoded(frame: &EncodedFrame) -> Frame {
    wire::decode_frame(&frame.0).unwrap()
}

/// Waits for a condition, with a deadline.
pub(crate) async fn until<F: Future<Output = bool>>(what: &str, condition: impl Fn() -> F) {
    let begun = Instant::now();
    while !condition().await {
        assert!(begun.elapsed() < deadline(), "never: {what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
