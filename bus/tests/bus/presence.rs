//! Who is up, seen from another place on the bus.

use std::time::Instant;

use crate::common::{Site, deadline};
use bus::{Bus, BusConfig, Presence, Watch};
use schemas::{Alive, ServiceKind};

fn renderer(id: &str) -> Alive {
    Alive {
        kind: ServiceKind::Render,
        id: id.parse().unwrap(),
        version: "0.1.0".to_owned(),
        pid: 7,
        capacity: 2,
        detail: "llvmpipe".to_owned(),
        number: 0,
    }
}

async fn next(watch: &mut Watch) -> Presence {
    tokio::time::timeout(deadline(), watch.next()).await.expect("nothing changed")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_is_seen_to_come_and_to_go() {
    let site = Site::open().await;
    let mut watch = site.service.watch(Some(ServiceKind::Render)).await.unwrap();
    let announcement = site.client.announce(renderer("a")).await.unwrap();
    assert_eq!(next(&mut watch).await, Presence::Up(renderer("a")));
    drop(announcement);
    assert_eq!(next(&mut watch).await, Presence::Down(ServiceKind::Render, "a".parse().unwrap()));
}

#[tokio::test(flavor = "multi_thread")]
async fn those_that_are_up_already_come_first() {
    let site = Site::open().await;
    let _first = site.service.announce(renderer("a")).await.unwrap();
    let second =
        Bus::open(BusConfig::connecting(site.service.listening()[0].clone())).await.unwrap();
    let _second = second.announce(renderer("b")).await.unwrap();
    let mut watch = site.client.watch(None).await.unwrap();
    // One token of the two may be known a moment before the other.
    let seen = [next(&mut watch).await, next(&mut watch).await];
    for id in ["a", "b"] {
        assert!(seen.contains(&Presence::Up(renderer(id))), "{seen:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watch_of_one_kind_sees_no_other() {
    let site = Site::open().await;
    let mut watch = site.service.watch(Some(ServiceKind::Render)).await.unwrap();
    let scenario = Alive { kind: ServiceKind::Scenario, ..renderer("s") };
    let _scenario = site.client.announce(scenario).await.unwrap();
    let _renderer = site.client.announce(renderer("a")).await.unwrap();
    assert_eq!(next(&mut watch).await, Presence::Up(renderer("a")));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_process_that_ends_without_a_word_is_gone_at_once() {
    let site = Site::open().await;
    let mut watch = site.service.watch(None).await.unwrap();
    let _announcement = site.client.announce(renderer("a")).await.unwrap();
    assert_eq!(next(&mut watch).await, Presence::Up(renderer("a")));
    let ended = Instant::now();
    site.client.close().await;
    assert_eq!(next(&mut watch).await, Presence::Down(ServiceKind::Render, "a".parse().unwrap()));
    assert!(ended.elapsed() < deadline() / 2, "{:?}", ended.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_restarts_between_two_looks_is_seen_down_and_up() {
    let site = Site::open().await;
    let mut watch = site.service.watch(None).await.unwrap();
    let first = site.client.announce(renderer("a")).await.unwrap();
    assert_eq!(next(&mut watch).await, Presence::Up(renderer("a")));
    drop(first);
    let restarted = Alive { pid: 8, ..renderer("a") };
    let _second = site.client.announce(restarted.clone()).await.unwrap();
    assert_eq!(next(&mut watch).await, Presence::Down(ServiceKind::Render, "a".parse().unwrap()));
    assert_eq!(next(&mut watch).await, Presence::Up(restarted));
}

#[tokio::test(flavor = "multi_thread")]
async fn services_that_never_say_what_they_are_keep_nobody_waiting_who_does() {
    let site = Site::open().await;
    let mut watch = site.service.watch(Some(ServiceKind::Render)).await.unwrap();
    let mut config = zenoh::Config::default();
    let bus = site.service.listening()[0].clone();
    for (name, value) in [
        ("mode", "\"client\"".to_owned()),
        ("connect/endpoints", format!("[\"{bus}\"]")),
        ("scouting/multicast/enabled", "false".to_owned()),
    ] {
        config.insert_json5(name, &value).unwrap();
    }
    let stranger = zenoh::open(config).await.unwrap();
    let mut tokens = Vec::new();
    for count in 0..60 {
        let key = format!("causeway/alive/render/a-{count}");
        tokens.push(stranger.liveliness().declare_token(key).await.unwrap());
    }
    let begun = Instant::now();
    let _real = site.client.announce(renderer("z")).await.unwrap();
    while next(&mut watch).await != Presence::Up(renderer("z")) {}
    // One after the other they took half a second each.
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
}
