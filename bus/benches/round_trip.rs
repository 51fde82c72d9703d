//! How long is one question and its answer over the bus, beside a bare TCP round trip?
//!
//! Unit of work: 200 bytes there, 1,500 bytes back (a small tick), between two processes. Each way
//! is measured in turn in every round; printed are medians over the rounds, and the ratio to bare
//! TCP.
#![allow(clippy::unwrap_used, reason = "a bench that cannot run stops")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use bus::{Bus, BusAddress, BusConfig, Channel, Incoming};
use schemas::{
    Alive, Error, Reply, Request, ServiceKind, TickItem, TickOutcome, TickResult, WorldId, keys,
};
use zenoh::{Config, Session, Wait};

const ASK_BYTES: usize = 200;
const ANSWER_BYTES: usize = 1_500;
const ROUNDS: usize = 7;
const TRIPS: usize = 1_500;
const SERVE: &str = "ROUND_TRIP_SERVE";
/// Runtime settings of the other process, to compare with `ZENOH_RUNTIME` of this one.
const SERVER_RUNTIME: &str = "ROUND_TRIP_SERVER_RUNTIME";

#[tokio::main(worker_threads = 2)]
async fn main() {
    if std::env::var_os(SERVE).is_some() {
        return serve().await;
    }
    let server = Server::start();
    let mut tcp = TcpStream::connect(("127.0.0.1", server.tcp)).unwrap();
    tcp.set_nodelay(true).unwrap();
    let plain = zenoh::open(config(None, Some(server.zenoh), false)).await.unwrap();
    let fast = zenoh::open(config(None, Some(server.zenoh), true)).await.unwrap();
    let bus = Bus::open(BusConfig::connecting(BusAddress::loopback(server.bus))).await.unwrap();
    let pair = Pair::new(&plain);
    let fast_pair = Pair::new(&fast);
    let world = WorldId::new(1).unwrap();
    let tick = Request::TickWorlds(vec![TickItem::new(world, 1)]);
    let key = keys::world(&"local".parse().unwrap(), world);
    let names = [
        "bare TCP",
        "publication pair",
        "publication pair, low latency",
        "query",
        "query, low latency",
        "Bus::request of a tick",
        "Channel::request by a shortcut",
    ];
    let channel = channel(&bus, "shortcut").await;
    let mut medians = vec![Vec::new(); names.len()];
    for _ in 0..ROUNDS {
        medians[0].push(median(|| tcp_trip(&mut tcp)));
        medians[1].push(median(|| pair.trip()));
        medians[2].push(median(|| fast_pair.trip()));
        medians[3].push(median(|| query(&plain)));
        medians[4].push(median(|| query(&fast)));
        let deadline = Duration::from_secs(5);
        medians[5].push(median_of(|| bus.request(&key, &tick, deadline)).await);
        medians[6].push(median_of(|| channel.request(&tick, deadline)).await);
    }
    let base = middle(medians[0].clone());
    for (name, medians) in names.iter().zip(medians) {
        let median = middle(medians);
        let ratio = median.as_secs_f64() / base.as_secs_f64();
        println!("{name:32} {:7.1} µs {ratio:5.1} ×", median.as_secs_f64() * 1e6);
    }
}

async fn median_of<F: Future<Output = Result<Reply, Error>>>(ask: impl Fn() -> F) -> Duration {
    let mut trips = Vec::with_capacity(TRIPS);
    for _ in 0..TRIPS {
        let begun = Instant::now();
        assert!(matches!(ask().await, Ok(Reply::Ticked(_))));
        trips.push(begun.elapsed());
    }
    middle(trips)
}

async fn channel(bus: &Bus, host: &str) -> Channel {
    let host = host.parse().unwrap();
    bus.channel(&keys::batch_tick(&host), (ServiceKind::World, &host)).await.unwrap()
}

