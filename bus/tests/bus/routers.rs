//! Several routers: what is behind one reaches what is behind another, and none waits for one that
//! is not there.

use std::time::Duration;

use bus::{Bus, BusAddress, BusConfig, Incoming, Serving};
use schemas::{
    Alive, Error, ErrorCode, Reply, Request, ServiceId, ServiceKind, TickItem, WorldId, keys,
};

use crate::common::{deadline, tenant, until};

/// More than one message of the low-latency transport can carry.
const LARGE_BYTES: usize = 1_000_000;

async fn router(connect: &[&Bus]) -> Bus {
    let connect = connect.iter().map(|router| router.listening()[0].clone()).collect();
    let listen = vec![BusAddress::loopback(0)];
    Bus::open(BusConfig { listen, connect, ..BusConfig::default() }).await.unwrap()
}

async fn behind(router: &Bus) -> Bus {
    Bus::open(BusConfig::connecting(router.listening()[0].clone())).await.unwrap()
}

fn alive(host: &ServiceId) -> Alive {
    Alive {
        kind: ServiceKind::World,
        id: host.clone(),
        version: String::new(),
        pid: 1,
        capacity: 1,
        detail: String::new(),
        number: 0,
    }
}

async fn large_replies(bus: &Bus, key: &str) -> Serving {
    let answer = |incoming: Incoming| incoming.reply(&Reply::Snapshot(vec![7; LARGE_BYTES]));
    bus.serve(key, answer).await.unwrap()
}

/// A line of three routers, a service behind the first and an asker behind the last.
#[tokio::test(flavor = "multi_thread")]
async fn large_replies_cross_three_routers() {
    let first = router(&[]).await;
    let second = router(&[&first]).await;
    let third = router(&[&second]).await;
    let (service, asker) = (behind(&first).await, behind(&third).await);
    let _serving = large_replies(&service, keys::ANY_WORLDS).await;
    let key = keys::worlds(&tenant());
    let ask = || asker.request(&key, &Request::ListMaps, deadline());
    until("a route over three routers", || async { ask().await.is_ok() }).await;
    for _ in 0..5 {
        let Ok(Reply::Snapshot(content)) = ask().await else { panic!("a large reply was lost") };
        assert_eq!(content.len(), LARGE_BYTES);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lane_crosses_two_routers() {
    let first = router(&[]).await;
    let second = router(&[&first]).await;
    let (service, asker) = (behind(&first).await, behind(&second).await);
    let host: ServiceId = "world-1".parse().unwrap();
    let key = keys::batch_tick(&host);
    let answer = |incoming: Incoming| incoming.reply(&Reply::Snapshot(vec![7; 10]));
    let _serving = service.serve(&key, answer).await.unwrap();
    let _announcement = service.announce(alive(&host)).await.unwrap();
    let channel = asker.channel(&key, (ServiceKind::World, &host)).await.unwrap();
    let ticks = Request::TickWorlds(vec![TickItem::new(WorldId::new(1).unwrap(), 1)]);
    until("a channel over two routers", || async {
        channel.request(&ticks, Duration::from_millis(200)).await
            == Ok(Reply::Snapshot(vec![7; 10]))
    })
    .await;
}

/// Nobody need answer what was asked through the first one.
#[tokio::test(flavor = "multi_thread")]
async fn a_channel_gives_up_what_is_asked_when_its_router_goes_and_leads_on_by_another() {
    let first = router(&[]).await;
    let second = router(&[&first]).await;
    let service = behind(&second).await;
    let connect = [&first, &second].map(|router| router.listening()[0].clone()).to_vec();
    let asker = Bus::open(BusConfig { connect, ..BusConfig::default() }).await.unwrap();
    let host: ServiceId = "world-1".parse().unwrap();
    let key = keys::batch_tick(&host);
    let _serving = large_replies(&service, &key).await;
    let _announcement = service.announce(alive(&host)).await.unwrap();
    let channel = asker.channel(&key, (ServiceKind::World, &host)).await.unwrap();
    let ticks = Request::TickWorlds(vec![TickItem::new(WorldId::new(1).unwrap(), 1)]);
    let answers = || async { channel.request(&ticks, deadline()).await.is_ok() };
    until("a channel by the first router", answers).await;
    let asked = channel.while_heard(std::future::pending::<Result<(), Error>>());
    let (lost, ()) = tokio::join!(tokio::time::timeout(deadline(), asked), first.close());
    assert_eq!(lost.expect("it waits on").unwrap_err().code, ErrorCode::Unreachable);
    until("a channel by the second router", answers).await;
}

/// A service that is started anew while the first of its routers is down comes up.
#[tokio::test(flavor = "multi_thread")]
async fn who_only_connects_comes_by_whichever_router_is_there() {
    let there = router(&[]).await;
    let connect = vec![BusAddress::loopback(free_port()), there.listening()[0].clone()];
    let opening = Bus::open(BusConfig { connect, ..BusConfig::default() });
    tokio::time::timeout(deadline(), opening).await.expect("it waits for the first").unwrap();
}

/// As in a list of routers that all are given, of which one is the reader itself.
#[tokio::test(flavor = "multi_thread")]
async fn routers_that_name_each_other_and_themselves_serve() {
    let addresses: Vec<BusAddress> = [free_port(), free_port()].map(BusAddress::loopback).to_vec();
    let open = |own: &BusAddress| {
        let config = BusConfig {
            listen: vec![own.clone()],
            connect: addresses.clone(),
            ..BusConfig::default()
        };
        async { tokio::time::timeout(deadline(), Bus::open(config)).await }
    };
    let first = open(&addresses[0]).await.expect("it waits for the second for ever").unwrap();
    let second = open(&addresses[1]).await.expect("it waits for itself for ever").unwrap();
    let (service, asker) = (behind(&first).await, behind(&second).await);
    let _serving = large_replies(&service, keys::ANY_WORLDS).await;
    let key = keys::worlds(&tenant());
    until("a route between the two", || async {
        asker.request(&key, &Request::ListMaps, deadline()).await.is_ok()
    })
    .await;
}

fn free_port() -> u16 {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    taken.local_addr().unwrap().port()
}
