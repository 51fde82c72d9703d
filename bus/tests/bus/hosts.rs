//! A service that the bus does not hear is asked on while its shortcut proves that it lives.

use bus::{Announcement, Bus, Hosts, Incoming, Serving};
use schemas::{Alive, Reply, Request, ServiceId, ServiceKind, TickItem, WorldId, keys};
use tokio::sync::watch;

use crate::common::{Site, deadline, until};

fn host() -> ServiceId {
    "world-a".parse().unwrap()
}

async fn announce(bus: &Bus) -> Announcement {
    let alive = Alive {
        kind: ServiceKind::World,
        id: host(),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
    };
    bus.announce(alive).await.unwrap()
}

async fn serve(bus: &Bus) -> Serving {
    let answer = |incoming: Incoming| incoming.reply(&Reply::Done);
    bus.serve_shortcut(&keys::batch_tick(&host()), answer).await.unwrap()
}

/// Hosts as a face follows them, one world of the only one, and whether it is open.
async fn followed(bus: &Bus) -> (Hosts, WorldId, watch::Receiver<bool>) {
    let bus = watch::Sender::new(Some(bus.clone())).subscribe();
    let hosts = Hosts::follow(bus, ServiceKind::World, keys::batch_tick);
    let world = WorldId::of_host(7, 1);
    let has_channel = || async { hosts.of_world(world).is_some_and(|host| host.channel.is_some()) };
    until("a channel to the host", has_channel).await;
    hosts.note_world(&host(), world);
    let (told, is_open) = watch::channel(false);
    let telling = hosts.clone();
    let tell = move |is_open| _ = told.send_replace(is_open);
    tokio::spawn(async move { telling.tell_open(tell).await });
    until("an open host", || async { *is_open.borrow() }).await;
    (hosts, world, is_open)
}

async fn ticks(hosts: &Hosts, world: WorldId) -> bool {
    let Some(channel) = hosts.of_world(world).and_then(|host| host.channel) else { return false };
    let request = Request::TickWorlds(vec![TickItem::new(world, 1)]);
    channel.request(&request, deadline()).await == Ok(Reply::Done)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_host_that_is_silent_is_asked_on_and_taken_back_and_one_that_is_dead_is_forgotten() {
    let site = Site::open().await;
    let (serving, announcement) = (serve(&site.service).await, announce(&site.service).await);
    let (hosts, world, is_open) = followed(&site.client).await;

    drop(announcement);
    until("a silent host", || async { !*is_open.borrow() }).await;
    assert!(ticks(&hosts, world).await, "a host that lives is not asked any more");
    let announcement = announce(&site.service).await;
    until("an open host again", || async { *is_open.borrow() }).await;
    assert!(ticks(&hosts, world).await, "a host that came back is not asked");

    drop(announcement);
    until("a silent host again", || async { !*is_open.borrow() }).await;
    drop(serving);
    until("a dead host", || async { hosts.of_world(world).is_none() }).await;
    assert!(!ticks(&hosts, world).await);
}
