//! Clients that mean no good: pages of others, who sends without reading, and who says nothing or
//! half of it.

use super::*;
use crate::limits::{LARGE_BYTES, LARGE_MAX};

/// Far longer than it takes, and far shorter than anybody who is silent may be.
const SOON: Duration = Duration::from_secs(5);
const SHORT: Duration = Duration::from_millis(200);

/// A raw WebSocket that has been upgraded.
async fn upgraded(address: SocketAddr, origin: &str) -> (TcpStream, String) {
    upgraded_at("/ws", address, origin).await
}

async fn upgraded_at(path: &str, address: SocketAddr, origin: &str) -> (TcpStream, String) {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let request = format!(
        "GET {path} HTTP/1.1\r\nhost: {address}\r\nconnection: upgrade\r\nupgrade: websocket\r\n\
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
        for path in ["/ws", "/mcp"] {
            let (_stream, answer) = upgraded_at(path, address, origin).await;
            assert!(answer.starts_with(status), "{path}, {origin:?}: {answer}");
        }
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

#[tokio::test(flavor = "multi_thread")]
async fn a_page_whose_name_was_made_to_lead_here_reads_nothing() {
    let (_port, address) = serve(4, Mode::Simulation).await;
    for (host, status) in [("evil.example:8000", "HTTP/1.1 403"), ("localhost:1", "HTTP/1.1 200")] {
        let mut stream = TcpStream::connect(address).await.unwrap();
        let request = format!("GET /health HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        assert!(answer.starts_with(status), "{host}: {answer}");
    }
}

async fn within(bounds: impl FnOnce(&mut Bounds)) -> SocketAddr {
    let mut all = Bounds::for_sessions(8);
    bounds(&mut all);
    serve_within(all, Door::open(testing::visitor().tenant), 8, Mode::Simulation).await.1
}

/// What comes back to the end of a connection, which the other side makes.
async fn rest(mut stream: TcpStream) -> String {
    let mut answer = Vec::new();
    // A connection that was cut off has said what it had to say.
    let _ = tokio::time::timeout(SOON, stream.read_to_end(&mut answer)).await.expect("it lasts");
    String::from_utf8_lossy(&answer).into_owned()
}

/// A masked text frame of so many bytes, of which so many have come.
fn frame(bytes: usize, come: usize) -> Vec<u8> {
    let mut frame = vec![0x81, 0x80 | 127];
    frame.extend_from_slice(&(bytes as u64).to_be_bytes());
    frame.extend_from_slice(&[0; 4]);
    frame.resize(frame.len() + come, b'x');
    frame
}

/// Whether all is taken in time.
async fn is_taken(stream: &mut TcpStream, bytes: &[u8], within: Duration) -> bool {
    tokio::time::timeout(within, stream.write_all(bytes)).await.is_ok_and(|sent| sent.is_ok())
}

#[tokio::test(flavor = "multi_thread")]
async fn who_says_nothing_or_half_of_it_keeps_nobody_out() {
    let address = within(|_| ()).await;
    let half_head = b"POST /step HTTP/1.1\r\nhost: localhost\r\n";
    let half_body = "content-type: application/json\r\ncontent-length: 2000000\r\n\r\n{";
    let mut strangers = Vec::new();
    for number in 0..300 {
        let mut stream = TcpStream::connect(address).await.unwrap();
        if number % 3 > 0 {
            stream.write_all(half_head).await.unwrap();
        }
        if number < 100 && number % 3 == 2 {
            stream.write_all(half_body.as_bytes()).await.unwrap();
        }
        strangers.push(stream);
    }
    for _ in 0..LARGE_MAX {
        let (mut stream, _) = upgraded(address, "").await;
        stream.write_all(&frame(1_000_000, LARGE_BYTES / 2)).await.unwrap();
        strangers.push(stream);
    }
    let served = async {
        let mut client = connect(address, "").await;
        ask(&mut client, json!({"type": "reset"})).await["type"].clone()
    };
    assert_eq!(tokio::time::timeout(SOON, served).await.unwrap(), "observation");
    drop(strangers);
}

#[tokio::test(flavor = "multi_thread")]
async fn large_messages_come_one_after_the_other_and_those_that_do_not_come_are_given_up() {
    /// More than the buffers of both systems hold.
    const BYTES: usize = 15 << 20;
    let address = within(|bounds| bounds.large = 10 * SHORT).await;
    let mut halves = Vec::new();
    for _ in 0..LARGE_MAX {
        let (mut stream, _) = upgraded(address, "").await;
        assert!(is_taken(&mut stream, &frame(BYTES, 2 * LARGE_BYTES), SOON).await);
        halves.push(stream);
    }
    let (mut stream, _) = upgraded(address, "").await;
    let large = frame(BYTES, BYTES);
    assert!(!is_taken(&mut stream, &large, SHORT).await, "more come than have places");
    for half in halves {
        rest(half).await;
    }
    let mut client = connect(address, "").await;
    client.send(Message::text("x".repeat(BYTES))).await.unwrap();
    assert_eq!(receive(&mut client).await["data"]["code"], "INVALID_JSON");
    assert_eq!(ask(&mut client, json!({"type": "reset"})).await["type"], "observation");
}

#[tokio::test(flavor = "multi_thread")]
async fn pings_count_for_nothing_and_in_the_middle_of_a_message_hide_nothing() {
    let address = within(|bounds| bounds.large = SHORT).await;
    let (mut stream, _) = upgraded(address, "").await;
    let ping = [&[0x89, 0x80 | 125, 0, 0, 0, 0][..], &[7; 125]].concat();
    let mut pongs = vec![0; 127];
    for _ in 0..2 * LARGE_BYTES / ping.len() {
        stream.write_all(&ping).await.unwrap();
        stream.read_exact(&mut pongs).await.unwrap();
    }
    tokio::time::sleep(2 * SHORT).await;
    stream.write_all(&ping).await.unwrap();
    stream.read_exact(&mut pongs).await.unwrap();
    // Parts of a message, none of them the last, with a ping after each.
    let part = |opcode: u8| [&[opcode, 0x80 | 100, 0, 0, 0, 0][..], &[b'x'; 100], &ping].concat();
    stream.write_all(&part(0x01)).await.unwrap();
    for _ in 0..2 * LARGE_BYTES / 100 {
        if stream.write_all(&part(0x00)).await.is_err() {
            break;
        }
    }
    rest(stream).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_is_silent_or_half_done_for_too_long_is_cut_off() {
    let address = within(|bounds| (bounds.head, bounds.body) = (SHORT, SHORT)).await;
    let begun = b"POST /step HTTP/1.1\r\nhost: localhost\r\n";
    let asked = b"GET /health HTTP/1.1\r\nhost: localhost\r\n\r\n";
    for (sent, answer) in [(&b""[..], ""), (&begun[..], ""), (&asked[..], "HTTP/1.1 200")] {
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(sent).await.unwrap();
        assert!(rest(stream).await.starts_with(answer));
    }
    let mut stream = TcpStream::connect(address).await.unwrap();
    let half = [&begun[..], b"content-length: 9\r\n\r\n{"].concat();
    stream.write_all(&half).await.unwrap();
    let answer = rest(stream).await;
    assert!(answer.starts_with("HTTP/1.1 408"), "{answer}");
    assert!(answer.contains("A body must come within 0.2 s"), "{answer}");
}

#[tokio::test(flavor = "multi_thread")]
async fn who_takes_nothing_for_too_long_is_cut_off() {
    let address = within(|bounds| bounds.write = SHORT).await;
    let (mut stream, _) = upgraded(address, "").await;
    let pings = [&[0x89, 0x80 | 125, 0, 0, 0, 0][..], &[7; 125]].concat().repeat(1_000);
    let flood = async { while stream.write_all(&pings).await.is_ok() {} };
    tokio::time::timeout(DEADLINE, flood).await.expect("it is still connected");
}
