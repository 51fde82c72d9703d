//! How long is one step of N worlds, in process, with observations, rewards and resets?
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rollouts::{Buffers, Course, Observation, Reset, Shard, Spec, TierKind};

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

/// Steers each agent for the first point of its way that its row shows.
fn follow(width: usize, observations: &[f32], actions: &mut [f32]) {
    for (row, action) in observations.chunks_exact(width).zip(actions.chunks_exact_mut(2)) {
        let (x_m, y_m) = (row[2] * 50.0, row[3] * 50.0);
        action[0] = (2.0 * 2.85 * y_m / (x_m * x_m + y_m * y_m).max(1.0)) / 0.6;
        action[1] = 0.4 - row[0];
    }
}

/// Many agents in worlds with nobody else, each with a row of 1,847 numbers, in episodes of 91
/// steps of 0.1 s that nothing else ends: as self-play's driving environments are measured.
fn wide(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("wide");
    for (worlds, agents) in [(4, 64), (64, 64)] {
        let spec = Spec {
            tier: TierKind::Kinematic,
            observation: Observation::Wide,
            worlds,
            agents,
            ends: Some(Vec::new()),
            horizon_secs: Some(9.1),
            ..Spec::default()
        };
        let course = course(&spec);
        let mut shard = Shard::new(&spec, &course, 0..worlds).unwrap();
        let mut buffers = Buffers::new(&spec);
        let mut actions = [0.0, 0.0].repeat(spec.rows());
        let width = spec.observation.columns().len();
        // Starts and lists of roads are made when they are first asked for.
        let (mut alive, mut seen, mut steps) = (0, 0, 0);
        for step in 0..40 * 92 {
            follow(width, &buffers.observations, &mut actions);
            shard.step(&actions, &mut buffers.rows()).unwrap();
            if step % 23 == 0 {
                alive += buffers.alive.iter().filter(|it| **it == 1).count();
                seen += buffers.observations.chunks_exact(width).map(partners).sum::<usize>();
                steps += spec.rows();
            }
        }
        println!("{alive} of {steps} rows alive, each with {} others", seen as f64 / steps as f64);
        group.throughput(Throughput::Elements(spec.rows() as u64));
        group.bench_function(format!("{worlds} worlds of {agents}"), |bencher| {
            bencher.iter_custom(|count| {
                let mut spent = Duration::ZERO;
                for _ in 0..count {
                    follow(width, &buffers.observations, &mut actions);
                    let begin = Instant::now();
                    shard.step(black_box(&actions), &mut buffers.rows()).unwrap();
                    spent += begin.elapsed();
                }
                spent
            });
        });
    }
    group.finish();
}

/// How many others a row shows: those with a length.
fn partners(row: &[f32]) -> usize {
    row[6..6 + 63 * 7].chunks_exact(7).filter(|other| other[5] > 0.0).count()
}

/// Worlds with cars, people and lights of their own.
fn traffic(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("traffic");
    for tier in [TierKind::Kinematic, TierKind::Physics] {
        let spec = Spec {
            task: "corl17-traffic".to_owned(),
            town: "Town02".to_owned(),
            tier,
            worlds: 4,
            observation: Observation::Drive,
            decision_ticks: 1,
            ..Spec::default()
        };
        let course = course(&spec);
        let mut shard = Shard::new(&spec, &course, 0..spec.worlds).unwrap();
        let mut buffers = Buffers::new(&spec);
        let actions = [0.0, 0.2].repeat(spec.rows());
        group.throughput(Throughput::Elements(spec.rows() as u64));
        group.bench_function(format!("{tier:?}, 15 cars, 50 people"), |bencher| {
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

criterion_group!(benches, steps, wide, traffic, resets);
criterion_main!(benches);
