//! What does a tick of 50 ms with driving traffic cost?
//!
//! `cargo bench -p world --bench flow`: vehicles in Town05, all of them traffic without dynamics;
//! then one of them with an agent of its own and always with full dynamics, the others traffic,
//! once with dynamics only near that one and once all with. Prints Markdown; times are those that
//! the thread was on a processor.
//!
//! `-- full 200` measures one case alone, for a profiler: `without`, `hybrid` or `full` dynamics
//! and how many vehicles. It tells the state at the end as well: while nothing changes how vehicles
//! drive, it stays the same.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

use std::hint::black_box;
use std::sync::Arc;

use roads::Map;
use schemas::{ActorKind, AgentCommand, AgentOptions, Command, TrafficCommand, WorldId};
use world::{Town, World, WorldConfig};

const DT_SECS: f64 = 0.05;
const TOWN: &str = "Town05_Opt";
const VEHICLES: [u32; 5] = [1, 10, 50, 100, 200];
/// Before and while ticks are timed.
const SETTLE_TICKS: u32 = 400;
const TIMED_TICKS: u32 = 1_000;
/// From the vehicle with an agent, as CARLA's Traffic Manager has it.
const HYBRID_RADIUS_M: f32 = 50.0;

/// A case: from the vehicle with an agent traffic has dynamics so near, and whether there is one.
type Case = (Option<f32>, bool);
const WITHOUT: Case = (Some(HYBRID_RADIUS_M), false);
const HYBRID: Case = (Some(HYBRID_RADIUS_M), true);
const FULL: Case = (None, true);

fn main() {
    let text = roads::town::build(TOWN).unwrap();
    let town = Arc::new(Town::new(Arc::new(Map::parse(TOWN, &text).unwrap())));
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    match words.as_slice() {
        [case, count] => one(&town, case, count.parse().unwrap()),
        _ => all(&town),
    }
}

fn all(town: &Arc<Town>) {
    println!(
        "| vehicles | without dynamics, µs | hybrid, µs | full dynamics, µs | vehicle-seconds/s |\n\
         |---|---|---|---|---|"
    );
    for count in VEHICLES {
        let [without, hybrid, full] = [WITHOUT, HYBRID, FULL].map(|case| {
            let mut world = start(town, count, case);
            1.0e6 * tick_secs(&mut world)
        });
        let full_rate = f64::from(count) * DT_SECS / (full * 1.0e-6);
        println!("| {count} | {without:.0} | {hybrid:.0} | {full:.0} | {full_rate:.0} |");
    }
}

fn one(town: &Arc<Town>, case: &str, count: u32) {
    let known = [("without", WITHOUT), ("hybrid", HYBRID), ("full", FULL)];
    let (_, case) = known.into_iter().find(|(name, _)| *name == case).unwrap();
    let mut world = start(town, count, case);
    let secs = tick_secs(&mut world);
    println!("{:.1} µs, state {:016x}", 1.0e6 * secs, world.state_hash());
}

fn start(town: &Arc<Town>, count: u32, (radius_m, has_agent): Case) -> World {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map: Arc::clone(town) };
    let mut world = World::with_traffic(config).unwrap();
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count, behaviour: None })).unwrap();
    if has_agent {
        let frame = world.frame();
        let actor = frame.actors.iter().find(|actor| actor.kind == ActorKind::Vehicle).unwrap().id;
        let (options, keep_route) = (AgentOptions::default(), false);
        world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route })).unwrap();
        world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
    }
    world.apply(&Command::Traffic(TrafficCommand::SetHybrid { radius_m })).unwrap();
    world
}

fn tick_secs(world: &mut World) -> f64 {
    for _ in 0..SETTLE_TICKS {
        world.tick().unwrap();
    }
    let begin = busy_secs();
    for _ in 0..TIMED_TICKS {
        world.tick().unwrap();
        black_box(world.frame());
    }
    (busy_secs() - begin) / f64::from(TIMED_TICKS)
}

/// Time that this thread was on a processor, whoever else wants it.
fn busy_secs() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    let nanos: f64 = text.split(' ').next().unwrap().parse().unwrap();
    nanos * 1.0e-9
}
