//! World services as faces follow them, on a real bus.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod toy;

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use bus::Incoming;
use schemas::{ErrorCode, Load, Reply, Request, ServiceKind, Tenant, TickItem, WorldId, keys};

use toy::*;

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
