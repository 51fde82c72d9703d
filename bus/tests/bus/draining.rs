//! Who drains is known to all.

use bus::Bus;
use schemas::{ServiceId, ServiceKind};
use tokio::sync::watch;

use crate::common::{Site, until};

fn id(name: &str) -> ServiceId {
    name.parse().unwrap()
}

/// Has a service drain while the sender says so.
fn drain(bus: &Bus, name: &str) -> watch::Sender<bool> {
    let told = watch::Sender::new(false);
    let (bus, service, drain) = (bus.clone(), (ServiceKind::World, id(name)), told.subscribe());
    tokio::spawn(async move { bus.tell_draining(service, drain, |is_on| *is_on).await });
    told
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
