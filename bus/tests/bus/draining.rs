//! New work goes to services that do not drain, and what there is stays where it is.

use bus::{Announcement, Bus, Hosts};
use schemas::{Alive, ServiceId, ServiceKind, WorldId, keys};
use tokio::sync::watch;

use crate::common::{Site, until};

fn id(name: &str) -> ServiceId {
    name.parse().unwrap()
}

async fn announce_host(bus: &Bus, name: &str) -> Announcement {
    let alive = Alive {
        kind: ServiceKind::World,
        id: id(name),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
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

fn next(hosts: &Hosts) -> Option<ServiceId> {
    hosts.next().borrow().as_ref().map(|host| host.id.clone())
}

#[tokio::test(flavor = "multi_thread")]
async fn new_work_goes_past_a_host_that_drains_and_comes_back_when_it_does_not() {
    let site = Site::open().await;
    let _first = announce_host(&site.service, "world-a").await;
    let hosts = Hosts::follow(
        watch::Sender::new(Some(site.client.clone())).subscribe(),
        ServiceKind::World,
        keys::batch_tick,
    );
    until("the first host", || async { next(&hosts) == Some(id("world-a")) }).await;
    let of_first = WorldId::of_host(7, 1);
    hosts.note_world(&id("world-a"), of_first);
    let is_open = watch::Sender::new(None);
    let (following, told) = (hosts.clone(), is_open.clone());
    tokio::spawn(async move {
        following.tell_open(|open| told.send_modify(|told| *told = Some(open))).await
    });
    let is_open = || *is_open.borrow();
    until("an open host", || async { is_open() == Some(true) }).await;

    let draining = drain(&site.service, "world-a");
    draining.send_replace(true);
    until("nobody who is open", || async { is_open() == Some(false) }).await;
    assert_eq!(next(&hosts), Some(id("world-a")), "it is there for what it has");
    let _second = announce_host(&site.service, "world-b").await;
    until("the other host", || async { next(&hosts) == Some(id("world-b")) }).await;
    until("an open host again", || async { is_open() == Some(true) }).await;
    assert_eq!(hosts.of_world(of_first).unwrap().id, id("world-a"));
    assert_eq!(hosts.of_world(WorldId::of_host(8, 1)).unwrap().id, id("world-b"));

    draining.send_replace(false);
    until("the first host again", || async { next(&hosts) == Some(id("world-a")) }).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_comes_later_knows_who_drains_and_nothing_is_left_of_who_has_gone() {
    let site = Site::open().await;
    let draining = drain(&site.service, "world-a");
    draining.send_replace(true);
    let follow = || site.client.follow_draining(ServiceKind::World);
    until("known at once", || async {
        let mut followed = follow().await.unwrap();
        let soon = std::time::Duration::from_millis(200);
        let _ = tokio::time::timeout(soon, followed.changed()).await;
        followed.has(&id("world-a"))
    })
    .await;
    let followed = follow().await.unwrap();
    until("known", || async { followed.has(&id("world-a")) }).await;
    site.service.close().await;
    until("gone", || async { !followed.has(&id("world-a")) }).await;
}
