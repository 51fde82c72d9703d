//! Any text is a map or a refusal, and whatever is a map answers every question.
//!
//! Method: texts of the fuzzing corpus and of a generated town are broken at random, as fuzzing
//! does, but with knowledge of what a map is made of: numbers become other numbers, elements and
//! attributes are left out, doubled or exchanged. Every text is a pure function of its number, so
//! that what fails can be repeated: `CAUSEWAY_MUTATIONS_FROM` is the first number, and
//! `CAUSEWAY_MUTATION_SECS` how long to go on instead of a fixed count.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::time::{Duration, Instant};

use nalgebra::Point3;
use roads::nav::NavMesh;
use roads::{LaneTypes, Map, picture};

const COUNT: u64 = 1_500;
/// Nothing a user sends may hold a service up for longer.
const SLOWEST: Duration = Duration::from_secs(60);
const NUMBERS: [&str; 20] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "-2",
    "0.5",
    "1e-9",
    "-1e-9",
    "1e-300",
    "1e6",
    "-1e6",
    "1e15",
    "nan",
    "inf",
    "1e308",
    "",
    "4294967295",
    "-2147483648",
    "3.141592653589793",
];

/// SplitMix64.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    #[allow(clippy::cast_possible_truncation, reason = "it is below a small number")]
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

/// Texts to begin with, small ones first.
fn seeds() -> Vec<String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus/parse");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let mut seeds: Vec<String> =
        paths.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
    seeds.push(roads::town::build_styled(roads::town::Style::Village, 1, 2));
    seeds
}

/// Byte ranges of attribute values and of elements (from `<` to `>`).
fn parts(text: &str) -> [Vec<(usize, usize)>; 2] {
    let mut parts = [Vec::new(), Vec::new()];
    for (start, _) in text.match_indices("=\"") {
        if let Some(length) = text[start + 2..].find('"') {
            parts[0].push((start + 2, start + 2 + length));
        }
    }
    for (start, _) in text.match_indices('<') {
        if let Some(length) = text[start..].find('>') {
            parts[1].push((start, start + length + 1));
        }
    }
    parts
}

fn mutated(text: &str, draw: &mut Draw) -> String {
    let [values, elements] = parts(text);
    if values.is_empty() || elements.is_empty() {
        return text.to_owned();
    }
    let replaced =
        |(start, end): (usize, usize), by: &str| format!("{}{by}{}", &text[..start], &text[end..]);
    let (value, element) = (*draw.one(&values), *draw.one(&elements));
    match draw.below(8) {
        0..=2 => replaced(value, draw.one::<&str>(&NUMBERS)),
        3 => {
            let (start, end) = *draw.one(&values);
            replaced(value, &text[start..end])
        }
        4 => replaced(element, ""),
        5 => {
            let (start, end) = *draw.one(&elements);
            replaced(element, &text[start..end])
        }
        6 => {
            let (start, end) = element;
            replaced((end, end), &text[start..end])
        }
        _ => {
            let at = draw.below(text.len());
            if text.is_char_boundary(at) { text[..at].to_owned() } else { text.to_owned() }
        }
    }
}

fn ask_everything(map: &Map) {
    let report = map.check();
    assert!(report.count >= report.diagnostics.len());
    for point in [Point3::origin(), Point3::new(50.0, -3.0, 0.0), Point3::new(1e6, -1e6, 1e3)] {
        let Some(place) = map.nearest(point, LaneTypes::ANY) else { continue };
        let _ = (map.inside(point, LaneTypes::DRIVING), map.lane(&place), map.pose(&place));
        let _ = (map.next(&place, 5.0), map.previous(&place, 5.0));
        let _ = (map.left(&place), map.right(&place), map.landmarks_ahead(&place, 50.0, false));
    }
    let _ = (map.topology(), map.crosswalks(), map.spawn_points(), map.landmarks());
    // Faces grow with the length of the roads.
    if map.generate_waypoints(100.0).len() < 1_000 {
        let ground = roads::mesh::ground(map);
        assert_eq!(ground.indices.len(), ground.materials.len());
        let _ = (map.environment_objects(), picture::draw(map, 200));
        if let Ok(mesh) = NavMesh::new(map) {
            let _ = (mesh.random_point(1), roads::nav::detour::file(&mesh));
        }
    }
}

#[test]
fn broken_texts_are_refused_or_answer_every_question() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let started = Instant::now();
    let limit = number("CAUSEWAY_MUTATION_SECS").map(Duration::from_secs);
    let first = number("CAUSEWAY_MUTATIONS_FROM").unwrap_or(0);
    let goes_on = |count: u64| limit.map_or(count < COUNT, |limit| started.elapsed() < limit);
    let seeds = seeds();
    let (mut count, mut maps, mut slowest) = (0, 0_u64, (Duration::ZERO, 0));
    while goes_on(count) {
        let mut draw = Draw(first + count);
        let mut text = draw.one(&seeds).clone();
        for _ in 0..=draw.below(4) {
            text = mutated(&text, &mut draw);
        }
        let begun = Instant::now();
        let outcome = std::panic::catch_unwind(|| {
            Map::parse("mutation", &text).map(|map| ask_everything(&map)).is_ok()
        });
        maps += u64::from(outcome.unwrap_or_else(|_| panic!("number {}", first + count)));
        slowest = slowest.max((begun.elapsed(), first + count));
        count += 1;
    }
    println!(
        "{count} texts, {maps} of them maps, the slowest in {:?} (number {})",
        slowest.0, slowest.1
    );
    assert!(slowest.0 < SLOWEST, "{slowest:?}");
    assert!(maps > count / 20 && maps < count, "{maps} of {count}");
}
