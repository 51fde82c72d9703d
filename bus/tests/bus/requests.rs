//! Requests and replies between two places on the bus: what arrives, and what an asker hears when
//! nothing does.

use std::time::{Duration, Instant};

use crate::common::{Site, deadline};
use bus::{Bus, BusConfig, BusError};
use schemas::{ErrorCode, Reply, Request, WorldId, keys, limits};

#[tokio::test(flavor = "multi_thread")]
async fn a_reply_from_another_thread_arrives() {
    let site = Site::open().await;
    let (inbox, requests) = std::sync::mpsc::sync_channel(1);
    let _serving = site
        .service
        .serve(keys::ANY_WORLDS, move |incoming| inbox.send(incoming).unwrap())
        .await
        .unwrap();
    let worker = std::thread::spawn(move || {
        let incoming: bus::Incoming = requests.recv().unwrap();
        assert_eq!(incoming.key(), "causeway/local/worlds");
        assert_eq!(incoming.request().unwrap(), Request::ListMaps);
        assert!(!incoming.is_given_up());
        incoming.reply(&Reply::Maps(Vec::new()));
    });
    let reply = site.client.request(&site.worlds(), &Request::ListMaps, deadline()).await;
    assert_eq!(reply, Ok(Reply::Maps(Vec::new())));
    worker.join().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_nobody_serves_is_unreachable_at_once() {
    let site = Site::open().await;
    let asked = Instant::now();
    let error =
        site.client.request(&site.worlds(), &Request::ListMaps, deadline()).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::Unreachable, "{error}");
    assert!(asked.elapsed() < deadline() / 2, "{:?}", asked.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_does_not_answer_is_a_time_out_at_the_deadline() {
    let site = Site::open().await;
    let (inbox, kept) = std::sync::mpsc::sync_channel(1);
    let _serving = site
        .service
        .serve(keys::ANY_WORLDS, move |incoming| inbox.send(incoming).unwrap())
        .await
        .unwrap();
    let asked = Instant::now();
    let short = Duration::from_millis(100);
    let error = site.client.request(&site.worlds(), &Request::ListMaps, short).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::TimedOut, "{error}");
    assert!((short..deadline() / 2).contains(&asked.elapsed()), "{:?}", asked.elapsed());
    let incoming: bus::Incoming = kept.recv().unwrap();
    while !incoming.is_given_up() {
        assert!(asked.elapsed() < deadline(), "the service is not told that nobody waits");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_ends_while_it_is_asked_is_unreachable_promptly() {
    let site = Site::open().await;
    let (inbox, kept) = tokio::sync::mpsc::channel(1);
    let serving = site
        .service
        .serve(keys::ANY_WORLDS, move |incoming| inbox.try_send(incoming).unwrap())
        .await
        .unwrap();
    let (client, key) = (site.client.clone(), site.worlds());
    let asking =
        tokio::spawn(async move { client.request(&key, &Request::ListMaps, deadline()).await });
    let mut kept = kept;
    let unanswered = kept.recv().await.unwrap();
    let ended = Instant::now();
    drop(serving);
    site.service.close().await;
    let error = asking.await.unwrap().unwrap_err();
    assert_eq!(error.code, ErrorCode::Unreachable, "{error}");
    assert!(ended.elapsed() < deadline() / 2, "{:?}", ended.elapsed());
    drop(unanswered);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_that_is_dropped_is_answered_with_an_internal_error() {
    let site = Site::open().await;
    let _serving = site.service.serve(keys::ANY_WORLDS, drop).await.unwrap();
    let error =
        site.client.request(&site.worlds(), &Request::ListMaps, deadline()).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::Internal, "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_reaches_the_asker_as_it_is() {
    let site = Site::open().await;
    let refusal =
        schemas::Error::new(ErrorCode::UnknownMap, "no such map").wanted("a map").found("x");
    let answer = refusal.clone();
    let _serving = site
        .service
        .serve(keys::ANY_WORLDS, move |incoming| incoming.refuse(answer.clone()))
        .await
        .unwrap();
    let error =
        site.client.request(&site.worlds(), &Request::ListMaps, deadline()).await.unwrap_err();
    assert_eq!(error, refusal);
}

#[tokio::test(flavor = "multi_thread")]
async fn megabytes_arrive_in_both_directions() {
    let site = Site::open().await;
    let echo = |incoming: bus::Incoming| match incoming.request() {
        Ok(Request::RestoreWorld { snapshot, .. }) => incoming.reply(&Reply::Snapshot(snapshot)),
        other => panic!("{other:?}"),
    };
    let _serving = site.service.serve(keys::ANY_WORLDS, echo).await.unwrap();
    for bytes in [1_000, 60_000, 5_000_000] {
        let snapshot: Vec<u8> = (0..bytes).map(|index| (index % 251) as u8).collect();
        let request = Request::RestoreWorld { snapshot: snapshot.clone(), lease: None };
        let reply = site.client.request(&site.worlds(), &request, deadline()).await;
        assert!(reply == Ok(Reply::Snapshot(snapshot)), "{bytes} bytes came back changed");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_over_the_limit_is_refused_before_it_is_sent() {
    let site = Site::open().await;
    let _serving =
        site.service.serve(keys::ANY_WORLDS, |_| panic!("must not arrive")).await.unwrap();
    let request =
        Request::RestoreWorld { snapshot: vec![0; limits::REQUEST_BYTES_MAX + 1], lease: None };
    let error = site.client.request(&site.worlds(), &request, deadline()).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::TooLarge, "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_taken_port_is_one_clear_error() {
    let site = Site::open().await;
    let taken = site.service.listening()[0].clone();
    let Err(error) = Bus::open(BusConfig::listening(taken.clone())).await else { panic!("opened") };
    assert!(matches!(&error, BusError::Listen { address, .. } if *address == taken), "{error}");
    assert!(!error.to_string().contains('\n'), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_to_connect_to_is_one_clear_error_at_the_deadline() {
    let closed = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let config = BusConfig {
        connect_deadline: Some(Duration::from_millis(200)),
        ..BusConfig::connecting(bus::BusAddress::loopback(closed))
    };
    let Err(error) = Bus::open(config).await else { panic!("opened") };
    assert!(matches!(error, BusError::Connect { .. }), "{error}");
    assert!(!error.to_string().contains('\n'), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_comes_first_waits_for_the_service() {
    let address = {
        let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        bus::BusAddress::loopback(taken.local_addr().unwrap().port())
    };
    let client = tokio::spawn(Bus::open(BusConfig::connecting(address.clone())));
    tokio::time::sleep(Duration::from_millis(50)).await;
    let service = Bus::open(BusConfig::listening(address)).await.unwrap();
    let _serving =
        service.serve(&keys::any_world(0), |incoming| incoming.reply(&Reply::Done)).await.unwrap();
    let client = client.await.unwrap().unwrap();
    let key = keys::world(&crate::common::tenant(), WorldId::new(1).unwrap());
    crate::common::until("the service is reachable", || async {
        client.request(&key, &Request::ListWorlds, deadline()).await == Ok(Reply::Done)
    })
    .await;
}
