//! Traffic of our own in a town: what it hits, how fast it flows, who waits for whom.
//!
//! `cargo run --release -p world --example traffic -- Town02_Opt 100 10` drives 100 vehicles for 10
//! simulated minutes and prints a row per minute; a file `NAME.xodr` is a map, too. A fourth word
//! is the seed of the world, else it is 7; a fifth word `hybrid` takes the dynamics away from
//! vehicles that nobody is near.
#![allow(clippy::unwrap_used, reason = "an example stops at the first surprise")]

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

use agents::Held;
use roads::{LaneTypes, Map};
use schemas::{ActorId, ActorKind, Command, Frame, TrafficCommand, WorldId};
use world::{Town, World, WorldConfig};

const DT_SECS: f64 = 0.05;
const TICKS_PER_SEC: u32 = 20;
const TICKS_PER_MINUTE: u32 = 1_200;
/// Slower than this a vehicle stands.
const STANDING_MPS: f64 = 0.2;
/// Whoever stands longer is stuck.
const STUCK_SECS: u32 = 60;
/// Farther than this from the middle of every lane a vehicle is off the road.
const OFF_ROAD_M: f64 = 2.5;

/// What happened since the start and in the present minute.
#[derive(Default)]
struct Tally {
    contacts: u32,
    standing_secs: BTreeMap<ActorId, u32>,
    off_road: BTreeSet<ActorId>,
    sum_mps: f64,
    samples: u32,
    standing: u32,
    /// Of vehicles at the head of a queue: seconds for each reason to stand.
    held_secs: BTreeMap<&'static str, u32>,
}

fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "Town10HD_Opt".to_owned());
    let count: u32 = args.next().map_or(100, |count| count.parse().expect("a number of vehicles"));
    let minutes: u32 = args.next().map_or(1, |minutes| minutes.parse().expect("minutes"));
    let seed: u64 = args.next().map_or(7, |seed| seed.parse().expect("a seed"));
    let hybrid = args.next().is_some_and(|word| word == "hybrid");
    let text = match name.ends_with(".xodr") {
        true => std::fs::read_to_string(&name).expect("an OpenDRIVE file"),
        false => roads::town::build(&name).expect("one of our towns"),
    };
    let map = Arc::new(Map::parse(&name, &text).unwrap());
    let mut world = start(&map, count, seed, hybrid);
    println!(
        "{name}, {count} vehicles, {minutes} min, seed {seed}{}",
        if hybrid { ", hybrid" } else { "" }
    );
    println!("minute  mean m/s  standing  stuck>60s  contacts  off road  ticks/s");
    let mut tally = Tally::default();
    let mut began = Instant::now();
    for tick in 1..=minutes * TICKS_PER_MINUTE {
        world.tick().unwrap();
        for hit in world.collisions().iter().filter(|hit| hit.started) {
            tally.contacts += 1;
            describe(&world.frame(), hit.actor, hit.other, tick, hit.closing_speed_mps);
        }
        if tick.is_multiple_of(TICKS_PER_SEC) {
            tally.count(&world.frame(), &map);
            tally.ask(&world);
        }
        if tick.is_multiple_of(TICKS_PER_MINUTE) {
            let rate = f64::from(TICKS_PER_MINUTE) / began.elapsed().as_secs_f64();
            tally.print(tick / TICKS_PER_MINUTE, rate);
            began = Instant::now();
        }
    }
    explain(&world, &tally);
}

fn start(map: &Arc<Map>, count: u32, seed: u64, hybrid: bool) -> World {
    let id = WorldId::new(1).unwrap();
    let map = Arc::new(Town::new(Arc::clone(map)));
    let config = WorldConfig { id, epoch: 1, seed, dt_secs: DT_SECS, map };
    let mut world = World::with_traffic(config).unwrap();
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count, behaviour: None })).unwrap();
    if hybrid {
        // With nobody else about, all of it moves without dynamics.
        world.apply(&Command::Traffic(TrafficCommand::SetHybrid { radius_m: Some(70.0) })).unwrap();
    }
    world
}

