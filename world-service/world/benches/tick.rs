//! How long is one tick with N cars, one with a car and three pedestrians, and one with lights?
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::sync::Arc;

use common::{car, flat, spawn_at, walker, world_on};
use criterion::{Criterion, criterion_group, criterion_main};
use schemas::{Command, PilotMode, Pose, Vec3, VehicleCommand, WorldId, level_pose};
use world::{Town, World, WorldConfig};

/// The scene of the trolley scenarios, coasting.
fn car_and_three_walkers() -> World {
    let mut world = world_on(flat(), 0.05);
    car(&mut world, 0.0, 11.1);
    for beside_m in [-0.8, 0.0, 0.8] {
        walker(&mut world, 25.0, beside_m);
    }
    world
}

/// Cars under way in both lanes, 15 m apart, each kept in its lane by a pilot.
fn cars(count: u16) -> World {
    let mut world = world_on(flat(), 0.05);
    for index in 0..count {
        let (row, lane) = (f32::from(index / 2), f32::from(index % 2));
        let pose = level_pose(Vec3::new(15.0 * row - 900.0, -1.75 - 3.5 * lane, 0.2), 0.0);
        let actor = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 10.0);
        let mode = PilotMode::KeepLane;
        world
            .apply(&Command::Vehicle(VehicleCommand::Pilot {
                actor,
                mode,
                target_speed_mps: Some(10.0),
            }))
            .unwrap();
    }
    world
}

/// Every sample starts from the same state: cars that drove on for minutes would leave the road.
fn tick_from(criterion: &mut Criterion, name: &str, start: &World) {
    ticks_from(criterion, name, start, 20);
}

fn ticks_from(criterion: &mut Criterion, name: &str, start: &World, ticks: u32) {
    criterion.bench_function(name, |bencher| {
        bencher.iter_custom(|rounds| {
            let mut spent = std::time::Duration::ZERO;
            for _ in 0..rounds.div_ceil(ticks.into()) {
                let mut world = start.fork(start.id());
                let begin = std::time::Instant::now();
                for _ in 0..ticks {
                    world.tick().unwrap();
                    black_box(world.frame());
                }
                spent += begin.elapsed();
            }
            spent * u32::try_from(rounds).unwrap_or(u32::MAX)
                / (rounds.div_ceil(ticks.into()) as u32 * ticks)
        });
    });
}

/// A car among a thousand people who only stand.
fn car_and_crowd() -> World {
    let mut world = world_on(flat(), 0.05);
    car(&mut world, 0.0, 11.1);
    for index in 0..1_000u16 {
        let (row, column) = (f32::from(index / 10), f32::from(index % 10));
        walker(&mut world, -700.0 + 2.0 * row, 30.0 + 2.0 * column);
    }
    world
}

/// A car under way in a town, with or without its lights and signs.
fn car_in_town(town: &Arc<Town>, start: &Pose, traffic: bool) -> World {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: Arc::clone(town) };
    let world = if traffic { World::with_traffic(config) } else { World::new(config) };
    let mut world = world.unwrap();
    let actor = spawn_at(&mut world, "vehicle.lincoln.mkz", *start, 8.0);
    let mode = PilotMode::KeepLane;
    world
        .apply(&Command::Vehicle(VehicleCommand::Pilot {
            actor,
            mode,
            target_speed_mps: Some(8.0),
        }))
        .unwrap();
    world
}

fn traffic(criterion: &mut Criterion) {
    let text = roads::town::build("Town10HD_Opt").unwrap();
    let map = Arc::new(roads::Map::parse("Town10HD_Opt", &text).unwrap());
    let start: Pose = nalgebra::convert(map.spawn_points()[0]);
    let town = Arc::new(Town::new(map));
    for (name, traffic) in [("without", false), ("with", true)] {
        let name = format!("tick/1 car in Town10HD {name} lights and signs");
        tick_from(criterion, &name, &car_in_town(&town, &start, traffic));
    }
}

fn tick(criterion: &mut Criterion) {
    tick_from(criterion, "tick/1 car and 3 walkers", &car_and_three_walkers());
    let name = "tick/1 car hits 3 walkers, the first 150 ticks";
    ticks_from(criterion, name, &car_and_three_walkers(), 150);
    tick_from(criterion, "tick/1 car and 1000 standing walkers", &car_and_crowd());
    for count in [1, 10, 100] {
        tick_from(criterion, &format!("tick/{count} cars"), &cars(count));
    }
}

criterion_group!(benches, tick, traffic);
criterion_main!(benches);
