//! What does a journal cost a tick and the disk, and how soon is any second of it reached?
//!
//! `cargo bench -p world-service --bench journal -- [seconds=3600] [cars=100]`. Prints Markdown.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

use std::fs::{File, OpenOptions};
use std::hint::black_box;
use std::io::BufReader;
use std::sync::Arc;
use std::time::{Duration, Instant};

use monitoring::Counter;
use schemas::wire::encode_frame;
use schemas::{Command, Tick, TrafficCommand, WorldId};
use whole_file::WholeFile;
use world::{Town, World, WorldConfig};
use world_service::journal::{Head, Moment, Queue, Reader, Replay, verify};
use world_service::service::Recorded;

const TICK_SECS: f64 = 0.05;
/// Ticks of one round.
const ROUND_TICKS: u64 = 50;
const MAP: &str = "Town10HD_Opt";
/// Seconds that are looked for.
const SEEKS: u64 = 200;

fn named(name: &str, usual: u64) -> u64 {
    let of = |argument: String| argument.strip_prefix(name)?.strip_prefix('=')?.parse().ok();
    std::env::args().find_map(of).unwrap_or(usual)
}

fn world(cars: u32) -> World {
    let text = roads::town::build(MAP).unwrap();
    let map = Arc::new(Town::new(Arc::new(roads::Map::parse(MAP, &text).unwrap())));
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: TICK_SECS, map };
    let mut world = World::with_traffic(config).unwrap();
    let spawn = TrafficCommand::Spawn { count: cars, behaviour: None };
    world.apply(&Command::Traffic(spawn)).unwrap();
    world
}

fn head(world: &World) -> Head {
    Head {
        map_name: world.map_ref().name.clone(),
        map_text: world.map_text().to_owned(),
        snapshot: world.snapshot(),
        first: Moment::of(&world.frame()),
    }
}

/// Does some ticks. A service has the frame and its bytes of each, with a journal or without.
fn run(world: &mut Recorded<World>, ticks: u64) {
    for _ in 0..ticks {
        if world.tick(WorldId::new(1).unwrap(), None).unwrap().is_none() {
            black_box(encode_frame(&world.frame()));
        }
    }
}

/// How long ticks took, the median of rounds, and how long the process worked for one.
#[derive(Default)]
struct Ticks {
    rounds_ms: Vec<f64>,
    worked_ms: f64,
}

impl Ticks {
    fn round(&mut self, world: &mut Recorded<World>) {
        let (begin, worked_ms) = (Instant::now(), processor_ms());
        run(world, ROUND_TICKS);
        self.rounds_ms.push(begin.elapsed().as_secs_f64() * 1e3 / ROUND_TICKS as f64);
        self.worked_ms += processor_ms() - worked_ms;
    }

    fn tell(mut self, what: &str) {
        self.rounds_ms.sort_by(f64::total_cmp);
        let count = self.rounds_ms.len();
        let worked_ms = self.worked_ms / (count as u64 * ROUND_TICKS) as f64;
        let median_ms = self.rounds_ms[count / 2];
        println!("| tick, {what} | {median_ms:.3} ms, work of all threads {worked_ms:.3} ms |");
    }
}

/// For how long all threads of this process were on a processor.
fn processor_ms() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").unwrap();
    let nanos = threads.map(|thread| {
        let told = std::fs::read_to_string(thread.unwrap().path().join("schedstat"));
        let told = told.unwrap_or_default();
        told.split(' ').next().and_then(|nanos| nanos.parse::<f64>().ok()).unwrap_or_default()
    });
    nanos.sum::<f64>() / 1e6
}

fn tell(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let millis = |time: Duration| time.as_secs_f64() * 1e3;
    let (median, longest) = (millis(times[times.len() / 2]), millis(times[times.len() - 1]));
    println!("| {what} | median {median:.2} ms, longest {longest:.2} ms of {} |", times.len());
}

fn main() {
    let (secs, cars) = (named("seconds", 3_600), named("cars", 100));
    let ticks = secs * 20;
    let path = std::env::temp_dir().join(format!("causeway-bench-{}.journal", std::process::id()));
    let open = || OpenOptions::new().create(true).write(true).truncate(true).open(&path).unwrap();

    // Both worlds go the same way; rounds take turns.
    let mut plain = Recorded::new(world(cars as u32));
    let mut recorded = Recorded::new(world(cars as u32));
    let head = head(&recorded);
    let out = WholeFile::new(open());
    let begun = Queue::begin(out, u64::MAX, head, "bench".to_owned(), Counter::default());
    let (queue, thread) = begun.unwrap();
    assert!(recorded.record(Some(Box::new(queue))).is_none());
    let (mut without, mut with) = (Ticks::default(), Ticks::default());
    let rounds = (ticks / ROUND_TICKS).min(40);
    for _ in 0..rounds {
        without.round(&mut plain);
        with.round(&mut recorded);
    }
    run(&mut recorded, ticks - rounds * ROUND_TICKS);
    recorded.record(None).unwrap().end(Box::new(|| ()));
    thread.join().unwrap();

    println!("| {cars} cars, {secs} s | |\n|---|---|");
    without.tell("alone");
    with.tell("with a journal");
    let bytes = path.metadata().unwrap().len() as f64;
    println!("| size | {:.0} MB, {:.0} B a tick |", bytes / 1e6, bytes / ticks as f64);
    seek(&path, ticks);
    let begin = Instant::now();
    let some = verify(BufReader::new(File::open(&path).unwrap()), |tick| {
        let is_enough = begin.elapsed() > Duration::from_secs(120) || tick.moment.tick.0 > ticks;
        if is_enough {
            Err(std::io::Error::other(tick.moment.tick.to_string()).into())
        } else {
            Ok(())
        }
    });
    println!("| exact replay, of two minutes of work | {some:?} |");
    std::fs::remove_file(&path).unwrap();
}

fn seek(path: &std::path::Path, ticks: u64) {
    let begin = Instant::now();
    let mut reader = Reader::open(BufReader::new(File::open(path).unwrap())).unwrap();
    println!("| open | {:.1} ms |", begin.elapsed().as_secs_f64() * 1e3);
    println!("| keyframes | {} |", reader.index().keyframe_count());
    let begin = Instant::now();
    let mut replay = Replay::begin(reader.head()).unwrap();
    // A town finds its roads when the first world on it ticks.
    let first = Tick(reader.index().first().0 + 1);
    replay.go(&reader.way_to(first).unwrap()).unwrap();
    println!("| map, town and its roads, once | {:.0} ms |", begin.elapsed().as_secs_f64() * 1e3);
    let (mut frames, mut states) = (Vec::new(), Vec::new());
    let mut seed = 1u64;
    for _ in 0..SEEKS {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        // The tick that is farthest from a keyframe.
        let tick = reader.index().tick_at(((seed >> 20) % (ticks / 20)) as f64 + 0.95);
        let begin = Instant::now();
        let frame = reader.frame(tick).unwrap();
        assert_eq!(schemas::wire::decode_frame(&frame.0).unwrap().tick, tick);
        frames.push(begin.elapsed());
        let begin = Instant::now();
        let way = reader.way_to(tick).unwrap();
        replay.go(&way).unwrap();
        assert_eq!(replay.world().state_hash(), way.to.state_hash);
        states.push(begin.elapsed());
    }
    tell("the frame of any second", frames);
    tell("the world of any second, to the bit", states);
}
