//! The face over real sockets, with toy worlds behind it.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

use super::*;
use crate::listener::FaceListener;
use crate::openenv;
use crate::session::table::IdleTimes;
use crate::testing::{self, ToyWorlds};

mod snapshots;
mod strangers;
mod tokens;
mod web;

const DEADLINE: Duration = Duration::from_secs(20);

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

async fn serve(max: u32, mode: Mode) -> (Arc<ToyWorlds>, SocketAddr) {
    serve_behind(Door::open(testing::visitor().tenant), max, mode).await
}

async fn serve_behind(door: Door, max: u32, mode: Mode) -> (Arc<ToyWorlds>, SocketAddr) {
    serve_within(Bounds::for_sessions(max), door, max, mode).await
}

async fn serve_within(
    bounds: Bounds,
    door: Door,
    max: u32,
    mode: Mode,
) -> (Arc<ToyWorlds>, SocketAddr) {
    serve_with(bounds, door, (max, true), mode).await
}

/// With so many sessions, and with the web interface or without it.
async fn serve_with(
    bounds: Bounds,
    door: Door,
    (max, has_web): (u32, bool),
    mode: Mode,
) -> (Arc<ToyWorlds>, SocketAddr) {
    let (port, context) = testing::context();
    let idle = IdleTimes { connected: DEADLINE, detached: DEADLINE };
    let sessions = testing::sessions(&context, max, idle);
    let listener = FaceListener::open("127.0.0.1:0".parse().unwrap()).await.unwrap();
    let address = listener.address();
    let origins = OriginRule { is_loopback: true, is_open: true, allowed: Vec::new() };
    let web = has_web.then(WebSessions::default);
    let face = Arc::new(Face { sessions, mode, web, door: Arc::new(door), origins });
    tokio::spawn(async move { openenv::serve(listener, face, bounds).await });
    (port, address)
}

async fn connect(address: SocketAddr, query: &str) -> Socket {
    connect_async(format!("ws://{address}/ws{query}")).await.unwrap().0
}

async fn receive(socket: &mut Socket) -> Value {
    let message = tokio::time::timeout(DEADLINE, socket.next()).await.unwrap().unwrap().unwrap();
    serde_json::from_str(message.to_text().unwrap()).unwrap()
}

async fn ask(socket: &mut Socket, message: Value) -> Value {
    socket.send(Message::text(message.to_string())).await.unwrap();
    receive(socket).await
}

/// Status, headers in lower case, and body of one HTTP request.
async fn http(
    address: SocketAddr,
    method: &str,
    path: &str,
    body: Option<&str>,
) -> (u16, String, String) {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let body = match body {
        Some(body) => {
            format!(
                "content-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
                body.len()
            )
        }
        None => "\r\n".to_owned(),
    };
    let request =
        format!("{method} {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n{body}");
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = String::new();
    tokio::time::timeout(DEADLINE, stream.read_to_string(&mut answer)).await.unwrap().unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    (status, head.to_lowercase(), body.to_owned())
}

async fn json_of(
    address: SocketAddr,
    method: &str,
    path: &str,
    body: Option<&str>,
) -> (u16, Value) {
    let (status, _, body) = http(address, method, path, body).await;
    (status, serde_json::from_str(&body).unwrap_or(Value::Null))
}

