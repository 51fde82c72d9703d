//! Clients that mean no good: pages of others, and who sends without reading.

use super::*;

/// A raw WebSocket that has been upgraded.
async fn upgraded(address: SocketAddr, origin: &str) -> (TcpStream, String) {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let request = format!(
        "GET /ws HTTP/1.1\r\nhost: {address}\r\nconnection: upgrade\r\nupgrade: websocket\r\n\
         sec-websocket-version: 13\r\nsec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n{origin}\r\n"
    );
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = vec![0; 1_024];
    let count = stream.read(&mut answer).await.unwrap();
    (stream, String::from_utf8_lossy(&answer[..count]).into_owned())
}

#[tokio::test(flavor = "multi_thread")]
async fn who_pings_on_without_reading_is_not_listened_to() {
    /// More than the buffers of both systems hold, and what a service may keep for one client.
    const BYTES_MAX: usize = 48 << 20;
    let (_port, address) = serve(4, Mode::Simulation).await;
    let (mut stream, answer) = upgraded(address, "").await;
    assert!(answer.starts_with("HTTP/1.1 101"), "{answer}");
    // A masked ping of 125 bytes, many times.
    let ping = [&[0x89, 0x80 | 125, 0, 0, 0, 0][..], &[7; 125]].concat();
    let pings = ping.repeat(1_000);
    let mut sent = 0;
    loop {
        let rest = &pings[sent % pings.len()..];
        let Ok(written) = tokio::time::timeout(Duration::from_secs(3), stream.write(rest)).await
        else {
            break;
        };
        sent += written.unwrap();
        assert!(sent < BYTES_MAX, "all is read, and every answer kept");
    }
    let mut neighbour = connect(address, "").await;
    assert_eq!(ask(&mut neighbour, json!({"type": "state"})).await["type"], "state");
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_others_reach_nothing_and_own_pages_everything() {
    let (_port, address) = serve(4, Mode::Simulation).await;
    let own = format!("origin: http://{address}\r\n");
    for (origin, status) in [
        ("", "HTTP/1.1 101"),
        (own.as_str(), "HTTP/1.1 101"),
        ("origin: https://evil.example\r\n", "HTTP/1.1 403"),
        ("origin: null\r\n", "HTTP/1.1 403"),
    ] {
        let (_stream, answer) = upgraded(address, origin).await;
        assert!(answer.starts_with(status), "{origin:?}: {answer}");
    }
    for path in ["/", "/web", "/health", "/mcp", "/reset", "/state", "/nowhere"] {
        let mut stream = TcpStream::connect(address).await.unwrap();
        let request = format!(
            "POST {path} HTTP/1.1\r\nhost: {address}\r\norigin: https://evil.example\r\n\
             content-length: 0\r\nconnection: close\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        assert!(answer.starts_with("HTTP/1.1 403"), "{path}: {answer}");
    }
}
