//! World services as faces follow them, on a real bus.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use bus::{Announcement, Bus, BusAddress, BusConfig, Incoming, Serving};
use schemas::{
    ActorId, Alive, EncodedFrame, Error, ErrorCode, Load, MapRef, Reply, Request, ServiceId,
    ServiceKind, Tenant, TickItem, TickOutcome, TickResult, WorldId, WorldInfo, keys,
};
use tokio::sync::watch;
use worlds::{Hosts, Patience, Worlds};

const PATIENCE: Patience = Patience {
    ask: Duration::from_secs(10),
    ticks: Duration::from_secs(10),
    per_tick: Duration::ZERO,
    ticks_max: Duration::from_secs(10),
};

fn id(name: &str) -> ServiceId {
    name.parse().unwrap()
}

/// The number of a host in its worlds' ids.
fn number(name: &str) -> u32 {
    u32::from(*name.as_bytes().last().unwrap())
}

fn world(name: &str) -> WorldId {
    WorldId::of_host(number(name), 1)
}

/// Waits for a condition, with a deadline.
async fn until(what: &str, condition: impl AsyncFn() -> bool) {
    let begun = Instant::now();
    while !condition().await {
        assert!(begun.elapsed() < Duration::from_secs(30), "never: {what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// A service that listens and a client that is connected to it.
struct Site {
    service: Bus,
    client: Bus,
}

impl Site {
    async fn open() -> Self {
        let service = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
        let address = service.listening()[0].clone();
        let client = Bus::open(BusConfig::connecting(address)).await.unwrap();
        Self { service, client }
    }

    fn worlds(&self) -> Worlds {
        let bus = watch::Sender::new(Some(self.client.clone())).subscribe();
        Worlds::follow(bus, "local".parse().unwrap(), id("face"), PATIENCE)
    }
}

/// A world service of toys.
struct Toy {
    /// How often it was asked for a new world.
    asked: Arc<AtomicUsize>,
    made: Arc<AtomicUsize>,
    is_full: watch::Sender<bool>,
    ticks: Option<[Serving; 2]>,
    _worlds: Serving,
    announcement: Option<Announcement>,
}

impl Toy {
    async fn start(bus: &Bus, name: &str) -> Self {
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

    fn made(&self) -> usize {
        self.made.load(Ordering::Relaxed)
    }

    fn asked(&self) -> usize {
        self.asked.load(Ordering::Relaxed)
    }
}

fn answer_ticks(incoming: Incoming) {
    let Ok(Request::TickWorlds(items)) = incoming.request() else { panic!("ticks") };
    let outcome = |world: WorldId| TickOutcome::new(EncodedFrame(vec![world.host() as u8]));
    let result =
        |item: TickItem| TickResult { world: item.world, outcome: Ok(outcome(item.world)) };
    incoming.reply(&Reply::Ticked(items.into_iter().map(result).collect()));
}

async fn announce(bus: &Bus, name: &str, number: u32) -> Announcement {
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
fn drain(bus: &Bus, name: &str) -> watch::Sender<bool> {
    let told = watch::Sender::new(false);
    let (bus, service, drain) = (bus.clone(), (ServiceKind::World, id(name)), told.subscribe());
    tokio::spawn(async move { bus.tell_draining(service, drain, |is_on| *is_on).await });
    told
}

fn follow_open(hosts: &Hosts) -> watch::Receiver<Option<bool>> {
    let (told, is_open) = watch::channel(None);
    let hosts = hosts.clone();
    let tell = move |is_open| _ = told.send_replace(Some(is_open));
    tokio::spawn(async move { hosts.tell_open(tell).await });
    is_open
}

fn create() -> Request {
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

async fn ticks(worlds: &Worlds, world: WorldId) -> bool {
    worlds.tick(vec![TickItem::new(world, 1)]).await.is_ok()
}

async fn until_up(worlds: &Worlds, names: &[&str]) {
    let is_up = |name: &&str| {
        worlds.hosts().of_world(world(name)).is_some_and(|host| host.channel.is_some())
    };
    until("channels to all hosts", async || names.iter().all(is_up)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_host_that_is_silent_is_asked_on_and_taken_back_and_one_that_is_dead_is_forgotten() {
    let site = Site::open().await;
    let mut toy = Toy::start(&site.service, "world-a").await;
    let worlds = site.worlds();
    until_up(&worlds, &["world-a"]).await;
    let is_open = follow_open(worlds.hosts());
    let is_open = async |wanted| *is_open.borrow() == Some(wanted);
    until("an open host", async || is_open(true).await).await;

    toy.announcement = None;
    until("a silent host", async || is_open(false).await).await;
    assert!(ticks(&worlds, world("world-a")).await, "a host that lives is not asked any more");
    toy.announcement = Some(announce(&site.service, "world-a", number("world-a")).await);
    until("an open host again", async || is_open(true).await).await;
    assert!(ticks(&worlds, world("world-a")).await, "a host that came back is not asked");

    toy.announcement = None;
    until("a silent host again", async || is_open(false).await).await;
    toy.ticks = None;
    let is_dead = || worlds.hosts().of_world(world("world-a")).is_none();
    until("a dead host", async || is_dead()).await;
    assert!(!ticks(&worlds, world("world-a")).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn another_process_of_the_same_name_does_not_pass_for_the_one_before() {
    let site = Site::open().await;
    let mut toy = Toy::start(&site.service, "world-a").await;
    let worlds = site.worlds();
    until_up(&worlds, &["world-a"]).await;
    toy.announcement = None;
    toy.announcement = Some(announce(&site.service, "world-a", 3).await);
    let of_number = |number| worlds.hosts().of_world(WorldId::of_host(number, 1)).is_some();
    until("the new process", async || of_number(3)).await;
    assert!(!of_number(number("world-a")), "it has none of the worlds before");
}

#[tokio::test(flavor = "multi_thread")]
async fn new_worlds_go_past_a_host_that_drains_and_come_back_when_it_does_not() {
    let site = Site::open().await;
    let first = Toy::start(&site.service, "world-a").await;
    let worlds = site.worlds();
    until_up(&worlds, &["world-a"]).await;
    let is_open = follow_open(worlds.hosts());
    let is_open = || *is_open.borrow() == Some(true);
    until("an open host", async || is_open()).await;

    let draining = drain(&site.service, "world-a");
    draining.send_replace(true);
    until("nobody who is open", async || !is_open()).await;
    let nobody = BTreeSet::new();
    assert_eq!(worlds.hosts().place(&nobody).unwrap().id, id("world-a"), "it may say why not");
    assert!(!worlds.hosts().should_move(world("world-a")), "nobody else is there");
    let second = Toy::start(&site.service, "world-b").await;
    until("an open host again", async || is_open()).await;
    assert!(worlds.hosts().should_move(world("world-a")));
    for _ in 0..10 {
        worlds.ask(create()).await.unwrap();
    }
    assert_eq!((first.made(), second.made()), (0, 10));
    assert!(ticks(&worlds, world("world-a")).await, "what there is stays where it is");

    draining.send_replace(false);
    until("it does not drain", async || !worlds.hosts().should_move(world("world-a"))).await;
    for _ in 0..20 {
        worlds.ask(create()).await.unwrap();
    }
    assert!(first.made() > 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn names_without_a_service_get_no_world_while_there_is_one() {
    let site = Site::open().await;
    let mut names = Vec::new();
    for count in 0..60 {
        names.push(announce(&site.service, &format!("phantom-{count}"), 0).await);
    }
    let toy = Toy::start(&site.service, "world-z").await;
    let worlds = site.worlds();
    until_up(&worlds, &["world-z"]).await;
    until("all names", async || worlds.hosts().heard().len() == names.len() + 1).await;
    for _ in 0..20 {
        assert_eq!(worlds.hosts().place(&BTreeSet::new()).unwrap().id, id("world-z"));
        worlds.ask(create()).await.unwrap();
    }
    assert_eq!(toy.made(), 20);
    // A name that says a number, too, is found out when it is asked.
    let liar = announce(&site.service, "world-y", number("world-y")).await;
    until("the liar", async || worlds.hosts().of_world(world("world-y")).is_some()).await;
    for _ in 0..20 {
        worlds.ask(create()).await.unwrap();
    }
    assert_eq!(toy.made(), 40);
    drop((names, liar));
}

#[tokio::test(flavor = "multi_thread")]
async fn worlds_are_spread_by_load_and_ticked_where_they_are() {
    let site = Site::open().await;
    let names = ["world-a", "world-b", "world-c"];
    let mut toys = Vec::new();
    for name in names {
        toys.push(Toy::start(&site.service, name).await);
    }
    let worlds = site.worlds();
    until_up(&worlds, &names).await;
    let mut made = Vec::new();
    for _ in 0..60 {
        let Reply::WorldCreated { world, .. } = worlds.ask(create()).await.unwrap() else {
            panic!("no world")
        };
        made.push(world);
    }
    let spread: Vec<usize> = toys.iter().map(Toy::made).collect();
    assert!(spread.iter().all(|made| (15..=25).contains(made)), "{spread:?}");

    for world in &made {
        let results = worlds.tick(vec![TickItem::new(*world, 1)]).await.unwrap();
        assert_eq!(results[0].world, *world);
        let frame = &results[0].outcome.as_ref().unwrap().frame;
        assert_eq!(frame.0, [world.host() as u8], "another host answered");
    }
    let mixed = made.iter().map(|world| TickItem::new(*world, 1)).collect();
    assert_eq!(worlds.tick(mixed).await.unwrap_err().code, ErrorCode::InvalidMessage);

    // One that has much to do gets nothing while others have less.
    let busy = Load { worlds: 20, worlds_max: 1_000, busy: 0.9 };
    site.service.tell_load(ServiceKind::World, &id("world-b"), &busy);
    let before = toys[1].made();
    let is_told = async || {
        let (before, _) = (toys[1].made(), worlds.ask(create()).await.unwrap());
        toys[1].made() == before
    };
    let mut in_a_row = 0;
    let begun = Instant::now();
    while in_a_row < 30 {
        in_a_row = if is_told().await { in_a_row + 1 } else { 0 };
        assert!(begun.elapsed() < Duration::from_secs(30), "{} and {before}", toys[1].made());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_has_no_room_leaves_it_to_another_and_is_asked_again_after_its_next_load() {
    let site = Site::open().await;
    let (full, other) =
        (Toy::start(&site.service, "world-a").await, Toy::start(&site.service, "world-b").await);
    let worlds = site.worlds();
    until_up(&worlds, &["world-a", "world-b"]).await;
    full.is_full.send_replace(true);
    for _ in 0..20 {
        worlds.ask(create()).await.unwrap();
    }
    assert_eq!((full.made(), full.asked(), other.made()), (0, 1, 20));
    other.is_full.send_replace(true);
    assert_eq!(worlds.ask(create()).await.unwrap_err().code, ErrorCode::Capacity);
    full.is_full.send_replace(false);
    worlds.ask(create()).await.unwrap();
    assert_eq!(full.made(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn lists_are_of_all_hosts() {
    let site = Site::open().await;
    let _toys =
        [Toy::start(&site.service, "world-a").await, Toy::start(&site.service, "world-b").await];
    let worlds = site.worlds();
    until_up(&worlds, &["world-a", "world-b"]).await;
    assert_eq!(worlds.owned().await.unwrap(), [world("world-a"), world("world-b")]);
    let names: Vec<String> = worlds.maps().await.unwrap().into_iter().map(|map| map.name).collect();
    assert_eq!(names, ["Town", "world-a", "world-b"]);
    let stranger: Tenant = "stranger".parse().unwrap();
    assert_eq!(worlds.for_tenant(stranger).maps().await.unwrap().len(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_asks_before_anybody_is_up_waits() {
    let site = Site::open().await;
    let worlds = site.worlds();
    let asking = tokio::spawn({
        let worlds = worlds.clone();
        async move { worlds.ask(create()).await }
    });
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert!(!asking.is_finished());
    let toy = Toy::start(&site.service, "world-a").await;
    asking.await.unwrap().unwrap();
    assert_eq!(toy.made(), 1);
}

/// Where a router dies, what is on its way is lost without a word.
#[tokio::test(flavor = "multi_thread")]
async fn what_a_host_does_not_answer_is_not_waited_for_once_it_is_not_heard() {
    let site = Site::open().await;
    let (inbox, mut kept) = tokio::sync::mpsc::unbounded_channel();
    let swallow = move |incoming: Incoming| inbox.send(incoming).unwrap();
    let keys = [keys::any_worlds_of(&id("world-a")), keys::any_world(number("world-a"))];
    let mut serving = Vec::new();
    for key in &keys {
        serving.push(site.service.serve(key, swallow.clone()).await.unwrap());
    }
    let announcement = announce(&site.service, "world-a", number("world-a")).await;
    let worlds = site.worlds();
    until_up(&worlds, &["world-a"]).await;
    let snapshot = Request::SnapshotWorld { world: world("world-a") };
    let asking = [create(), Request::ListMaps, snapshot].map(|request| {
        let worlds = worlds.clone();
        tokio::spawn(async move { worlds.ask(request).await })
    });
    let mut unanswered = Vec::new();
    for _ in &asking {
        unanswered.push(kept.recv().await.unwrap());
    }
    drop(announcement);
    let toy = Toy::start(&site.service, "world-b").await;
    let [created, maps, snapshot] = asking;
    assert!(matches!(created.await.unwrap(), Ok(Reply::WorldCreated { .. })));
    assert!(matches!(maps.await.unwrap(), Ok(Reply::Maps(_))));
    assert_eq!(snapshot.await.unwrap().unwrap_err().code, ErrorCode::Unreachable);
    assert_eq!(toy.made(), 1);
}
