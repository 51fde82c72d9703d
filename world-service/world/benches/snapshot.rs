//! What do a snapshot, a restore, eight forks and a new world cost?
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

fn snapshot(criterion: &mut Criterion) {
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
