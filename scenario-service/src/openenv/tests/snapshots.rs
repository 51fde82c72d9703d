//! States of episodes over HTTP.

use std::sync::atomic::Ordering;

use super::*;

async fn post(address: SocketAddr, path: &str, body: Value) -> (u16, Value) {
    json_of(address, "POST", path, Some(&body.to_string())).await
}

/// A session with an episode, which only its id holds.
async fn begun(address: SocketAddr, config: Value) -> String {
    let reset = json!({ "session_id": "", "seed": 3, "scenario_config": config });
    let (_, begun) = post(address, "/reset", reset).await;
    begun["metadata"]["session_id"].as_str().unwrap().to_owned()
}

async fn step(address: SocketAddr, id: &str) -> Value {
    post(address, "/step", json!({ "action": {}, "session_id": id })).await.1
}

fn hash(step: &Value) -> Value {
    step["metadata"]["sim"]["state_hash"].clone()
}

#[tokio::test]
async fn a_state_is_kept_told_gone_back_to_and_given_up() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let id = begun(address, json!({})).await;
    let here = step(address, &id).await;
    let (status, kept) = post(address, "/snapshots", json!({ "session_id": id })).await;
    assert_eq!((status, &kept["state_hash"]), (200, &hash(&here)));
    let (_, told) = json_of(address, "GET", "/snapshots", None).await;
    assert_eq!(told["snapshots"][0]["snapshot_id"], kept["snapshot_id"]);
    let first = hash(&step(address, &id).await);
    let back = json!({ "session_id": id, "snapshot_id": kept["snapshot_id"] });
    let (_, again) = post(address, "/reset", back.clone()).await;
    assert_eq!(hash(&again), hash(&here));
    assert_eq!(hash(&step(address, &id).await), first);
    let path = format!("/snapshots/{}", kept["snapshot_id"].as_str().unwrap());
    assert_eq!(http(address, "DELETE", &path, None).await.0, 204);
    assert_eq!(http(address, "DELETE", &path, None).await.0, 404);
    assert_eq!(post(address, "/reset", back).await.0, 400);
}

#[tokio::test]
async fn a_fork_is_sessions_that_go_on_alike_or_none() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let id = begun(address, json!({})).await;
    let here = step(address, &id).await;
    let (status, forked) = post(address, "/fork", json!({ "session_id": id, "count": 2 })).await;
    assert_eq!((status, &forked["state_hash"]), (200, &hash(&here)));
    let wanted = hash(&step(address, &id).await);
    for branch in forked["session_ids"].as_array().unwrap() {
        assert_eq!(hash(&step(address, branch.as_str().unwrap()).await), wanted);
    }
    let (status, full) = post(address, "/fork", json!({ "session_id": id, "count": 2 })).await;
    assert_eq!((status, full["detail"].as_str().unwrap().contains("capacity")), (503, true));
    let (_, load) = json_of(address, "GET", "/metrics", None).await;
    assert_eq!(load["active_sessions"], 3, "those of a fork that failed are closed");
    let (_, told) = json_of(address, "GET", "/snapshots", None).await;
    assert_eq!(told["snapshots"], json!([]));
}

#[tokio::test]
async fn a_fork_whose_client_leaves_leaves_nothing_behind() {
    let (port, address) = serve(8, Mode::Simulation).await;
    let id = begun(address, json!({})).await;
    let active =
        || async { json_of(address, "GET", "/metrics", None).await.1["active_sessions"].clone() };
    port.is_slow_to_restore.store(true, Ordering::Relaxed);
    let mut client = TcpStream::connect(address).await.unwrap();
    let body = json!({ "session_id": id, "count": 2 }).to_string();
    let request = format!(
        "POST /fork HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
         content-length: {}\r\n\r\n{body}",
        body.len()
    );
    client.write_all(request.as_bytes()).await.unwrap();
    for (wanted, what) in [(2, "the first branch begins"), (1, "it is closed")] {
        let until = std::time::Instant::now() + DEADLINE;
        while active().await != wanted {
            assert!(std::time::Instant::now() < until, "{what}");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        client.shutdown().await.unwrap();
    }
}

#[tokio::test]
async fn a_fork_pushes_no_state_out() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let id = begun(address, json!({})).await;
    let session = json!({ "session_id": id });
    let (_, first) = post(address, "/snapshots", session.clone()).await;
    for _ in 1..crate::limits::SAVED_MAX {
        assert_eq!(post(address, "/snapshots", session.clone()).await.0, 200);
    }
    assert_eq!(post(address, "/fork", session).await.0, 200);
    let (_, told) = json_of(address, "GET", "/snapshots", None).await;
    assert_eq!(told["snapshots"].as_array().unwrap().len(), crate::limits::SAVED_MAX);
    assert_eq!(told["snapshots"][0]["snapshot_id"], first["snapshot_id"]);
}

#[tokio::test]
async fn what_cannot_be_kept_is_refused() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let sealed = begun(address, json!({ "sealed": true })).await;
    let (_, made) = post(
        address,
        "/mcp",
        json!({
            "jsonrpc": "2.0", "id": 1, "method": "openenv/session/create", "params": {},
        }),
    )
    .await;
    for (path, body, status, words) in [
        ("/snapshots", json!({ "session_id": sealed }), 400, "SEALED"),
        ("/fork", json!({ "session_id": sealed, "count": 2 }), 400, "SEALED"),
        ("/snapshots", json!({ "session_id": "nobody" }), 404, "Unknown session_id"),
        ("/snapshots", json!({}), 422, "missing"),
        ("/snapshots", made["result"].clone(), 400, "no episode yet"),
        ("/fork", json!({ "session_id": sealed, "count": 0 }), 422, "count"),
        ("/fork", json!({ "session_id": sealed, "count": 5_000 }), 422, "at most 1024"),
    ] {
        let (found, refused) = post(address, path, body).await;
        assert_eq!(found, status, "{path}: {refused}");
        assert!(refused["detail"].to_string().contains(words), "{refused}");
    }
    let (_, driven) = serve(4, Mode::Production).await;
    assert_eq!(http(driven, "GET", "/snapshots", None).await.0, 404);
}
