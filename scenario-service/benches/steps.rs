//! How fast are steps over WebSocket, for one client and for many at once?
//!
//! Drives a running service: `CAUSEWAY_URL=ws://127.0.0.1:8000/ws cargo bench -p scenario-service`.
//! The unit of work is one `observe` step and its reply. A bare loopback TCP echo of messages of
//! the same size is measured in the same run, so that results can be compared as ratios.
//!
//! All clients share one thread and write their frames by hand: on a small machine every cycle
//! they take is one that the service does not have.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

type Failure = Box<dyn std::error::Error>;

const STEP: &str = r#"{"type":"step","data":{"metadata":{},"action_type":"observe","throttle":0.0,"steer":0.0,"brake":0.0,"lane_direction":null,"target_speed_kmh":null,"brake_intensity":null,"target_lane_id":null,"navigation_behavior":"normal","destination_x":null,"destination_y":null,"destination_z":null,"route_steps":1}}"#;
const RESET: &str = r#"{"type":"reset","data":{"scenario_name":"trolley_saves","seed":1}}"#;
const OBSERVATION: &[u8] = br#"{"type":"observation""#;
const MEASURED: Duration = Duration::from_secs(5);
/// Size of a typical reply.
const REPLY_BYTES: usize = 2_500;

fn main() -> Result<(), Failure> {
    let Ok(url) = std::env::var("CAUSEWAY_URL") else {
        println!("CAUSEWAY_URL is not set: nothing to measure");
        return Ok(());
    };
    let address = url.strip_prefix("ws://").and_then(|rest| rest.strip_suffix("/ws"));
    let address = address.ok_or("CAUSEWAY_URL must be ws://HOST:PORT/ws")?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build()?;
    let local = tokio::task::LocalSet::new();
    local.block_on(&runtime, async {
        println!(
            "{:>8} {:>12} {:>10} {:>10} {:>10} {:>8}",
            "clients", "steps/s", "p50 us", "p99 us", "max us", "fewest"
        );
        for clients in [1, 8, 64, 256] {
            // Measured anew beside each row: a shared machine changes from minute to minute.
            let bare = percentile(&mut echo_micros()?, 50);
            measure(address, clients, bare).await?;
        }
        Ok(())
    })
}

async fn measure(address: &str, count: usize, bare_micros: f64) -> Result<(), Failure> {
    let mut clients = Vec::new();
    for _ in 0..count {
        let mut client = Client::connect(address).await?;
        client.ask(&frame(RESET)).await?;
        clients.push(client);
    }
    let begun = Instant::now();
    let tasks = clients.into_iter().map(|mut client| {
        tokio::task::spawn_local(async move {
            let step = frame(STEP);
            let mut micros = Vec::new();
            while begun.elapsed() < MEASURED {
                let sent = Instant::now();
                client.ask(&step).await?;
                micros.push(sent.elapsed().as_secs_f64() * 1e6);
            }
            Ok::<_, Failure>(micros)
        })
    });
    let mut micros = Vec::new();
    let mut fewest = usize::MAX;
    for task in tasks.collect::<Vec<_>>() {
        let of_one = task.await??;
        fewest = fewest.min(of_one.len());
        micros.extend(of_one);
    }
    let rate = micros.len() as f64 / begun.elapsed().as_secs_f64();
    let p50 = percentile(&mut micros, 50);
    let p99 = percentile(&mut micros, 99);
    let max = percentile(&mut micros, 100);
    println!(
        "{count:>8} {rate:>12.0} {p50:>10.0} {p99:>10.0} {max:>10.0} {fewest:>8}   p50 = {:.1} x bare ({bare_micros:.1} us)",
        p50 / bare_micros
    );
    Ok(())
}

/// A WebSocket client that knows just enough of RFC 6455: text frames of up to 64 KiB.
struct Client {
    stream: tokio::net::TcpStream,
    received: Vec<u8>,
}

impl Client {
    async fn connect(address: &str) -> Result<Self, Failure> {
        let mut stream = tokio::net::TcpStream::connect(address).await?;
        stream.set_nodelay(true)?;
        let upgrade = format!(
            "GET /ws HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        );
        stream.write_all(upgrade.as_bytes()).await?;
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            head.push(stream.read_u8().await?);
        }
        if !head.starts_with(b"HTTP/1.1 101") {
            return Err(String::from_utf8_lossy(&head).into_owned().into());
        }
        Ok(Self { stream, received: Vec::with_capacity(8 * 1024) })
    }

    /// Sends a frame and waits for the observation it brings.
    async fn ask(&mut self, frame: &[u8]) -> Result<(), Failure> {
        self.stream.write_all(frame).await?;
        self.received.clear();
        loop {
            if let Some(payload) = payload(&self.received) {
                if payload.starts_with(OBSERVATION) {
                    return Ok(());
                }
                return Err(String::from_utf8_lossy(payload).into_owned().into());
            }
            if self.stream.read_buf(&mut self.received).await? == 0 {
                return Err("the service closed the connection".into());
            }
        }
    }
}

/// A masked text frame; the mask is zero, which leaves the text as it is.
fn frame(text: &str) -> Vec<u8> {
    let mut frame = vec![0x81, 0x80 | 126];
    frame.extend((text.len() as u16).to_be_bytes());
    frame.extend([0; 4]);
    frame.extend(text.as_bytes());
    frame
}

/// What a whole unmasked frame carries; `None` while part of it is missing.
fn payload(frame: &[u8]) -> Option<&[u8]> {
    let (start, length) = match *frame.get(1)? {
        126 => (4, usize::from(u16::from_be_bytes([*frame.get(2)?, *frame.get(3)?]))),
        short => (2, usize::from(short)),
    };
    frame.get(start..start + length)
}

/// Between two threads with blocking sockets: what the system alone costs.
fn echo_micros() -> Result<Vec<f64>, Failure> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    let server = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept()?;
        stream.set_nodelay(true)?;
        let (mut question, answer) = (vec![0; STEP.len()], vec![0; REPLY_BYTES]);
        while stream.read_exact(&mut question).is_ok() {
            stream.write_all(&answer)?;
        }
        Ok::<_, std::io::Error>(())
    });
    let mut stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let mut answer = vec![0; REPLY_BYTES];
    let mut micros = Vec::new();
    for _ in 0..20_000 {
        let sent = Instant::now();
        stream.write_all(STEP.as_bytes())?;
        stream.read_exact(&mut answer)?;
        micros.push(sent.elapsed().as_secs_f64() * 1e6);
    }
    drop(stream);
    server.join().map_err(|_| "the echo panicked")??;
    Ok(micros)
}

fn percentile(values: &mut [f64], percent: usize) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get(last * percent / 100).copied().unwrap_or(0.0)
}