impl Tally {
    fn count(&mut self, frame: &Frame, map: &Map) {
        for actor in frame.actors.iter().filter(|actor| actor.kind == ActorKind::Vehicle) {
            let mps = f64::from(actor.linear_velocity_mps.norm());
            self.sum_mps += mps;
            self.samples += 1;
            self.standing += u32::from(mps < STANDING_MPS);
            let stood = self.standing_secs.entry(actor.id).or_default();
            *stood = if mps < STANDING_MPS { *stood + 1 } else { 0 };
            let here: nalgebra::Vector3<f64> =
                nalgebra::convert(actor.world_from_actor.translation.vector);
            let lane = map.nearest(here.into(), LaneTypes::DRIVING);
            let away_m = lane.map_or(f64::INFINITY, |lane| {
                (map.pose(&lane).translation.vector - here).xy().norm()
            });
            if away_m > OFF_ROAD_M {
                self.off_road.insert(actor.id);
            }
        }
    }

    fn ask(&mut self, world: &World) {
        for (id, held) in world.held() {
            let why = match held {
                Held::No | Held::Behind(_) | Held::Beside(_) => continue,
                Held::Line => "light or sign",
                Held::Claim(_) => "others in the junction",
                Held::Room(_) => "no room beyond the junction",
            };
            if self.standing_secs.get(&id).is_some_and(|secs| *secs > 0) {
                *self.held_secs.entry(why).or_default() += 1;
            }
        }
    }

    fn stuck(&self) -> impl Iterator<Item = (ActorId, u32)> {
        let stood = self.standing_secs.iter().map(|(id, secs)| (*id, *secs));
        stood.filter(|(_, secs)| *secs > STUCK_SECS)
    }

    fn print(&mut self, minute: u32, rate: f64) {
        let samples = f64::from(self.samples.max(1));
        println!(
            "{minute:6}  {:8.2}  {:7.0}%  {:9}  {:8}  {:8}  {rate:7.0}",
            self.sum_mps / samples,
            100.0 * f64::from(self.standing) / samples,
            self.stuck().count(),
            self.contacts,
            self.off_road.len(),
        );
        (self.sum_mps, self.samples, self.standing) = (0.0, 0, 0);
    }
}

/// Tells, for everybody who is stuck, who waits for whom.
fn explain(world: &World, tally: &Tally) {
    let held: BTreeMap<ActorId, Held> = world.held().collect();
    let frame = world.frame();
    println!("vehicle seconds at the head of a queue: {:?}", tally.held_secs);
    for (id, secs) in tally.stuck() {
        let why = held.get(&id).copied().unwrap_or_default();
        println!("{} stands for {secs} s: {why:?}", told(&frame, id));
    }
}

/// Tells who hit whom where, on the error stream.
fn describe(frame: &Frame, actor: ActorId, other: Option<ActorId>, tick: u32, closing_mps: f32) {
    let other = other.map_or_else(|| "scenery".to_owned(), |other| told(frame, other));
    eprintln!("tick {tick}: {} and {other}, closing at {closing_mps:.1} m/s", told(frame, actor));
}

/// Who it is, and how it moves where.
fn told(frame: &Frame, id: ActorId) -> String {
    let Some(state) = frame.actor(id) else { return format!("{id}") };
    let place = state.world_from_actor.translation.vector;
    let [x, y, z] = [place.x, place.y, place.z];
    let mps = state.linear_velocity_mps.norm();
    let kind = &frame.types[usize::from(state.type_index)];
    let yaw = schemas::yaw_rad(&state.world_from_actor);
    format!("{id} {kind} at ({x:.1}, {y:.1}, {z:.1}) heading {yaw:.2}, {mps:.1} m/s")
}
