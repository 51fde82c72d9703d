//! How long is one step of N worlds, in process, with observations, rewards and resets?
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rollouts::{Buffers, Course, Reset, Shard, Spec, TierKind};

fn course(spec: &Spec) -> Arc<Course> {
    let text = roads::town::build(&spec.town).unwrap();
    let map = Arc::new(roads::Map::parse(&spec.town, &text).unwrap());
    Arc::new(Course::new(spec, map).unwrap())
}

/// Every agent drives with half the throttle; those that leave their lane begin anew.
fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    let physics = [(1, 1), (64, 1), (256, 1), (4, 16)].map(|size| (TierKind::Physics, size));
    let kinematic = [(256, 1), (16, 16), (4, 64), (64, 64)].map(|size| (TierKind::Kinematic, size));
    for (tier, (worlds, agents)) in physics.into_iter().chain(kinematic) {
        let spec = Spec { tier, worlds, agents, decision_ticks: 1, ..Spec::default() };
        let course = course(&spec);
        let mut shard = Shard::new(&spec, &course, 0..worlds).unwrap();
        let mut buffers = Buffers::new(&spec);
        let actions = [0.0, 0.5].repeat(spec.rows());
        for _ in 0..200 {
            shard.step(&actions, &mut buffers.rows()).unwrap();
        }
        group.throughput(Throughput::Elements(spec.rows() as u64));
        group.bench_function(format!("{tier:?}, {worlds} worlds of {agents}"), |bencher| {
            bencher.iter(|| shard.step(black_box(&actions), &mut buffers.rows()).unwrap());
        });
    }
    group.finish();
}

fn resets(criterion: &mut Criterion) {
    let spec = Spec::default();
    let course = course(&spec);
    let mut shard = Shard::new(&spec, &course, 0..1).unwrap();
    let mut buffers = Buffers::new(&spec);
    // Every start is prepared once.
    for seed in 0..8_192 {
        shard.reset(Some(&[Reset::Seed(seed)]), &mut buffers.rows()).unwrap();
    }
    criterion.bench_function("reset", |bencher| {
        bencher.iter(|| shard.reset(None, &mut buffers.rows()).unwrap());
    });
    criterion.bench_function("course of Town01", |bencher| {
        let text = roads::town::build("Town01").unwrap();
        let map = Arc::new(roads::Map::parse("Town01", &text).unwrap());
        bencher.iter(|| Course::new(&spec, Arc::clone(&map)).unwrap());
    });
}

criterion_group!(benches, steps, resets);
criterion_main!(benches);
