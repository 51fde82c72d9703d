//! How long does a server wait for an answer about the road, and for a map to be loaded?
//!
//! One iteration is one question, or one whole map for the loads. The generated town is always
//! measured; Town03 and Town10HD are when `CAUSEWAY_MAPS_DIR` has them.

#[path = "../tests/common/grid.rs"]
mod grid;

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use roads::nav::NavMesh;
use roads::{LaneTypes, Map, Waypoint};

fn texts() -> Vec<(String, String)> {
    let folder = std::env::var_os("CAUSEWAY_MAPS_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/maps"),
        PathBuf::from,
    );
    let ours = roads::town::build("Town10HD_Opt").map(|text| ("generated".to_owned(), text));
    let theirs = ["Town03", "Town10HD"].into_iter().filter_map(|name| {
        let path = folder.join(format!("{name}.xodr"));
        let text = std::fs::read_to_string(&path).ok();
        if text.is_none() {
            println!("skipped: {path:?} is not there; set CAUSEWAY_MAPS_DIR");
        }
        Some((name.to_owned(), text?))
    });
    ours.into_iter().chain(theirs).collect()
}

/// Places all over the map, and points some metres beside them.
fn questions(map: &Map) -> Vec<(Waypoint, Point3<f64>)> {
    let places = map.generate_waypoints(11.0).expect("a step above 0");
    places
        .into_iter()
        .zip((0..9).cycle())
        .map(|(place, turn)| {
            let (sin, cos) = f64::from(turn).sin_cos();
            let aside = Vector3::new(3.0 * cos, 3.0 * sin, 0.3);
            (place, Point3::from(map.pose(&place).translation.vector + aside))
        })
        .collect()
}

fn queries(criterion: &mut Criterion) {
    for (name, text) in texts() {
        let Ok(map) = Map::parse(&name, &text) else { continue };
        let questions = questions(&map);
        let mut group = criterion.benchmark_group(&name);
        let mut asked = questions.iter().cycle();
        let mut next_question = move || *asked.next().expect("the towns have lanes");
        group.bench_function("nearest", |bencher| {
            bencher.iter_batched(
                &mut next_question,
                |(_, point)| black_box(map.nearest(point, LaneTypes::DRIVING)),
                BatchSize::SmallInput,
            );
        });
        group.bench_function("next 2 m", |bencher| {
            bencher.iter_batched(
                &mut next_question,
                |(place, _)| black_box(map.next(&place, 2.0)),
                BatchSize::SmallInput,
            );
        });
        group.bench_function("pose", |bencher| {
            bencher.iter_batched(
                &mut next_question,
                |(place, _)| black_box(map.pose(&place)),
                BatchSize::SmallInput,
            );
        });
        group.bench_function("generate_waypoints 2 m", |bencher| {
            bencher.iter(|| black_box(map.generate_waypoints(2.0)));
        });
        group.finish();
    }
}

/// A walker's questions: which way to go, and what it stands on.
fn walks(criterion: &mut Criterion) {
    for (name, text) in texts() {
        let Ok(map) = Map::parse(&name, &text) else { continue };
        let Ok(mesh) = NavMesh::new(&map) else { continue };
        let mut group = criterion.benchmark_group(&name);
        let places: Vec<Point3<f64>> =
            (0..400).filter_map(|draw| mesh.random_point(draw)).collect();
        let mut pairs = places.windows(2).cycle();
        group.bench_function("path across town", |bencher| {
            bencher.iter(|| {
                let pair = pairs.next().expect("the pairs repeat");
                black_box(mesh.path(pair[0], pair[1], true))
            });
        });
        let mut asked = places.iter().cycle();
        group.bench_function("nearest polygon", |bencher| {
            bencher.iter(|| black_box(mesh.nearest(*asked.next().expect("the places repeat"))));
        });
        group.finish();
    }
}

fn loads(criterion: &mut Criterion) {
    for (name, text) in texts() {
        let Ok(map) = Map::parse(&name, &text) else { continue };
        let mut group = criterion.benchmark_group(&name);
        group.sample_size(20);
        group.bench_function("parse", |bencher| {
            bencher.iter(|| black_box(Map::parse(&name, &text).is_ok()));
        });
        group.bench_function("ground", |bencher| {
            bencher.iter(|| black_box(roads::mesh::ground(&map)));
        });
        group.bench_function("picture", |bencher| {
            bencher.iter(|| black_box(roads::mesh::render(&map)));
        });
        group.bench_function("navigation mesh", |bencher| {
            bencher.iter(|| black_box(NavMesh::new(&map).is_ok()));
        });
        group.finish();
    }
    criterion.bench_function("write the generated town", |bencher| {
        bencher.iter(|| black_box(roads::town::build("Town10HD_Opt")));
    });
}

/// Loading four times the roads should take about four times as long.
fn growth(_: &mut Criterion) {
    const ROUNDS: usize = 15;
    let mut maps = Vec::new();
    let mut last_s = None;
    for roads in [2_500, 10_000, 40_000] {
        let text: Arc<str> = grid::grid(roads).into();
        let best_s = (0..ROUNDS).map(|_| {
            let started = Instant::now();
            black_box(Map::parse_shared("grid", Arc::clone(&text)).is_ok());
            started.elapsed().as_secs_f64()
        });
        let best_s = best_s.fold(f64::INFINITY, f64::min);
        let before_kb = resident_kb();
        maps.push(Map::parse_shared("grid", Arc::clone(&text)));
        let grown_kb = resident_kb().saturating_sub(before_kb);
        let times = last_s.map_or_else(String::new, |last_s| {
            format!(", {:.1} times as long as a quarter of them", best_s / last_s)
        });
        println!("parse {roads} roads: {:.2} ms, {grown_kb} kB{times}", best_s * 1e3);
        last_s = Some(best_s);
    }
}

/// Memory of this process that is in use (Linux), 0 elsewhere.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok()).unwrap_or(0)
}

criterion_group!(benches, queries, walks, loads, growth);
criterion_main!(benches);