async fn until_no_worlds(port: &ToyWorlds) {
    let gone = async {
        while port.count() > 0 {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    };
    tokio::time::timeout(DEADLINE, gone).await.expect("worlds are left over");
}

#[tokio::test]
async fn an_episode_runs_over_a_websocket_and_ends_with_a_normal_close() {
    let (port, address) = serve(4, Mode::Simulation).await;
    let mut socket = connect(address, "").await;
    let begun = ask(&mut socket, json!({ "type": "reset", "data": { "seed": 7 } })).await;
    assert_eq!(begun["type"], "observation");
    assert_eq!((&begun["data"]["done"], &begun["data"]["reward"]), (&json!(false), &Value::Null));
    let side = begun["data"]["metadata"]["info"]["side_directions"][0].clone();
    let step = json!({ "type": "step", "data": { "action_type": "lane_change",
        "lane_direction": side, "metadata": {}, "throttle": 0.0, "route_steps": 1 } });
    let stepped = ask(&mut socket, step).await;
    let data = &stepped["data"];
    assert_eq!((&data["done"], &data["reward"]), (&json!(true), &json!(1.0)));
    for member in ["done", "reward", "metadata"] {
        assert_eq!(data["observation"][member], data[member], "{member}");
    }
    let state = ask(&mut socket, json!({ "type": "state" })).await;
    assert_eq!((&state["type"], &state["data"]["step_count"]), (&json!("state"), &json!(1)));
    socket.send(Message::text(r#"{"type":"close"}"#)).await.unwrap();
    match socket.next().await {
        Some(Ok(Message::Close(Some(frame)))) => assert_eq!(u16::from(frame.code), 1000),
        other => panic!("{other:?}"),
    }
    until_no_worlds(&port).await;
}

#[tokio::test]
async fn pipelined_messages_are_answered_in_order() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let mut socket = connect(address, "").await;
    socket.send(Message::text(r#"{"type":"reset"}"#)).await.unwrap();
    for _ in 0..20 {
        socket.send(Message::text(r#"{"type":"step","data":{}}"#)).await.unwrap();
    }
    for step_number in 0..=20 {
        assert_eq!(receive(&mut socket).await["data"]["observation"]["step_number"], step_number);
    }
}

#[tokio::test]
async fn the_session_survives_whatever_it_is_sent() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let mut socket = connect(address, "").await;
    ask(&mut socket, json!({ "type": "reset" })).await;
    let large = "x".repeat(10 * 1024 * 1024);
    let long_but_legal = format!(
        r#"{{"type":"step","data":{{"metadata":{{"note":"{}"}}}}}}"#,
        "x".repeat(1024 * 1024)
    );
    for (message, code) in [
        (Message::text("nope"), "INVALID_JSON"),
        (Message::text("[1]"), "INVALID_JSON"),
        (Message::text(large), "INVALID_JSON"),
        (Message::binary(vec![0xFF, 0xFE]), "INVALID_JSON"),
        (Message::text("{}"), "UNKNOWN_TYPE"),
        (Message::text(r#"{"type":"step"}"#), "VALIDATION_ERROR"),
        (Message::text(r#"{"type":"step","data":{"throttle":NaN}}"#), "VALIDATION_ERROR"),
        (Message::text(r#"{"type":"reset","data":{"scenario_name":"nope"}}"#), "EXECUTION_ERROR"),
    ] {
        socket.send(message).await.unwrap();
        let answer = receive(&mut socket).await;
        assert_eq!((&answer["type"], &answer["data"]["code"]), (&json!("error"), &json!(code)));
    }
    socket.send(Message::Ping(vec![1].into())).await.unwrap();
    assert!(matches!(socket.next().await, Some(Ok(Message::Pong(_)))));
    socket.send(Message::text(long_but_legal)).await.unwrap();
    assert_eq!(receive(&mut socket).await["data"]["observation"]["step_number"], 1);
    socket.send(Message::binary(r#"{"type":"step","data":{}}"#)).await.unwrap();
    assert_eq!(receive(&mut socket).await["data"]["observation"]["step_number"], 2);
}

#[tokio::test]
async fn one_connection_too_many_is_told_so_and_a_place_is_free_again_after_a_disconnect() {
    let (port, address) = serve(2, Mode::Simulation).await;
    let mut first = connect(address, "").await;
    ask(&mut first, json!({ "type": "reset" })).await;
    let mut second = connect(address, "").await;
    ask(&mut second, json!({ "type": "reset" })).await;
    let mut third = connect(address, "").await;
    assert_eq!(
        receive(&mut third).await,
        json!({ "type": "error", "data": {
            "message": "Server at capacity: 2/2 sessions active. Cannot accept new connections.",
            "code": "CAPACITY_REACHED", "active_sessions": 2, "max_sessions": 2 } })
    );
    assert!(matches!(third.next().await, Some(Ok(Message::Close(_)))));
    drop((first, second));
    until_no_worlds(&port).await;
    let mut fourth = connect(address, "").await;
    assert_eq!(ask(&mut fourth, json!({ "type": "reset" })).await["type"], "observation");
}

#[tokio::test]
async fn sessions_are_isolated() {
    let (_, address) = serve(8, Mode::Simulation).await;
    let play = |seed: u64| async move {
        let mut socket = connect(address, "").await;
        ask(&mut socket, json!({ "type": "reset", "data": { "seed": seed } })).await;
        let mut seen = Vec::new();
        for _ in 0..30 {
            let answer = ask(&mut socket, json!({ "type": "step", "data": {} })).await;
            seen.push(answer["data"]["observation"].clone());
        }
        seen
    };
    let alone = play(5).await;
    let (together, _, _) = tokio::join!(play(5), play(6), play(7));
    assert_eq!(alone, together);
}

#[tokio::test]
async fn fixed_pages_and_documents_are_there() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let (status, health) = json_of(address, "GET", "/health", None).await;
    assert_eq!((status, health), (200, json!({ "status": "healthy" })));
    let (_, api) = json_of(address, "GET", "/openapi.json", None).await;
    assert!(api["info"]["version"].as_str().unwrap().starts_with("1."));
    for path in ["/reset", "/step", "/state", "/metadata", "/health", "/schema", "/mcp"] {
        assert!(api["paths"].get(path).is_some(), "{path}");
    }
    let forget = &api["paths"]["/snapshots/{id}"]["delete"];
    assert_eq!(forget["parameters"][0]["name"], "id");
    assert!(forget["responses"].get("204").is_some() && forget["responses"].get("200").is_none());
    let (_, schema) = json_of(address, "GET", "/schema", None).await;
    for part in ["action", "observation"] {
        assert_eq!(schema[part]["additionalProperties"], false);
    }
    for page in ["/", "/docs", "/redoc"] {
        let (status, head, body) = http(address, "GET", page, None).await;
        assert_eq!(status, 200);
        assert!(head.contains("content-type: text/html"));
        assert!(!body.contains("http://") && !body.contains("https://"), "{page} loads from afar");
    }
    let not_found = json!({ "detail": "Not Found" });
    assert_eq!(json_of(address, "GET", "/nope", None).await, (404, not_found.clone()));
    assert_eq!(json_of(address, "GET", "/ws", None).await, (404, not_found));
    let (status, head, _) = http(address, "OPTIONS", "/health", None).await;
    assert_eq!(status, 405);
    assert!(head.contains("\r\nallow: "));
    assert_eq!(http(address, "HEAD", "/health", None).await.0, 405);
}

#[tokio::test]
async fn every_member_of_messages_is_in_its_schema() {
    let (_, address) = serve(4, Mode::Simulation).await;
    let (_, schema) = json_of(address, "GET", "/schema", None).await;
    let mut socket = connect(address, "").await;
    let observed = ask(&mut socket, json!({ "type": "step", "data": {} })).await;
    let state = ask(&mut socket, json!({ "type": "state" })).await;
    let names = |value: &Value| -> std::collections::BTreeSet<String> {
        value.as_object().unwrap().keys().cloned().collect()
    };
    let observation = names(&schema["observation"]["properties"]);
    assert_eq!(names(&observed["data"]["observation"]), observation);
    assert!(names(&state["data"]).is_superset(&names(&schema["state"]["properties"])));
}

#[tokio::test]
async fn http_episodes_are_stateless_unless_a_session_is_asked_for() {
    let (port, address) = serve(4, Mode::Simulation).await;
    let step = r#"{"action":{}}"#;
    for _ in 0..2 {
        let (status, stepped) = json_of(address, "POST", "/step", Some(step)).await;
        assert_eq!((status, &stepped["observation"]["step_number"]), (200, &json!(1)));
    }
    until_no_worlds(&port).await;
    let (_, head, body) =
        http(address, "POST", "/reset", Some(r#"{"session_id":"","seed":3}"#)).await;
    let body: Value = serde_json::from_str(&body).unwrap();
    let id = body["metadata"]["session_id"].as_str().unwrap();
    assert!(head.contains(&format!("x-session-id: {id}")));
    let step = json!({ "action": {}, "session_id": id }).to_string();
    for number in 1..=2 {
        let (_, stepped) = json_of(address, "POST", "/step", Some(&step)).await;
        assert_eq!(stepped["observation"]["step_number"], number);
    }
    let (_, state) = json_of(address, "GET", &format!("/state?session_id={id}"), None).await;
    assert_eq!((&state["step_count"], &state["seed"]), (&json!(2), &json!(3)));
    let (_, state) = json_of(address, "GET", "/state", None).await;
    assert_eq!(state, json!({ "episode_id": null, "step_count": 0 }));
}

#[tokio::test]
async fn http_errors_have_the_reference_shapes() {
    let (_, address) = serve(4, Mode::Simulation).await;
    for (path, body, kind, loc) in [
        ("/step", "nope", "json_invalid", json!(["body", 0])),
        ("/step", "{}", "missing", json!(["body", "action"])),
        ("/step", "", "missing", json!(["body"])),
        ("/reset", r#"{"seed":-1}"#, "greater_than_equal", json!(["body", "seed"])),
        ("/step", r#"{"action":{},"timeout_s":0}"#, "greater_than", json!(["body", "timeout_s"])),
        ("/step", r#"{"action":{"throttle":2}}"#, "less_than_equal", json!(["throttle"])),
        ("/reset", "[1]", "model_attributes_type", json!(["body"])),
    ] {
        let (status, answer) = json_of(address, "POST", path, Some(body)).await;
        let error = &answer["detail"][0];
        assert_eq!((status, &error["type"], &error["loc"]), (422, &json!(kind), &loc), "{body}");
    }
    let unknown = r#"{"scenario_name":"nope"}"#;
    assert_eq!(
        json_of(address, "POST", "/reset", Some(unknown)).await,
        (400, json!({ "detail": "Unknown scenario: nope" }))
    );
}

#[tokio::test]
async fn production_has_no_http_episodes() {
    let (_, address) = serve(4, Mode::Production).await;
    let (_, api) = json_of(address, "GET", "/openapi.json", None).await;
    for path in ["/reset", "/step", "/state"] {
        assert_eq!(json_of(address, "POST", path, Some("{}")).await.0, 404);
        assert!(api["paths"].get(path).is_none());
    }
    let mut socket = connect(address, "").await;
    assert_eq!(ask(&mut socket, json!({ "type": "reset" })).await["type"], "observation");
}

#[tokio::test]
async fn json_rpc_answers_as_the_table_says() {
    let (_, address) = serve(1, Mode::Simulation).await;
    let rpc = |body: Value| async move {
        json_of(address, "POST", "/mcp", Some(&body.to_string())).await
    };
    let (status, parse) = json_of(address, "POST", "/mcp", Some("nope")).await;
    assert_eq!(
        (status, &parse["error"]["code"], &parse["jsonrpc"]),
        (200, &json!(-32700), &json!("2.0"))
    );
    assert_eq!(rpc(json!([])).await.1["error"]["message"], "Parse error");
    let empty = rpc(json!({})).await.1;
    assert_eq!(empty["error"]["code"], -32600);
    assert!(empty["error"]["message"].as_str().unwrap().starts_with("Invalid request: "));
    let call = |method: &str, params: Value| {
        rpc(json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params }))
    };
    for (method, params, code, message) in [
        ("fly", json!({}), -32601, "Method not found: fly"),
        ("tools/list", json!({}), -32603, "Environment does not support MCP"),
        ("fly", json!({ "session_id": "x" }), -32602, "Unknown session_id: x"),
        ("openenv/session/close", json!({ "session_id": "x" }), -32602, "Unknown session_id: x"),
        ("openenv/session/close", json!({}), -32602, "Invalid params - 'session_id' is required"),
    ] {
        let answer = call(method, params).await.1;
        assert_eq!(
            (&answer["error"]["code"], &answer["error"]["message"]),
            (&json!(code), &json!(message))
        );
    }
    let id = call("openenv/session/create", json!({})).await.1["result"]["session_id"].clone();
    let full = call("openenv/session/create", json!({})).await.1;
    assert_eq!(full["error"]["code"], -32000);
    assert_eq!(full["error"]["data"], json!({ "active_sessions": 1, "max_sessions": 1 }));
    let mut socket = connect(address, &format!("?session_id={}", id.as_str().unwrap())).await;
    assert_eq!(ask(&mut socket, json!({ "type": "reset" })).await["type"], "observation");
    let mut twice = connect(address, &format!("?session_id={}", id.as_str().unwrap())).await;
    assert_eq!(receive(&mut twice).await["data"]["code"], "SESSION_ERROR");
    drop(socket);
    let closed = async {
        loop {
            let answer = call("openenv/session/close", json!({ "session_id": id })).await.1;
            if answer["result"]["closed"] == true || answer.get("error").is_some() {
                return answer;
            }
        }
    };
    tokio::time::timeout(DEADLINE, closed).await.unwrap();
}
