//! How fast are steps over WebSocket, for one client and for many at once?
//!
//! Drives a running service: `CAUSEWAY_URL=ws://127.0.0.1:8000/ws cargo bench -p scenario-service`.
//! The unit of work is one `observe` step and its reply. A bare loopback TCP echo of messages of
//! the same size is measured in the same run, so that results can be compared as ratios.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use futures_util::{SinkExt as _, StreamExt as _};
use tokio_tungstenite::connect_async_with_config;
use tokio_tungstenite::tungstenite::Message;

type Failure = Box<dyn std::error::Error + Send + Sync>;

const STEP: &str = r#"{"type":"step","data":{"metadata":{},"action_type":"observe","throttle":0.0,"steer":0.0,"brake":0.0,"lane_direction":null,"target_speed_kmh":null,"brake_intensity":null,"target_lane_id":null,"navigation_behavior":"normal","destination_x":null,"destination_y":null,"destination_z":null,"route_steps":1}}"#;
const RESET: &str = r#"{"type":"reset","data":{"scenario_name":"trolley_saves","seed":1}}"#;
const MEASURED: Duration = Duration::from_secs(5);
/// Size of a typical reply.
const REPLY_BYTES: usize = 2_500;

fn main() -> Result<(), Failure> {
    let Ok(url) = std::env::var("CAUSEWAY_URL") else {
        println!("CAUSEWAY_URL is not set: nothing to measure");
        return Ok(());
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(async {
        let raw = percentile(&mut echo_micros()?, 50);
        println!("bare TCP round trip: p50 {raw:.0} us");
        println!(
            "{:>8} {:>12} {:>10} {:>10} {:>10} {:>8}",
            "clients", "steps/s", "p50 us", "p99 us", "max us", "fewest"
        );
        for clients in [1, 8, 64, 256] {
            measure(&url, clients, raw).await?;
        }
        Ok(())
    })
}

async fn measure(url: &str, clients: usize, raw_micros: f64) -> Result<(), Failure> {
    let mut sockets = Vec::new();
    for _ in 0..clients {
        let (mut socket, _) = connect_async_with_config(url, None, true).await?;
        socket.send(Message::text(RESET)).await?;
        let begun = socket.next().await.ok_or("closed")??;
        if !begun.to_text()?.starts_with(r#"{"type":"observation""#) {
            return Err(begun.to_text()?.to_owned().into());
        }
        sockets.push(socket);
    }
    let begun = Instant::now();
    let tasks = sockets.into_iter().map(|mut socket| {
        tokio::spawn(async move {
            let mut micros = Vec::new();
            while begun.elapsed() < MEASURED {
                let sent = Instant::now();
                socket.send(Message::text(STEP)).await?;
                let answer = socket.next().await.ok_or("closed")??;
                micros.push(sent.elapsed().as_secs_f64() * 1e6);
                if !answer.to_text()?.starts_with(r#"{"type":"observation""#) {
                    return Err(answer.to_text()?.to_owned().into());
                }
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
        "{clients:>8} {rate:>12.0} {p50:>10.0} {p99:>10.0} {max:>10.0} {fewest:>8}   p50 = {:.1} x bare",
        p50 / raw_micros
    );
    Ok(())
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
