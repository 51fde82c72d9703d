//! What do many worlds, many actors and a long time cost?
//!
//! `cargo bench -p world --bench scale -- [worlds] [actors] [ticks] [hour]`; all but the hour when
//! nothing is named. Prints Markdown. Times are medians; memory is what the kernel counts.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/pad/mod.rs"]
mod pad;

use std::hint::black_box;
use std::time::{Duration, Instant};

use common::{car, control, flat, run, spawn_at, walker, world_on};
use pad::pad_town;
use schemas::{Vec3, VehicleControl, WorldId, level_pose};
use world::World;

const WORLDS: usize = 1_000;

fn main() {
    // Cargo passes flags of its own.
    let named: Vec<String> = std::env::args().skip(1).filter(|it| !it.starts_with('-')).collect();
    let asked = |name: &str| named.iter().any(|it| it == name);
    let all = named.is_empty();
    if all || asked("worlds") {
        worlds();
    }
    if all || asked("actors") {
        actors();
    }
    if all || asked("ticks") {
        ticks();
    }
    if asked("hour") {
        hour();
    }
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

/// Median time of one call, over some calls.
fn time<T>(rounds: usize, mut work: impl FnMut() -> T) -> Duration {
    let one = |_| {
        let begin = Instant::now();
        black_box(work());
        begin.elapsed()
    };
    median((0..rounds).map(one).collect())
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1.0e6
}

/// Resident memory of this process.
fn resident_bytes() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: f64 = text.split(' ').nth(1).unwrap().parse().unwrap();
    pages * 4_096.0
}

/// The scene of the trolley scenarios.
fn trolley() -> World {
    let mut world = world_on(flat(), 0.05);
    car(&mut world, 0.0, 11.1);
    for beside_m in [-0.8, 0.0, 0.8] {
        walker(&mut world, 25.0, beside_m);
    }
    world
}

/// The first three seconds: the car drives into the people.
const ROUNDS: usize = 60;

/// World ticks per busy second of one thread that ticks these worlds in turn.
fn rate(worlds: &mut [World]) -> f64 {
    let begin = busy_secs();
    for _ in 0..ROUNDS {
        for world in &mut *worlds {
            world.tick().unwrap();
            black_box(world.frame());
        }
    }
    (ROUNDS * worlds.len()) as f64 / (busy_secs() - begin)
}

/// Time that this thread was on a processor, whoever else wants it.
fn busy_secs() -> f64 {
    // Kernels may count only when a thread gives way, or every few milliseconds.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    let nanos: f64 = text.split(' ').next().unwrap().parse().unwrap();
    nanos * 1.0e-9
}

fn worlds() {
    let start = trolley();
    let create = time(200, trolley);
    // A reset: the world as it was, in place of the one that ran.
    let mut used = start.fork(start.id());
    let reset = time(200, || used = start.fork(start.id()));
    let mut rates: Vec<f64> =
        (0..WORLDS / 5).map(|_| rate(&mut [start.fork(start.id())])).collect();
    rates.sort_by(f64::total_cmp);
    let alone = rates[rates.len() / 2];
    let before = resident_bytes();
    let many = || -> Vec<World> { (0..WORLDS).map(|_| trolley()).collect() };
    let mut first = many();
    let together = rate(&mut first);
    let each = (resident_bytes() - before) / WORLDS as f64;
    let mut second = many();
    let both: f64 = std::thread::scope(|scope| {
        let halves = second.chunks_mut(WORLDS / 2);
        let threads: Vec<_> = halves.map(|half| scope.spawn(|| rate(half))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).sum()
    });
    println!("\n| a car and three walkers | |\n|---|---|");
    println!("| create, reset | {:.0}, {:.0} µs |", micros(create), micros(reset));
    println!("| one world alone | {alone:.0} ticks per busy second |");
    println!(
        "| {WORLDS} worlds in turn, one thread | {together:.0} ticks/s, {:.0} % |",
        100.0 * together / alone
    );
    println!(
        "| {WORLDS} worlds, two threads | {both:.0} ticks/s, {:.0} % of twice one |",
        50.0 * both / alone
    );
    println!("| memory of each | {:.0} kB |", each / 1_000.0);
}