fn middle(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

fn median(mut trip: impl FnMut()) -> Duration {
    let times = (0..TRIPS).map(|_| {
        let begun = Instant::now();
        trip();
        begun.elapsed()
    });
    middle(times.collect())
}

fn tcp_trip(tcp: &mut TcpStream) {
    let mut answer = [0; ANSWER_BYTES];
    tcp.write_all(&[1; ASK_BYTES]).unwrap();
    tcp.read_exact(&mut answer).unwrap();
}

fn query(session: &Session) {
    let (sender, replies) = mpsc::sync_channel(1);
    session
        .get("bench/query")
        .payload(vec![1; ASK_BYTES])
        .express(true)
        .callback(move |reply| sender.send(reply).unwrap())
        .wait()
        .unwrap();
    assert_eq!(replies.recv().unwrap().result().unwrap().payload().len(), ANSWER_BYTES);
}

/// A publication there and one back.
struct Pair {
    ask: zenoh::pubsub::Publisher<'static>,
    answers: mpsc::Receiver<usize>,
    _subscriber: zenoh::pubsub::Subscriber<()>,
}

impl Pair {
    fn new(session: &Session) -> Self {
        let (sender, answers) = mpsc::sync_channel(16);
        let channel = session.zid().to_string();
        let subscriber = session
            .declare_subscriber(format!("bench/answer/{channel}"))
            .callback(move |sample| {
                let _ = sender.try_send(sample.payload().len());
            })
            .wait()
            .unwrap();
        let ask =
            session.declare_publisher(format!("bench/ask/{channel}")).express(true).wait().unwrap();
        let pair = Self { ask, answers, _subscriber: subscriber };
        // Both subscriptions travel first.
        while pair.answers.recv_timeout(Duration::from_millis(50)).is_err() {
            pair.ask.put(vec![1; ASK_BYTES]).wait().unwrap();
        }
        while pair.answers.recv_timeout(Duration::from_millis(50)).is_ok() {}
        pair
    }

    fn trip(&self) {
        self.ask.put(vec![1; ASK_BYTES]).wait().unwrap();
        assert_eq!(self.answers.recv_timeout(Duration::from_secs(5)).unwrap(), ANSWER_BYTES);
    }
}

fn config(listen: Option<u16>, connect: Option<u16>, low_latency: bool) -> Config {
    let endpoints = |port: Option<u16>| {
        port.map_or("[]".to_owned(), |port| format!("[\"tcp/127.0.0.1:{port}\"]"))
    };
    let mut config = Config::default();
    for (name, value) in [
        ("mode", if listen.is_some() { "\"router\"" } else { "\"client\"" }),
        ("listen/endpoints", endpoints(listen).as_str()),
        ("connect/endpoints", endpoints(connect).as_str()),
        ("scouting/multicast/enabled", "false"),
        ("scouting/delay", "0"),
        ("transport/unicast/qos/enabled", if low_latency { "false" } else { "true" }),
        ("transport/unicast/lowlatency", if low_latency { "true" } else { "false" }),
    ] {
        config.insert_json5(name, value).unwrap();
    }
    config
}

/// The other process.
struct Server {
    process: Child,
    tcp: u16,
    zenoh: u16,
    bus: u16,
}

impl Server {
    fn start() -> Self {
        let mut process = Command::new(std::env::current_exe().unwrap())
            .env(SERVE, "1")
            .env("ZENOH_RUNTIME", std::env::var(SERVER_RUNTIME).unwrap_or_else(|_| "()".to_owned()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let ports: Vec<u16> = line.split_whitespace().map(|port| port.parse().unwrap()).collect();
        Self { process, tcp: ports[0], zenoh: ports[1], bus: ports[2] }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

async fn serve() {
    let tcp = TcpListener::bind("127.0.0.1:0").unwrap();
    let tcp_port = tcp.local_addr().unwrap().port();
    let zenoh_port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let session = zenoh::open(config(Some(zenoh_port), None, true)).await.unwrap();
    let _queryable = session
        .declare_queryable("bench/query")
        .complete(true)
        .callback(|query| {
            query.reply(query.key_expr(), vec![2; ANSWER_BYTES]).express(true).wait().unwrap()
        })
        .await
        .unwrap();
    let answering = session.clone();
    let _subscriber = session
        .declare_subscriber("bench/ask/*")
        .callback(move |sample| {
            let key = sample.key_expr().as_str().replace("ask", "answer");
            answering.put(key, vec![2; ANSWER_BYTES]).express(true).wait().unwrap();
        })
        .await
        .unwrap();
    let bus = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
    let result = TickResult {
        world: WorldId::new(1).unwrap(),
        outcome: Ok(TickOutcome::new(schemas::wire::encode_frame(&frame()))),
    };
    let reply = Reply::Ticked(vec![result]);
    let answer = move |incoming: Incoming| {
        assert!(incoming.request().is_ok());
        incoming.reply(&reply);
    };
    let alive = Alive {
        kind: ServiceKind::World,
        id: "shortcut".parse().unwrap(),
        version: String::new(),
        pid: 0,
        capacity: 1,
        detail: String::new(),
        number: 0,
    };
    let key = keys::batch_tick(&alive.id);
    let _announcement = bus.announce(alive).await.unwrap();
    let _servings = [
        bus.serve(&keys::any_world(0), answer.clone()).await.unwrap(),
        bus.serve(&key, answer.clone()).await.unwrap(),
        bus.serve_shortcut(&key, answer).await.unwrap(),
    ];
    println!("{tcp_port} {zenoh_port} {}", bus.listening()[0].port());
    let (mut stream, _) = tcp.accept().unwrap();
    stream.set_nodelay(true).unwrap();
    let mut ask = [0; ASK_BYTES];
    while stream.read_exact(&mut ask).is_ok() {
        stream.write_all(&[2; ANSWER_BYTES]).unwrap();
    }
}

fn frame() -> schemas::Frame {
    let map = schemas::MapRef { name: "Town10HD_Opt".to_owned(), digest: "0".repeat(64) };
    schemas::Frame::empty(WorldId::new(1).unwrap(), map)
}
