//! Leases: what depends on who else is up.

use std::time::{Duration, Instant};

use crate::common::{Site, config, connect, until};
use bus::{Announcement, Bus, Presence};
use schemas::{Alive, Lease, ServiceKind};

async fn announce(bus: &Bus, kind: ServiceKind, id: &str) -> Announcement {
    let alive = Alive {
        kind,
        id: id.parse().unwrap(),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
        number: 0,
    };
    bus.announce(alive).await.unwrap()
}

fn lease(owner: &str, millis: u32) -> Option<Lease> {
    Some(Lease { owner: owner.parse().unwrap(), millis })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_service_says_what_it_is() {
    let site = Site::open(config()).await;
    let mut watch = site.client.watch(Some(ServiceKind::World)).await.unwrap();
    let Presence::Up(alive) = watch.next().await else { panic!("down") };
    assert_eq!((alive.id, alive.capacity), (config().id, 64));
    assert_eq!(alive.pid, std::process::id());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_ends_with_its_lease_after_its_owner_died() {
    let site = Site::open(config()).await;
    let owner = connect(&site.service).await;
    let _announcement = announce(&owner, ServiceKind::Scenario, "s").await;
    let (kept, leased) =
        (site.create(1, None).await.unwrap(), site.create(2, lease("s", 200)).await.unwrap());
    tokio::time::sleep(Duration::from_millis(400)).await;
    assert_eq!(site.list().await.len(), 2, "the owner lives");
    let died = Instant::now();
    owner.close().await;
    until("the leased world has ended", || async { site.list().await.len() == 1 }).await;
    assert!(died.elapsed() >= Duration::from_millis(200), "{:?}", died.elapsed());
    assert_eq!(site.list().await[0].world, kept, "{leased} was to end");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_owner_that_comes_back_in_time_keeps_its_world() {
    let site = Site::open(config()).await;
    let owner = connect(&site.service).await;
    let announcement = announce(&owner, ServiceKind::Scenario, "s").await;
    site.create(1, lease("s", 3_000)).await.unwrap();
    drop(announcement);
    tokio::time::sleep(Duration::from_millis(200)).await;
    let _again = announce(&owner, ServiceKind::Scenario, "s").await;
    tokio::time::sleep(Duration::from_millis(3_200)).await;
    assert_eq!(site.list().await.len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_world_whose_owner_was_never_there_ends_too() {
    let site = Site::open(config()).await;
    site.create(1, lease("nobody", 100)).await.unwrap();
    until("it has ended", || async { site.list().await.is_empty() }).await;
}