/// Cars under way on the pad, side by side and in rows, each in its own circle or straight on.
fn cars(count: usize, apart_m: f32, steer: f32) -> World {
    let mut world = world_on(pad_town(), 0.05);
    let rows = (360.0 / apart_m) as usize;
    for index in 0..count {
        let x_m = -950.0 + apart_m * (index / rows) as f32;
        let y_m = -180.0 + apart_m * (index % rows) as f32;
        let pose = level_pose(Vec3::new(x_m, y_m, 0.0), 0.0);
        let actor = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 8.0);
        let wanted = VehicleControl { throttle: 0.25, steer, ..Default::default() };
        control(&mut world, actor, wanted);
    }
    run(&mut world, 20);
    world
}

fn actors() {
    println!("\n| cars | snapshot | write | read | fork(64) | frame | state hash |");
    println!("|---|---|---|---|---|---|---|");
    for count in [10, 100, 500] {
        let world = cars(count, 8.0, 0.0);
        let bytes = world.snapshot();
        let id = WorldId::new(2).unwrap();
        let write = time(20, || world.snapshot());
        let read = time(20, || World::restore(&bytes, id, 1, |_| Some(pad_town())).unwrap());
        let forks = time(20, || (0..64).map(|_| world.fork(id)).collect::<Vec<_>>());
        let (frame, hash) = (time(50, || world.frame()), time(50, || world.state_hash()));
        println!(
            "| {count} | {:.0} kB | {:.2} ms | {:.2} ms | {:.1} ms | {:.0} µs | {:.0} µs |",
            bytes.len() as f64 / 1_000.0,
            micros(write) / 1_000.0,
            micros(read) / 1_000.0,
            micros(forks) / 1_000.0,
            micros(frame),
            micros(hash)
        );
    }
}

fn ticks() {
    println!("\n| driving cars | tick of 50 ms in 5 steps | of each car | × n log n from 10 |");
    println!("|---|---|---|---|");
    let mut first = None;
    for count in [10usize, 50, 100, 200, 500, 1_000] {
        let start = cars(count, 8.0, 0.0);
        let rounds = (2_000 / count).clamp(5, 40);
        let times = (0..3).flat_map(|_| {
            let mut world = start.fork(start.id());
            (0..rounds).map(|_| time(1, || world.tick().unwrap())).collect::<Vec<_>>()
        });
        let tick = micros(median(times.collect()));
        let n_log_n = count as f64 * (count as f64).ln();
        let unit = *first.get_or_insert(tick / n_log_n);
        let (each, share) = (tick / count as f64, tick / n_log_n / unit);
        println!("| {count} | {tick:.0} µs | {each:.1} µs | {share:.2} |");
    }
}

/// 100 cars in circles at 20 Hz.
fn hour() {
    let mut world = cars(100, 60.0, 0.35);
    println!("\n| minute | resident | lowest and highest car | seconds per minute |");
    println!("|---|---|---|---|");
    for minute in 1..=60 {
        let begin = Instant::now();
        run(&mut world, 1_200);
        let took = begin.elapsed().as_secs_f64();
        let frame = world.frame();
        let heights = || frame.actors.iter().map(|car| car.world_from_actor.translation.z);
        let (low, high) = (heights().fold(f32::MAX, f32::min), heights().fold(f32::MIN, f32::max));
        assert!(frame.actors.iter().all(|car| car.linear_velocity_mps.norm().is_finite()));
        assert!(low > -0.1 && high < 0.5, "{low} and {high} m");
        if minute % 10 == 0 || minute == 1 {
            let resident = resident_bytes() / 1.0e6;
            println!("| {minute} | {resident:.2} MB | {low:.3}, {high:.3} m | {took:.2} |");
        }
    }
}
