//! Damaged maps: whatever a seed makes of a good text is a map or a refusal, never a panic, an
//! endless loop or gigabytes of memory, and whatever is a map can be asked and drawn.
//!
//! A short round runs with the other tests. `CAUSEWAY_MUTATION_SECONDS=600` runs for so long, and
//! `CAUSEWAY_MUTATION_SEED=n` begins with another seed; a failure names its seed, and
//! `CAUSEWAY_MUTATION_CASE=seed` writes that text to standard output and runs it alone.

#[path = "mutation/mutate.rs"]
mod mutate;
#[path = "mutation/watch.rs"]
mod watch;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use mutate::{Draws, damaged};
use nalgebra::Point3;
use roads::nav::NavMesh;
use roads::{LaneTypes, Map, mesh, picture};
use watch::{Watch, forget_peak, resident_bytes};

/// Cases of the short round.
const CASES: u64 = 600;
/// One case of so many begins with a whole town, the others with a small map.
const TOWN_EVERY: usize = 24;
/// Most memory one case may add, in bytes.
const CASE_MAX_BYTES: u64 = 1_500_000_000;

struct Texts {
    small: Vec<String>,
    towns: Vec<String>,
}

impl Texts {
    fn new() -> Self {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus/parse");
        let mut paths: Vec<_> = std::fs::read_dir(folder)
            .expect("the corpus")
            .flatten()
            .map(|entry| entry.path())
            .collect();
        paths.sort();
        Self {
            small: paths
                .iter()
                .map(|path| std::fs::read_to_string(path).expect("readable"))
                .collect(),
            towns: ["Town02", "Town03", "Town07"]
                .iter()
                .map(|name| roads::town::build(name).expect("ours"))
                .collect(),
        }
    }

    fn case(&self, seed: u64) -> String {
        let mut draws = Draws::new(seed);
        let from = if draws.below(TOWN_EVERY) == 0 { &self.towns } else { &self.small };
        let text = &from[draws.below(from.len())];
        damaged(text, &mut draws)
    }
}

/// Everything that can be asked of a map, and everything that is built from one.
fn ask(map: &Map) {
    let report = map.check();
    assert!(report.count >= report.diagnostics.len());
    for point in [Point3::origin(), Point3::new(50.0, -3.0, 0.0), Point3::new(1e6, -1e6, 1e3)] {
        let Some(place) = map.nearest(point, LaneTypes::ANY) else { continue };
        let _ = (map.inside(point, LaneTypes::DRIVING), map.lane(&place), map.pose(&place));
        let _ = (map.next(&place, 5.0), map.previous(&place, 5.0), map.next(&place, 1e5));
        let _ = (map.left(&place), map.right(&place), map.landmarks_ahead(&place, 50.0, false));
    }
    for spawn in map.spawn_points() {
        assert!(spawn.translation.vector.iter().all(|v| v.is_finite()), "{spawn}");
    }
    let _ = (map.topology(), map.crosswalks(), map.environment_objects(), map.bounds());
    let _ = map.generate_waypoints(2.0);
    let ground = mesh::ground(map);
    assert_eq!(ground.indices.len(), ground.materials.len());
    drop(ground);
    let _ = mesh::render(map);
    if let Ok(mesh) = NavMesh::new(map) {
        let _ = (mesh.random_point(7), mesh.nearest(Point3::origin()));
    }
    let _ = picture::draw(map, 300);
}

struct Found {
    maps: u64,
    cases: u64,
    largest: (u64, u64),
    slowest: (Duration, u64),
}

/// Whether the text is a map; a panic names the seed.
fn run(seed: u64, text: &str, found: &mut Found) {
    forget_peak();
    let (before_bytes, started) = (resident_bytes("VmRSS:"), Instant::now());
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let map = Map::parse("damaged", text);
        map.iter().for_each(ask);
        map.is_ok()
    }));
    let grown_bytes = resident_bytes("VmHWM:").saturating_sub(before_bytes);
    found.maps += u64::from(outcome.unwrap_or_else(|_| panic!("seed {seed}")));
    found.cases += 1;
    found.largest = found.largest.max((grown_bytes, seed));
    found.slowest = found.slowest.max((started.elapsed(), seed));
    assert!(grown_bytes < CASE_MAX_BYTES, "seed {seed}: {grown_bytes} bytes");
}

fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
fn damaged_maps_are_read_or_refused_in_bounded_time_and_memory() {
    let (texts, watch) = (Texts::new(), Watch::new());
    let mut found = Found { maps: 0, cases: 0, largest: (0, 0), slowest: (Duration::ZERO, 0) };
    if let Some(seed) = setting("CAUSEWAY_MUTATION_CASE") {
        let text = texts.case(seed);
        println!("{text}");
        watch.begin(format!("seed {seed}"));
        return run(seed, &text, &mut found);
    }
    let first = setting("CAUSEWAY_MUTATION_SEED").unwrap_or(0);
    let limit = setting("CAUSEWAY_MUTATION_SECONDS").map(Duration::from_secs);
    let started = Instant::now();
    for seed in first.. {
        let done = match limit {
            Some(limit) => started.elapsed() > limit,
            None => found.cases >= CASES,
        };
        if done {
            break;
        }
        watch.begin(format!("seed {seed}"));
        run(seed, &texts.case(seed), &mut found);
    }
    let Found { maps, cases, largest, slowest } = found;
    println!("{maps} maps of {cases} texts in {:?}", started.elapsed());
    println!("most memory: {} MB (seed {}); ", largest.0 / 1_000_000, largest.1);
    println!("most time: {:?} (seed {})", slowest.0, slowest.1);
    // Refusals alone would try nothing behind the reader.
    assert!(maps * 4 > cases, "{maps} of {cases} texts are maps");
}
