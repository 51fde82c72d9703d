//! Goal: worlds have the weathers that a spec asks for, roads are as slippery as these make them,
//! and all else is as in any other weather. Method: both tiers, with full brakes and with drawn
//! starts.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeSet;
use std::sync::Arc;

use rollouts::{
    Autoreset, Buffers, Course, EPISODE_COLUMNS, End, Reset, Shard, Spec, Task, TierKind,
};
use schemas::Weather;

const TIERS: [TierKind; 2] = [TierKind::Kinematic, TierKind::Physics];

/// Begins at 15 m/s on a straight way.
const FAST: &str = r#"
about = "Straight on, fast."
ends = ["arrived"]
[way]
length_m = [100, 250]
bends_degrees_max = 5
[time]
mean_kmh = 10
more_secs = 10
[start]
speed_mps = [15, 15]
beside_m = 0
turned_rad = 0
"#;

fn spec(task: &str, tier: TierKind, weathers: &[&str]) -> Spec {
    Spec {
        task: task.to_owned(),
        town: "Town02".to_owned(),
        tier,
        normalise: false,
        weathers: weathers.iter().map(|name| (*name).to_owned()).collect(),
        ..Spec::default()
    }
}

fn shard(spec: &Spec, task: Task) -> Shard {
    let text = roads::town::build(&spec.town).unwrap();
    let map = Arc::new(roads::Map::parse(&spec.town, &text).unwrap());
    let course = Arc::new(Course::of_task(spec, task, map).unwrap());
    Shard::new(spec, &course, 0..spec.worlds).unwrap()
}

/// Way in metres until it stands with full brakes.
fn braking_m(tier: TierKind, weather: &str) -> f32 {
    let spec = Spec { decision_ticks: 1, ..spec("fast", tier, &[weather]) };
    let mut shard = shard(&spec, Task::parse("fast", FAST).unwrap());
    let mut buffers = Buffers::new(&spec);
    let mut way_m = 0.0;
    for _ in 0..120 {
        shard.step(&[0.0, -1.0], &mut buffers.rows()).unwrap();
        way_m += buffers.observations[0] * 0.05;
    }
    assert!(buffers.observations[0].abs() < 0.1, "it stands");
    way_m
}

#[test]
fn cars_brake_over_a_longer_way_in_the_rain_in_both_tiers() {
    let share = |tier| {
        let [dry_m, wet_m] = ["ClearNoon", "HardRainNoon"].map(|name| braking_m(tier, name));
        println!("{tier:?}: {dry_m:.1} m dry, {wet_m:.1} m wet");
        wet_m / dry_m
    };
    let shares = TIERS.map(share);
    // Grip of 0.685, and the way while brakes begin to bite.
    assert!(shares.iter().all(|share| (1.25..1.5).contains(share)), "{shares:?}");
    assert!((shares[0] - shares[1]).abs() < 0.1, "{shares:?}");
}

/// By episode seed: number of the weather and pair, of episodes that a time of 0.1 s ends, and the
/// last observations.
fn drawn(tier: TierKind, weathers: &[&str], seeds: u64) -> Vec<(u32, u32, Vec<f32>)> {
    let own = spec("corl17-straight", tier, weathers);
    let spec = Spec { horizon_secs: Some(0.1), autoreset: Autoreset::Disabled, ..own };
    let mut shard = shard(&spec, Task::named("corl17-straight").unwrap());
    let mut buffers = Buffers::new(&spec);
    let column = |name: &str| EPISODE_COLUMNS.iter().position(|known| *known == name).unwrap();
    let episode = |seed: u64| {
        shard.reset(Some(&[Reset::Seed(seed)]), &mut buffers.rows()).unwrap();
        shard.step(&[0.0, 0.0], &mut buffers.rows()).unwrap();
        assert_eq!(buffers.truncations[0], 1);
        let [weather, pair] = ["weather", "pair"].map(|name| buffers.episodes[column(name)] as u32);
        (weather, pair, buffers.observations.clone())
    };
    (0..seeds).map(episode).collect()
}

#[test]
fn each_start_has_one_of_the_weathers_and_nothing_else_depends_on_which() {
    for tier in TIERS {
        let [training, test] = ["training", "test"].map(|name| drawn(tier, &[name], 60));
        let numbers = |episodes: &[(u32, u32, Vec<f32>)]| {
            episodes.iter().map(|(weather, ..)| *weather).collect::<BTreeSet<u32>>()
        };
        assert_eq!(numbers(&training), BTreeSet::from([1, 3, 6, 8]), "{tier:?}");
        assert_eq!(numbers(&test), BTreeSet::from([4, 14]), "{tier:?}");
        let dry = drawn(tier, &["ClearNoon"], 60);
        assert_eq!(numbers(&dry), BTreeSet::from([1]));
        for ((one, two), three) in training.iter().zip(&test).zip(&dry) {
            assert_eq!((one.1, one.1), (two.1, three.1), "{tier:?}: the same pair");
            // A car that stands does so in any weather.
            assert_eq!((&one.2, &one.2), (&two.2, &three.2), "{tier:?}: the same row");
        }
    }
}

#[test]
fn frames_and_hashes_have_the_weather() {
    let noon = spec("lane-keep", TierKind::Physics, &["ClearNoon"]);
    let rain = spec("lane-keep", TierKind::Physics, &["HardRainNoon"]);
    let lane_keep = || Task::named("lane-keep").unwrap();
    let weather = |spec: &Spec| shard(spec, lane_keep()).frame(0).unwrap().0.weather;
    assert_eq!(weather(&noon), Weather::CLEAR_NOON);
    assert_eq!(Some(weather(&rain)), Weather::preset("HardRainNoon"));
    for tier in TIERS {
        let hash = |name: &str| {
            let own = spec("lane-keep", tier, &[name]);
            let spec = Spec { ends: Some(vec![End::Arrived]), hash_every: 1, ..own };
            let mut buffers = Buffers::new(&spec);
            shard(&spec, lane_keep()).step(&[0.0, 0.1], &mut buffers.rows()).unwrap();
            buffers.hashes[0]
        };
        assert_eq!(hash("ClearNoon"), hash("training"), "a task that names none: dry noon");
        assert_ne!(hash("ClearNoon"), hash("HardRainNoon"), "{tier:?}");
    }
}

#[test]
fn weathers_that_are_none_are_refused_with_those_that_there_are() {
    let text = roads::town::build("Town02").unwrap();
    let map = Arc::new(roads::Map::parse("Town02", &text).unwrap());
    for (task, weathers, words) in [
        ("lane-keep", "test", "names no weathers to be tested in"),
        ("corl17-straight", "Snow", "training, test, or ClearNoon"),
    ] {
        let spec = spec(task, TierKind::Kinematic, &[weathers]);
        let error = Course::new(&spec, Arc::clone(&map)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
