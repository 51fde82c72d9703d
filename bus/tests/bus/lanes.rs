//! The fast lane: answers of any size arrive whole and at their askers, and nobody waits for a
//! service that is gone.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Announcement, Bus, BusConfig, Incoming, Lane, Serving};
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
    };
    bus.announce(alive).await.unwrap()
}

/// Serves the lane's key both ways with as many bytes as the first world's id says.
async fn sized(bus: &Bus) -> Vec<Serving> {
    let answer = |incoming: Incoming| match incoming.request() {
        Ok(Request::TickWorlds(items)) => {
            let bytes = items[0].world.get() as usize;
            let content = (0..bytes).map(|index| (index % 251) as u8).collect();
            incoming.reply(&Reply::Snapshot(content));
        }
        Ok(_) => incoming.reply(&Reply::Done),
        Err(error) => incoming.refuse(error),
    };
    vec![bus.serve(&key(), answer).await.unwrap(), bus.serve_lane(&key(), answer).await.unwrap()]
}

async fn lane(bus: &Bus) -> Lane {
    bus.lane(&key(), (ServiceKind::World, &host())).await.unwrap()
}

fn ticks(bytes: u64, count: usize) -> Request {
    Request::TickWorlds(vec![TickItem::new(WorldId::new(bytes).unwrap(), 1); count])
}

async fn check_size(lane: &Lane, bytes: u64) {
    let Ok(Reply::Snapshot(content)) = lane.request(&ticks(bytes, 1), deadline()).await else {
        panic!("{bytes} bytes did not come");
    };
    assert_eq!(content.len() as u64, bytes);
    assert!(content.iter().enumerate().all(|(index, byte)| *byte == (index % 251) as u8));
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_of_any_size_arrive_whole() {
    let site = Site::open().await;
    let _serving = sized(&site.service).await;
    let lane = lane(&site.client).await;
    for bytes in [1, 1_500, 40 * 1024 - 100, 40 * 1024, 49_000, 60_000, 300_000, 5_000_000] {
        check_size(&lane, bytes).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_question_too_large_for_the_lane_is_asked_all_the_same() {
    let site = Site::open().await;
    let _serving = sized(&site.service).await;
    let lane = lane(&site.client).await;
    let large = ticks(7, 4_000);
    assert!(schemas::wire::encode_request(&large).len() > 40 * 1024);
    let answer = lane.request(&large, deadline()).await;
    assert!(matches!(&answer, Ok(Reply::Snapshot(content)) if content.len() == 7), "{answer:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn many_at_once_each_get_their_own_answer() {
    let site = Site::open().await;
    let _serving = sized(&site.service).await;
    let lanes = [Arc::new(lane(&site.client).await), Arc::new(lane(&site.client).await)];
    let askers = (1..=200).map(|index: u64| {
        let lane = Arc::clone(&lanes[(index % 2) as usize]);
        tokio::spawn(async move { check_size(&lane, index * 700).await })
    });
    for asker in askers.collect::<Vec<_>>() {
        asker.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lane_leads_through_a_bus_in_the_middle() {
    let middle = Bus::open(BusConfig::listening(bus::Endpoint::loopback(0))).await.unwrap();
    let connect = || BusConfig::connecting(middle.listening()[0].clone());
    let service = Bus::open(connect()).await.unwrap();
    let client = Bus::open(connect()).await.unwrap();
    let _serving = sized(&service).await;
    let lane = lane(&client).await;
    for bytes in [10, 100_000, 1_000_000] {
        check_size(&lane, bytes).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_waits_for_a_service_that_has_gone() {
    let site = Site::open().await;
    let announcement = announced(&site.service).await;
    let (inbox, kept) = std::sync::mpsc::channel();
    let _serving =
        site.service.serve_lane(&key(), move |incoming| inbox.send(incoming).unwrap()).await;
    let lane = Arc::new(lane(&site.client).await);
    let asking = {
        let lane = Arc::clone(&lane);
        tokio::spawn(async move { lane.request(&ticks(1, 1), deadline()).await })
    };
    let incoming: Incoming =
        tokio::task::spawn_blocking(move || kept.recv()).await.unwrap().unwrap();
    let gone = Instant::now();
    drop(announcement);
    assert_eq!(asking.await.unwrap().unwrap_err().code, ErrorCode::Unreachable);
    assert!(gone.elapsed() < deadline() / 2, "{:?}", gone.elapsed());
    let again = lane.request(&ticks(1, 1), deadline()).await;
    assert_eq!(again.unwrap_err().code, ErrorCode::Unreachable);
    // Too late, and nobody is harmed.
    incoming.reply(&Reply::Done);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_keeps_silent_is_a_time_out_and_a_dropped_question_an_error() {
    let site = Site::open().await;
    let (inbox, kept) = std::sync::mpsc::channel();
    let handler = move |incoming| inbox.send(incoming).unwrap();
    let _serving = site.service.serve_lane(&key(), handler).await.unwrap();
    let lane = lane(&site.client).await;
    let short = Duration::from_millis(100);
    let silent = lane.request(&ticks(1, 1), short).await.unwrap_err();
    assert_eq!(silent.code, ErrorCode::TimedOut, "{silent}");
    let question = ticks(1, 1);
    let (dropped, ()) = tokio::join!(lane.request(&question, deadline()), async {
        tokio::task::spawn_blocking(move || (kept.recv().unwrap(), kept.recv().unwrap()))
            .await
            .map(drop)
            .unwrap();
    });
    assert_eq!(dropped.unwrap_err().code, ErrorCode::Internal);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lane_to_nobody_is_not_opened() {
    let site = Site::open().await;
    let opened = site.client.lane(&key(), (ServiceKind::World, &host())).await;
    assert!(opened.is_err());
}
