//! Two tenants at one face, and who has no token.

use std::path::PathBuf;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use tenancy::Secret;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::tungstenite::http::Request;

use super::*;

/// A face for alice, who may have two sessions, and bob; removes its file at its end.
struct Site {
    folder: PathBuf,
    address: SocketAddr,
    alice: String,
    bob: String,
}

impl Site {
    async fn start(name: &str, more: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("causeway-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("tokens.toml");
        let mut text = format!("[tenant.alice]\nsessions_max = 2\n{more}\n[tenant.bob]\n");
        let [alice, bob] = ["alice", "bob"].map(|tenant| {
            let secret = Secret::new(format!("{tenant}-1").parse().unwrap()).unwrap();
            let sha256 = secret.sha256();
            text += "[[token]]\n";
            text += &format!("id = \"{tenant}-1\"\ntenant = {tenant:?}\nsha256 = {sha256:?}\n");
            secret.token()
        });
        std::fs::write(&path, text).unwrap();
        let door = Door::with_tokens(&path).unwrap();
        let (_port, address) = serve_behind(door, 8, Mode::Simulation).await;
        Self { folder, address, alice, bob }
    }

    /// A connection with a header; the status if it is refused.
    async fn connect(&self, query: &str, name: &'static str, value: &str) -> Result<Socket, u16> {
        let url = format!("ws://{}/ws{query}", self.address);
        let mut request: Request<()> = url.into_client_request().unwrap();
        request.headers_mut().insert(name, value.parse().unwrap());
        match connect_async(request).await {
            Ok((socket, _)) => Ok(socket),
            Err(tokio_tungstenite::tungstenite::Error::Http(refused)) => {
                Err(refused.status().as_u16())
            }
            Err(other) => panic!("{other}"),
        }
    }

    async fn as_bearer(&self, query: &str, token: &str) -> Result<Socket, u16> {
        self.connect(query, "authorization", &format!("Bearer {token}")).await
    }

    /// Status and body of a request of somebody.
    async fn post(&self, path: &str, token: &str, body: &str) -> (u16, Value) {
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        let request = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\nauthorization: bearer {token}\
             \r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        (status, serde_json::from_str(body).unwrap())
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[tokio::test]
async fn a_token_opens_the_face_in_every_way_that_clients_have() {
    let site = Site::start("ways", "").await;
    let basic = format!("Basic {}", STANDARD.encode(format!("anybody:{}", site.alice)));
    let bearer = format!("Bearer {}", site.bob);
    let protocols = format!("causeway.v1, bearer.{}", site.bob);
    for (name, value) in [
        ("authorization", &basic),
        ("authorization", &bearer),
        ("sec-websocket-protocol", &protocols),
    ] {
        let mut socket = site.connect("", name, value).await.unwrap();
        assert_eq!(ask(&mut socket, json!({"type": "state"})).await["type"], "state", "{value}");
    }
}

#[tokio::test]
async fn who_has_no_token_reaches_what_says_nothing_of_worlds() {
    let site = Site::start("public", "").await;
    for path in ["/", "/health", "/metadata", "/schema", "/openapi.json", "/docs", "/redoc"] {
        assert_eq!(http(site.address, "GET", path, None).await.0, 200, "{path}");
    }
    for (method, path) in [
        ("GET", "/ws"),
        ("GET", "/web"),
        ("GET", "/metrics"),
        ("GET", "/state"),
        ("POST", "/reset"),
        ("POST", "/step"),
        ("POST", "/mcp"),
        ("GET", "/list_environments"),
        ("GET", "/nowhere"),
    ] {
        let (status, head, body) = http(site.address, method, path, Some("{}")).await;
        assert_eq!(status, 401, "{path}");
        assert!(head.contains("www-authenticate: basic"), "{head}");
        assert!(body.contains("wants a token"), "{body}");
    }
    let wrong = site.alice.replace("alice", "mallory");
    assert_eq!(site.as_bearer("", &wrong).await.err(), Some(401));
}

#[tokio::test]
async fn who_guesses_is_told_to_wait() {
    let site = Site::start("guess", "").await;
    let mut statuses = Vec::new();
    for _ in 0..100 {
        statuses.push(site.post("/reset", "cw_alice-1_guess", "{}").await.0);
    }
    assert!(statuses.contains(&429), "{statuses:?}");
    assert_eq!(statuses[0], 401);
}

#[tokio::test]
async fn no_tenant_sees_sessions_of_another() {
    let site = Site::start("apart", "").await;
    let create = r#"{"jsonrpc": "2.0", "id": 1, "method": "openenv/session/create"}"#;
    let (_, created) = site.post("/mcp", &site.alice, create).await;
    let id = created["result"]["session_id"].as_str().unwrap().to_owned();
    let reset = json!({ "session_id": id, "seed": 7 }).to_string();
    assert_eq!(site.post("/reset", &site.alice, &reset).await.0, 200);

    assert_eq!(site.post("/reset", &site.bob, &reset).await.0, 404);
    let close = json!({ "jsonrpc": "2.0", "id": 1, "method": "openenv/session/close",
        "params": { "session_id": id } });
    let (_, closed) = site.post("/mcp", &site.bob, &close.to_string()).await;
    assert_eq!(closed["error"]["message"], format!("Unknown session_id: {id}"));
    let mut socket = site.as_bearer(&format!("?session_id={id}"), &site.bob).await.unwrap();
    assert_eq!(receive(&mut socket).await["data"]["code"], "SESSION_ERROR");

    let mut socket = site.as_bearer(&format!("?session_id={id}"), &site.alice).await.unwrap();
    assert_eq!(ask(&mut socket, json!({"type": "state"})).await["type"], "state");
}

#[tokio::test]
async fn a_tenant_has_no_more_sessions_than_it_may_and_others_theirs() {
    let site = Site::start("quota", "").await;
    let mut held = Vec::new();
    for _ in 0..2 {
        let mut socket = site.as_bearer("", &site.alice).await.unwrap();
        assert_eq!(ask(&mut socket, json!({"type": "state"})).await["type"], "state");
        held.push(socket);
    }
    let mut third = site.as_bearer("", &site.alice).await.unwrap();
    let refused = receive(&mut third).await["data"].take();
    assert_eq!(
        (&refused["code"], &refused["max_sessions"]),
        (&json!("CAPACITY_REACHED"), &json!(2))
    );
    assert!(refused["message"].as_str().unwrap().contains("quota sessions_max"), "{refused}");
    let mut other = site.as_bearer("", &site.bob).await.unwrap();
    assert_eq!(ask(&mut other, json!({"type": "state"})).await["type"], "state");
}

#[tokio::test]
async fn pictures_beyond_the_quota_are_refused_with_the_reason() {
    let site = Site::start("pixels", "pixels_per_second = 1").await;
    let mut socket = site.as_bearer("", &site.alice).await.unwrap();
    ask(&mut socket, json!({ "type": "reset", "data": { "seed": 7 } })).await;
    let look = json!({ "type": "step", "data": { "action_type": "capture_image" } });
    let wanted = "the quota pixels_per_second = 1 is used up";
    let first = ask(&mut socket, look.clone()).await;
    assert!(!first.to_string().contains("quota"), "{first}");
    // A machine that stops for two seconds has room for another one.
    for _ in 0..100 {
        if ask(&mut socket, look.clone()).await.to_string().contains(wanted) {
            return;
        }
    }
    panic!("no picture of a hundred was beyond the quota");
}
