//! A site with world services of toys.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use bus::{Announcement, Bus, BusAddress, BusConfig, Incoming, Serving};
use schemas::{
    ActorId, Alive, EncodedFrame, Error, ErrorCode, MapRef, Reply, Request, ServiceId, ServiceKind,
    TickItem, TickOutcome, TickResult, WorldId, WorldInfo, keys,
};
use tokio::sync::watch;
use worlds::{Hosts, Patience, Worlds};

pub(crate) const PATIENCE: Patience = Patience {
    ask: Duration::from_secs(10),
    ticks: Duration::from_secs(10),
    per_tick: Duration::ZERO,
    ticks_max: Duration::from_secs(10),
};

pub(crate) fn id(name: &str) -> ServiceId {
    name.parse().unwrap()
}

/// The number of a host in its worlds' ids.
pub(crate) fn number(name: &str) -> u32 {
    u32::from(*name.as_bytes().last().unwrap())
}

pub(crate) fn world(name: &str) -> WorldId {
    WorldId::of_host(number(name), 1)
}

/// Waits for a condition, with a deadline.
pub(crate) async fn until(what: &str, condition: impl AsyncFn() -> bool) {
    let begun = Instant::now();
    while !condition().await {
        assert!(begun.elapsed() < Duration::from_secs(30), "never: {what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// A service that listens and a client that is connected to it.
pub(crate) struct Site {
    pub(crate) service: Bus,
    pub(crate) client: Bus,
}

impl Site {
    pub(crate) async fn open() -> Self {
        let service = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
        let address = service.listening()[0].clone();
        let client = Bus::open(BusConfig::connecting(address)).await.unwrap();
        Self { service, client }
    }

    pub(crate) fn worlds(&self) -> Worlds {
        let bus = watch::Sender::new(Some(self.client.clone())).subscribe();
        Worlds::follow(bus, "local".parse().unwrap(), id("face"), PATIENCE)
    }
}

/// A world service of toys.
pub(crate) struct Toy {
    /// How often it was asked for a new world.
    pub(crate) asked: Arc<AtomicUsize>,
    pub(crate) made: Arc<AtomicUsize>,
    pub(crate) is_full: watch::Sender<bool>,
    pub(crate) ticks: Option<[Serving; 2]>,
    pub(crate) _worlds: Serving,
    pub(crate) announcement: Option<Announcement>,
}

impl Toy {
    pub(crate) async fn start(bus: &Bus, name: &str) -> Self {
        let (asked, made) = (Arc::<AtomicUsize>::default(), Arc::<AtomicUsize>::default());
        let is_full = watch::Sender::new(false);
        let key = keys::batch_tick(&id(name));
        let ticks = [
            bus.serve(&key, answer_ticks).await.unwrap(),
            bus.serve_shortcut(&key, answer_ticks).await.unwrap(),
        ];
        let host = name.to_owned();
        let (asks, makes, full) = (Arc::clone(&asked), Arc::clone(&made), is_full.subscribe());
        let answer = move |incoming: Incoming| match incoming.request() {
            Ok(Request::CreateWorld { .. }) => {
                asks.fetch_add(1, Ordering::Relaxed);
                if *full.borrow() {
                    return incoming.refuse(Error::new(ErrorCode::Capacity, "no room"));
                }
                let count = makes.fetch_add(1, Ordering::Relaxed) as u64 + 1;
                let world = WorldId::of_host(number(&host), count);
                let frame = EncodedFrame::default();
                incoming.reply(&Reply::WorldCreated { world, frame, replies: Vec::new() });
            }
            Ok(Request::ListWorlds) => incoming.reply(&Reply::Worlds(vec![WorldInfo {
                world: world(&host),
                map: "Town".to_owned(),
                tick: schemas::Tick(0),
                actor_count: 0,
                owner: Some(id("face")),
                quarantined: None,
                stands_for: None,
            }])),
            Ok(Request::ListMaps) => {
                let digest = host.repeat(64 / host.len());
                let map = |name: &str| MapRef { name: name.to_owned(), digest: digest.clone() };
                incoming.reply(&Reply::Maps(vec![map("Town"), map(&host)]));
            }
            _ => incoming.refuse(Error::new(ErrorCode::Unsupported, "a toy")),
        };
        let worlds = bus.serve(&keys::any_worlds_of(&id(name)), answer).await.unwrap();
        let announcement = Some(announce(bus, name, number(name)).await);
        let ticks = Some(ticks);
        Self { asked, made, is_full, ticks, _worlds: worlds, announcement }
    }

    pub(crate) fn made(&self) -> usize {
        self.made.load(Ordering::Relaxed)
    }

    pub(crate) fn asked(&self) -> usize {
        self.asked.load(Ordering::Relaxed)
    }
}

pub(crate) fn answer_ticks(incoming: Incoming) {
    let Ok(Request::TickWorlds(items)) = incoming.request() else { panic!("ticks") };
    let outcome = |world: WorldId| TickOutcome::new(EncodedFrame(vec![world.host() as u8]));
    let result =
        |item: TickItem| TickResult { world: item.world, outcome: Ok(outcome(item.world)) };
    incoming.reply(&Reply::Ticked(items.into_iter().map(result).collect()));
}

pub(crate) async fn announce(bus: &Bus, name: &str, number: u32) -> Announcement {
    let alive = Alive {
        kind: ServiceKind::World,
        id: id(name),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
        number,
    };
    bus.announce(alive).await.unwrap()
}

/// Has a service drain while the sender says so.
pub(crate) fn drain(bus: &Bus, name: &str) -> watch::Sender<bool> {
    let told = watch::Sender::new(false);
    let (bus, service, drain) = (bus.clone(), (ServiceKind::World, id(name)), told.subscribe());
    tokio::spawn(async move { bus.tell_draining(service, drain, |is_on| *is_on).await });
    told
}

pub(crate) fn follow_open(hosts: &Hosts) -> watch::Receiver<Option<bool>> {
    let (told, is_open) = watch::channel(None);
    let hosts = hosts.clone();
    let tell = move |is_open| _ = told.send_replace(Some(is_open));
    tokio::spawn(async move { hosts.tell_open(tell).await });
    is_open
}

pub(crate) fn create() -> Request {
    Request::CreateWorld {
        map: "Town".to_owned(),
        seed: 1,
        dt_secs: 0.05,
        commands: Vec::new(),
        lease: None,
        traffic: false,
        first_actor: ActorId::FIRST,
    }
}

pub(crate) async fn ticks(worlds: &Worlds, world: WorldId) -> bool {
    worlds.tick(vec![TickItem::new(world, 1)]).await.is_ok()
}

pub(crate) async fn until_up(worlds: &Worlds, names: &[&str]) {
    let is_up = |name: &&str| {
        worlds.hosts().of_world(world(name)).is_some_and(|host| host.channel.is_some())
    };
    until("channels to all hosts", async || names.iter().all(is_up)).await;
}
