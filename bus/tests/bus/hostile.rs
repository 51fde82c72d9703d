//! Bytes that are no messages: refused with a reason, by the side that gets them.

use crate::common::{Site, deadline, tenant, until};
use bus::Incoming;
use schemas::{ErrorCode, Reply, Request, WorldId, keys};
use zenoh::Wait as _;

/// Serves a key with what decoding says.
async fn decoding_service(site: &Site) -> bus::Serving {
    let handler = |incoming: Incoming| match incoming.request() {
        Ok(_) => incoming.reply(&Reply::Done),
        Err(error) => incoming.refuse(error),
    };
    site.service.serve(&keys::any_world(0), handler).await.unwrap()
}

fn key() -> String {
    keys::world(&tenant(), WorldId::new(1).unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn bytes_that_are_no_request_are_refused_with_a_reason() {
    let site = Site::open().await;
    let _serving = decoding_service(&site).await;
    let good = schemas::wire::encode_request(&Request::ListMaps);
    let mut wrong_identifier = good.clone();
    wrong_identifier[4..8].copy_from_slice(b"XXXX");
    let mut torn = good.clone();
    torn.truncate(good.len() / 2);
    let mut pointing_outside = good.clone();
    pointing_outside[0..4].copy_from_slice(&u32::MAX.to_le_bytes());
    for (what, bytes) in [
        ("nothing", Vec::new()),
        ("one byte", vec![0]),
        ("text", b"{\"jsonrpc\": \"2.0\"}".to_vec()),
        ("another identifier", wrong_identifier),
        ("half a message", torn),
        ("an offset outside", pointing_outside),
        ("10 MB of zeros", vec![0; 10_000_000]),
    ] {
        let error = site.client.request_bytes(&key(), bytes, deadline()).await.unwrap_err();
        assert_eq!(error.code, ErrorCode::InvalidMessage, "{what}: {error}");
    }
    let good = site.client.request_bytes(&key(), good, deadline()).await;
    assert_eq!(good, Ok(Reply::Done));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reply_that_is_no_reply_is_an_error_at_the_asker() {
    let site = Site::open().await;
    let _serving = site
        .service
        .serve(&keys::any_world(0), |incoming| incoming.reply_bytes(vec![7; 100]))
        .await
        .unwrap();
    let error = site.client.request(&key(), &Request::ListMaps, deadline()).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::InvalidMessage, "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_message_over_the_transports_limit_harms_nobody_else() {
    let site = Site::open().await;
    let _serving = decoding_service(&site).await;
    let stranger = zenoh_stranger(&site).await;
    let huge = vec![0; 200 * 1024 * 1024];
    let short = std::time::Duration::from_secs(5);
    let asked = stranger.get(key()).payload(huge).timeout(short).await.unwrap();
    let honest = site.client.request(&key(), &Request::ListMaps, deadline()).await;
    assert_eq!(honest, Ok(Reply::Done));
    let answer = asked.recv_async().await;
    assert!(answer.map_or(true, |reply| reply.result().is_err()), "200 MiB were answered");
    let honest = site.client.request(&key(), &Request::ListMaps, deadline()).await;
    assert_eq!(honest, Ok(Reply::Done));
}

#[tokio::test(flavor = "multi_thread")]
async fn of_answers_without_end_only_so_many_are_taken() {
    let site = Site::open().await;
    let stranger = zenoh_stranger(&site).await;
    let done = schemas::wire::encode_reply(&Reply::Done);
    let answer = move |query: zenoh::query::Query| {
        for _ in 0..5_000 {
            // Who asked may have heard enough.
            let _ = query.reply(query.key_expr().clone(), done.clone()).wait();
        }
    };
    let _answering = stranger.declare_queryable(key()).callback(answer).await.unwrap();
    let (key, list) = (key(), Request::ListWorlds);
    let ask = || site.client.request_every(&key, &list, deadline());
    until("an answer", || async { ask().await.is_ok() }).await;
    assert_eq!(ask().await.unwrap().len(), 1_024);
}

/// Somebody who uses plain Zenoh with its defaults.
async fn zenoh_stranger(site: &Site) -> zenoh::Session {
    let mut config = zenoh::Config::default();
    let endpoints = format!("[\"{}\"]", site.service.listening()[0]);
    config.insert_json5("mode", "\"client\"").unwrap();
    config.insert_json5("connect/endpoints", &endpoints).unwrap();
    zenoh::open(config).await.unwrap()
}
