//! What do a snapshot, a restore, eight forks and a new world cost, and how much memory does a world
//! take?
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{car, flat, run, walker, world_on};
use criterion::{Criterion, criterion_group, criterion_main};
use schemas::WorldId;
use world::World;

/// A car that has just hit three pedestrians: contacts and warm starts are part of the state.
fn busy() -> World {
    let mut world = world_on(flat(), 0.05);
    car(&mut world, 0.0, 11.1);
    for beside_m in [-0.8, 0.0, 0.8] {
        walker(&mut world, 6.0, beside_m);
    }
    run(&mut world, 8);
    world
}

/// What the system says this process holds in memory.
fn resident_bytes() -> usize {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: usize = statm.split_whitespace().nth(1).unwrap().parse().unwrap();
    pages * 4096
}

/// Mean over many worlds on one map, each after its first ticks.
fn print_memory() {
    const WORLDS: usize = 2_000;
    let first = busy();
    let before = resident_bytes();
    let worlds: Vec<World> = (0..WORLDS).map(|_| busy()).collect();
    let per_world = resident_bytes().saturating_sub(before) / WORLDS;
    println!("memory: {} KiB per world, {} worlds", per_world / 1024, worlds.len());
    drop(first);
}

fn snapshot(criterion: &mut Criterion) {
    print_memory();
    let world = busy();
    let id = WorldId::new(2).unwrap();
    let bytes = world.snapshot();
    println!("snapshot: {} bytes", bytes.len());
    criterion.bench_function("snapshot", |bencher| bencher.iter(|| black_box(world.snapshot())));
    criterion.bench_function("restore", |bencher| {
        bencher.iter(|| World::restore(black_box(&bytes), id, 1, |_| Some(flat())).unwrap());
    });
    criterion.bench_function("fork(8)", |bencher| {
        bencher.iter(|| black_box([(); 8].map(|()| world.fork(id))));
    });
    criterion.bench_function("create", |bencher| {
        bencher.iter(|| {
            let mut world = world_on(flat(), 0.05);
            car(&mut world, 0.0, 11.1);
            for beside_m in [-0.8, 0.0, 0.8] {
                walker(&mut world, 25.0, beside_m);
            }
            world
        });
    });
    criterion.bench_function("frame", |bencher| bencher.iter(|| black_box(world.frame())));
    criterion
        .bench_function("state_hash", |bencher| bencher.iter(|| black_box(world.state_hash())));
}

criterion_group!(benches, snapshot);
criterion_main!(benches);
