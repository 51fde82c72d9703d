//! Traffic of our own in a town: what it hits, how fast it flows, how long it takes.
//!
//! `cargo run --release -p world --example traffic -- Town02_Opt 100 600` drives 100 vehicles for
//! 600 simulated seconds and prints a row per minute; a fourth word `hybrid` takes the dynamics
//! away from vehicles that nobody is near.
#![allow(clippy::unwrap_used, reason = "an example stops at the first surprise")]

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use roads::Map;
use schemas::{ActorId, ActorKind, Command, Frame, WorldId};
use world::{Town, World, WorldConfig};

const DT_SECS: f64 = 0.05;
const TICKS_PER_MINUTE: u32 = 1_200;

fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "Town10HD_Opt".to_owned());
    let count: u32 = args.next().map_or(100, |count| count.parse().expect("a number of vehicles"));
    let secs: u32 = args.next().map_or(60, |secs| secs.parse().expect("simulated seconds"));
    let text = roads::town::build(&name).expect("one of our towns");
    let map = Arc::new(Town::new(Arc::new(Map::parse(&name, &text).unwrap())));
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map };
    let mut world = World::with_traffic(config).unwrap();
    world.apply(&Command::SpawnTraffic { count, behaviour: None }).unwrap();
    let hybrid = args.next().is_some_and(|word| word == "hybrid");
    if hybrid {
        // With nobody else about, all of it moves without dynamics.
        world.apply(&Command::SetHybridTraffic { radius_m: Some(70.0) }).unwrap();
    }
    println!("{name}, {count} vehicles, {secs} s{}", if hybrid { ", hybrid" } else { "" });
    println!("minute  mean m/s  standing  stuck>60s  collisions  ticks/s");
    let mut standing_secs: BTreeMap<ActorId, f64> = BTreeMap::new();
    let mut collisions = 0;
    let ticks = secs * TICKS_PER_MINUTE / 60;
    let (mut sum_mps, mut samples, mut standing) = (0.0f64, 0u32, 0u32);
    let mut start = Instant::now();
    for tick in 1..=ticks {
        world.tick().unwrap();
        for hit in world.collisions().iter().filter(|hit| hit.started) {
            collisions += 1;
            describe(&world.frame(), hit.actor, hit.other, tick, hit.closing_speed_mps);
        }
        if tick.is_multiple_of(20) {
            for actor in world.frame().actors.iter().filter(|a| a.kind == ActorKind::Vehicle) {
                let mps = f64::from(actor.linear_velocity_mps.norm());
                sum_mps += mps;
                samples += 1;
                standing += u32::from(mps < 0.2);
                let stood = standing_secs.entry(actor.id).or_default();
                *stood = if mps < 0.2 { *stood + 1.0 } else { 0.0 };
            }
        }
        if tick.is_multiple_of(TICKS_PER_MINUTE) || tick == ticks {
            let n = f64::from(samples.max(1));
            let stuck = standing_secs.values().filter(|secs| **secs > 60.0).count();
            let span = f64::from((tick - 1) % TICKS_PER_MINUTE + 1);
            println!(
                "{:6}  {:8.2}  {:7.0}%  {stuck:9}  {collisions:10}  {:7.0}",
                tick.div_ceil(TICKS_PER_MINUTE),
                sum_mps / n,
                100.0 * f64::from(standing) / n,
                span / start.elapsed().as_secs_f64(),
            );
            (sum_mps, samples, standing, start) = (0.0, 0, 0, Instant::now());
        }
    }
}

/// Tells who hit whom where, on the error stream.
fn describe(frame: &Frame, actor: ActorId, other: Option<ActorId>, tick: u32, closing_mps: f32) {
    let told = |id: ActorId| {
        let Some(state) = frame.actor(id) else { return format!("{id}") };
        let place = state.world_from_actor.translation.vector;
        let mps = state.linear_velocity_mps.norm();
        let kind = &frame.types[usize::from(state.type_index)];
        let yaw = schemas::yaw_rad(&state.world_from_actor);
        format!("{kind} at ({:.1}, {:.1}) heading {yaw:.2}, {mps:.1} m/s", place.x, place.y)
    };
    let other = other.map_or_else(|| "scenery".to_owned(), told);
    eprintln!("tick {tick}: {} and {other}, closing at {closing_mps:.1} m/s", told(actor));
}
