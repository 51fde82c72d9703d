//! Fast channels: answers of any size arrive whole and at their askers, and nobody waits for a
//! service that is gone.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Announcement, Bus, BusConfig, Channel, Incoming, Serving};
use schemas::{Alive, ErrorCode, Reply, Request, ServiceId, ServiceKind, TickItem, WorldId, keys};

use crate::common::{Site, deadline};

fn host() -> ServiceId {
    "world-1".parse().unwrap()
}

fn key() -> String {
    keys::batch_tick(&host())
}

async fn announced(bus: &Bus) -> Announcement {
    let alive = Alive {
        kind: ServiceKind::World,
        id: host(),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
        number: 0,
    };
    bus.announce(alive).await.unwrap()
}

/// Serves the channel's key with as many bytes as the first world's id says.
async fn sized(bus: &Bus) -> (Serving, Announcement) {
    let answer = |incoming: Incoming| match incoming.request() {
        Ok(Request::TickWorlds(items)) => {
            let bytes = items[0].world.get() as usize;
            let content = (0..bytes).map(|index| (index % 251) as u8).collect();
            incoming.reply(&Reply::Snapshot(content));
        }
        Ok(_) => incoming.reply(&Reply::Done),
        Err(error) => incoming.refuse(error),
    };
    (bus.serve(&key(), answer).await.unwrap(), announced(bus).await)
}

async fn channel(bus: &Bus) -> Channel {
    bus.channel(&key(), (ServiceKind::World, &host())).await.unwrap()
}

fn ticks(bytes: u64, count: usize) -> Request {
    Request::TickWorlds(vec![TickItem::new(WorldId::new(bytes).unwrap(), 1); count])
}

async fn check_size(channel: &Channel, bytes: u64) {
    let Ok(Reply::Snapshot(content)) = channel.request(&ticks(bytes, 1), deadline()).await else {
        panic!("{bytes} bytes did not come");
    };
    assert_eq!(content.len() as u64, bytes);
    assert!(content.iter().enumerate().all(|(index, byte)| *byte == (index % 251) as u8));
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_of_any_size_arrive_whole() {
    let site = Site::open().await;
    let _serving = sized(&site.service).await;
    let channel = channel(&site.client).await;
    for bytes in [1, 1_500, 40 * 1024 - 100, 40 * 1024, 49_000, 60_000, 300_000, 5_000_000] {
        check_size(&channel, bytes).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_large_question_is_asked_like_any_other() {
    let site = Site::open().await;
    let _serving = sized(&site.service).await;
    let channel = channel(&site.client).await;
    let large = ticks(7, 4_000);
    assert!(schemas::wire::encode_request(&large).len() > 40 * 1024);
    let answer = channel.request(&large, deadline()).await;
    assert!(matches!(&answer, Ok(Reply::Snapshot(content)) if content.len() == 7), "{answer:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn many_at_once_each_get_their_own_answer() {
    let site = Site::open().await;
    let _serving = sized(&site.service).await;
    let channels = [Arc::new(channel(&site.client).await), Arc::new(channel(&site.client).await)];
    let askers = (1..=200).map(|index: u64| {
        let channel = Arc::clone(&channels[(index % 2) as usize]);
        tokio::spawn(async move { check_size(&channel, index * 700).await })
    });
    for asker in askers.collect::<Vec<_>>() {
        asker.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_channel_leads_through_a_bus_in_the_middle() {
    let middle = Bus::open(BusConfig::listening(bus::BusAddress::loopback(0))).await.unwrap();
    let connect = || BusConfig::connecting(middle.listening()[0].clone());
    let service = Bus::open(connect()).await.unwrap();
    let client = Bus::open(connect()).await.unwrap();
    let _serving = sized(&service).await;
    let channel = channel(&client).await;
    for bytes in [10, 100_000, 1_000_000] {
        check_size(&channel, bytes).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_waits_for_a_service_that_has_gone() {
    let site = Site::open().await;
    let announcement = announced(&site.service).await;
    let (inbox, kept) = std::sync::mpsc::channel();
    let _serving = site.service.serve(&key(), move |incoming| inbox.send(incoming).unwrap()).await;
    let channel = Arc::new(channel(&site.client).await);
    let asking = {
        let channel = Arc::clone(&channel);
        tokio::spawn(async move { channel.request(&ticks(1, 1), deadline()).await })
    };
    let incoming: Incoming =
        tokio::task::spawn_blocking(move || kept.recv()).await.unwrap().unwrap();
    let gone = Instant::now();
    drop(announcement);
    assert_eq!(asking.await.unwrap().unwrap_err().code, ErrorCode::Unreachable);
    assert!(gone.elapsed() < deadline() / 2, "{:?}", gone.elapsed());
    let again = channel.request(&ticks(1, 1), deadline()).await;
    assert_eq!(again.unwrap_err().code, ErrorCode::Unreachable);
    // Too late, and nobody is harmed.
    incoming.reply(&Reply::Done);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_keeps_silent_is_a_time_out_and_a_dropped_question_an_error() {
    let site = Site::open().await;
    let (inbox, kept) = std::sync::mpsc::channel();
    let handler = move |incoming| inbox.send(incoming).unwrap();
    let _serving = site.service.serve(&key(), handler).await.unwrap();
    let _announcement = announced(&site.service).await;
    let channel = channel(&site.client).await;
    let short = Duration::from_millis(100);
    let silent = channel.request(&ticks(1, 1), short).await.unwrap_err();
    assert_eq!(silent.code, ErrorCode::TimedOut, "{silent}");
    let question = ticks(1, 1);
    let (dropped, ()) = tokio::join!(channel.request(&question, deadline()), async {
        tokio::task::spawn_blocking(move || (kept.recv().unwrap(), kept.recv().unwrap()))
            .await
            .map(drop)
            .unwrap();
    });
    assert_eq!(dropped.unwrap_err().code, ErrorCode::Internal);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_channel_to_nobody_says_that_nobody_answers() {
    let site = Site::open().await;
    let channel = channel(&site.client).await;
    let asked = channel.request(&ticks(1, 1), deadline()).await;
    assert_eq!(asked.unwrap_err().code, ErrorCode::Unreachable);
}
