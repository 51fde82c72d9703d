//! Goal: worlds with traffic, people and lights keep what a batch promises, and count what is run
//! into. Method: agents who drive for their way without a look at anybody, in both tiers.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::sync::Arc;

use rollouts::{
    Autoreset, Buffers, Course, EPISODE_COLUMNS, End, Observation, Shard, Spec, TierKind,
};
use schemas::ActorKind;

const TIERS: [TierKind; 2] = [TierKind::Kinematic, TierKind::Physics];

fn course(spec: &Spec) -> Arc<Course> {
    let text = roads::town::build(&spec.town).unwrap();
    let map = Arc::new(roads::Map::parse(&spec.town, &text).unwrap());
    Arc::new(Course::new(spec, map).unwrap())
}

fn spec(task: &str, tier: TierKind, worlds: usize) -> Spec {
    Spec {
        task: task.to_owned(),
        town: "Town02".to_owned(),
        tier,
        worlds,
        observation: Observation::Drive,
        normalise: false,
        ..Spec::default()
    }
}

/// Columns by name.
struct Names(Vec<String>);

impl Names {
    fn of(spec: &Spec) -> Self {
        Self(spec.observation.columns().into_iter().map(|column| column.name).collect())
    }

    fn at(&self, name: &str) -> usize {
        self.0.iter().position(|known| known == name).unwrap()
    }
}

/// Steers for a point some metres ahead at a speed, whatever stands there.
fn blindly(spec: &Spec, names: &Names, buffers: &Buffers, speed_mps: f32) -> Vec<f32> {
    let (x, y) = (names.at("route.7m.x"), names.at("route.7m.y"));
    let rows = buffers.observations.chunks_exact(spec.observation.columns().len());
    rows.flat_map(|row| {
        let reach = row[x] * row[x] + row[y] * row[y];
        let angle_rad = (2.0 * 2.85 * row[y] / reach.max(1.0)).atan();
        [angle_rad / 0.6, (speed_mps - row[0]).clamp(-1.0, 1.0)]
    })
    .collect()
}

fn run(spec: &Spec, parts: &[std::ops::Range<usize>], steps: usize) -> Vec<Buffers> {
    let course = course(spec);
    let names = Names::of(spec);
    let mut shards = Shard::all(spec, &course, parts).unwrap();
    let mut buffers = Buffers::new(spec);
    for (shard, part) in shards.iter_mut().zip(parts) {
        shard.show(&mut buffers.of_worlds(part.clone()));
    }
    let mut seen = Vec::new();
    for _ in 0..steps {
        let actions = blindly(spec, &names, &buffers, 6.0);
        for (shard, part) in shards.iter_mut().zip(parts) {
            let own = &actions[part.start * 2..part.end * 2];
            shard.step(own, &mut buffers.of_worlds(part.clone())).unwrap();
        }
        seen.push(buffers.clone());
    }
    seen
}

#[test]
fn others_move_are_seen_and_repeat_to_the_bit_however_worlds_are_dealt_out() {
    for tier in TIERS {
        let spec = Spec { hash_every: 1, ..spec("corl17-traffic", tier, 3) };
        let seen = run(&spec, std::slice::from_ref(&(0..3)), 80);
        assert!(seen == run(&spec, &[0..1, 1..3], 80), "{tier:?}");
        let names = Names::of(&spec);
        let (vehicle, walker) =
            (names.at("partners.0.is_vehicle"), names.at("partners.0.is_walker"));
        let speed = names.at("partners.0.speed.x");
        let (mut vehicles, mut walkers, mut moving) = (0, 0, 0);
        for row in seen.iter().flat_map(|it| it.observations.chunks_exact(names.0.len())) {
            for partner in 0..16 {
                vehicles += usize::from(row[vehicle + partner * 10] == 1.0);
                walkers += usize::from(row[walker + partner * 10] == 1.0);
                moving += usize::from(row[speed + partner * 10].abs() > 0.5);
            }
        }
        println!("{tier:?}: {vehicles} vehicles, {walkers} people, {moving} moving");
        assert!(vehicles > 100 && walkers > 100 && moving > 100, "{tier:?}");
    }
}

#[test]
fn a_fork_among_others_goes_on_as_its_origin() {
    for tier in TIERS {
        let spec = Spec { hash_every: 1, ..spec("nocrash-regular", tier, 2) };
        let mut shard = Shard::new(&spec, &course(&spec), 0..2).unwrap();
        let mut buffers = Buffers::new(&spec);
        for _ in 0..20 {
            shard.step(&[0.0, 0.3].repeat(2), &mut buffers.rows()).unwrap();
        }
        assert_ne!(buffers.hashes[0], buffers.hashes[1]);
        let origin = shard.snapshot(0).unwrap();
        assert!(origin.bytes() > 65 * 128, "others take memory: {} bytes", origin.bytes());
        shard.restore(1, &origin, None).unwrap();
        for _ in 0..60 {
            shard.step(&[0.0, 0.2].repeat(2), &mut buffers.rows()).unwrap();
            assert_eq!(buffers.hashes[0], buffers.hashes[1], "{tier:?}");
        }
    }
}

/// Sums of a column over all episodes that ended.
fn sum(spec: &Spec, seen: &[Buffers], name: &str) -> f32 {
    let column = EPISODE_COLUMNS.iter().position(|known| *known == name).unwrap();
    let rows = seen.iter().flat_map(|buffers| {
        (0..spec.rows())
            .filter(|row| buffers.terminations[*row] + buffers.truncations[*row] > 0)
            .map(|row| buffers.episodes[row * EPISODE_COLUMNS.len() + column])
    });
    rows.sum()
}

#[test]
fn who_looks_at_nobody_runs_into_cars_and_people_and_through_red_lights() {
    for tier in TIERS {
        let blind = Spec {
            cars: Some(30),
            walkers: Some(40),
            horizon_secs: Some(40.0),
            autoreset: Autoreset::SameStep,
            ends: Some(vec![End::Collision]),
            ..spec("nocrash-dense", tier, 12)
        };
        let seen = run(&blind, std::slice::from_ref(&(0..12)), 420);
        let counted = ["collisions_vehicle", "red_lights"].map(|name| sum(&blind, &seen, name));
        println!("{tier:?}: {counted:?} vehicles and lights");
        assert!(counted.iter().all(|count| *count >= 2.0), "{tier:?}: {counted:?}");
    }
}

#[test]
fn a_red_light_ends_an_episode_where_the_spec_says_so() {
    let lights = Spec {
        cars: Some(0),
        walkers: Some(0),
        ends: Some(vec![End::RedLight, End::Arrived]),
        autoreset: Autoreset::SameStep,
        ..spec("corl17-traffic", TierKind::Kinematic, 16)
    };
    let seen = run(&lights, std::slice::from_ref(&(0..16)), 700);
    let column = EPISODE_COLUMNS.iter().position(|known| *known == "cause").unwrap();
    let causes: Vec<f32> = seen
        .iter()
        .flat_map(|it| {
            let ended = (0..16).filter(|row| it.terminations[*row] == 1);
            ended.map(|row| it.episodes[row * EPISODE_COLUMNS.len() + column])
        })
        .collect();
    let red = causes.iter().filter(|cause| **cause == 7.0).count();
    println!("{red} of {} ended by a red light", causes.len());
    assert!(red >= 5 && sum(&lights, &seen, "red_lights") >= red as f32, "{causes:?}");
    let names = Names::of(&lights);
    let red_at = names.at("light.red");
    let reds = seen.iter().flat_map(|it| it.observations.chunks_exact(names.0.len()));
    assert!(reds.filter(|row| row[red_at] == 1.0).count() > 50);
}

#[test]
fn what_a_town_has_no_room_for_is_refused_with_what_it_has() {
    let crowded = Spec { cars: Some(400), ..spec("corl17-traffic", TierKind::Kinematic, 1) };
    let map =
        Arc::new(roads::Map::parse("Town02", &roads::town::build("Town02").unwrap()).unwrap());
    let error = Course::new(&crowded, Arc::clone(&map)).unwrap_err().to_string();
    assert!(error.contains("no room for the cars") && error.contains("at most"), "{error}");
    let many = spec("corl17-traffic", TierKind::Kinematic, 16_384);
    let error = Course::new(&many, map).unwrap_err().to_string();
    assert!(error.contains("262144 agents, cars and people"), "{error}");
}

/// Cars and people of a world beside the agent, and its lights.
fn company(task: &str, town: &str) -> (usize, usize, usize) {
    let spec = Spec { town: town.to_owned(), ..spec(task, TierKind::Physics, 1) };
    let (frame, _) = Shard::new(&spec, &course(&spec), 0..1).unwrap().frame(0).unwrap();
    let count = |kind| frame.actors.iter().filter(|actor| actor.kind == kind).count();
    (count(ActorKind::Vehicle) - 1, count(ActorKind::Walker), frame.traffic_lights.len())
}

/// The numbers are those of the papers, and their benchmarks' for the second town.
#[test]
fn towns_are_as_full_of_cars_and_people_as_the_benchmarks_have_them() {
    for (task, town, cars, people) in [
        ("corl17-navigation", "Town01", 0, 0),
        ("corl17-traffic", "Town01", 20, 50),
        ("corl17-traffic", "Town02", 15, 50),
        ("nocrash-empty", "Town01", 0, 0),
        ("nocrash-regular", "Town01", 20, 50),
        ("nocrash-regular", "Town02", 15, 50),
        ("nocrash-dense", "Town01", 100, 250),
        ("nocrash-dense", "Town02", 70, 150),
    ] {
        let (found_cars, found_people, lights) = company(task, town);
        println!("{task} in {town}: {found_cars} cars, {found_people} people, {lights} lights");
        // Who finds something in the way is left out.
        assert!((cars * 9 / 10..=cars).contains(&found_cars), "{task}: {found_cars} cars");
        assert!((people * 9 / 10..=people).contains(&found_people), "{task}: {found_people}");
        assert_eq!(lights > 0, cars > 0, "{task}: {lights} lights");
    }
}

/// Episodes that ended, as rows of their numbers.
fn episodes(seen: &[Buffers]) -> Vec<Vec<f32>> {
    let ended = seen.iter().flat_map(|buffers| {
        let rows = buffers.episodes.chunks_exact(EPISODE_COLUMNS.len()).enumerate();
        let over = |row: usize| buffers.terminations[row] + buffers.truncations[row] > 0;
        rows.filter(move |(row, _)| over(*row)).map(|(_, numbers)| numbers.to_vec())
    });
    ended.collect()
}

fn number(episode: &[f32], name: &str) -> f32 {
    episode[EPISODE_COLUMNS.iter().position(|known| *known == name).unwrap()]
}

#[test]
fn a_collision_ends_an_episode_of_nocrash_as_a_failure() {
    for (task, tier, steps) in
        [("nocrash-dense", TIERS[0], 300), ("nocrash-regular", TIERS[1], 500)]
    {
        let own = Spec { autoreset: Autoreset::SameStep, ..spec(task, tier, 8) };
        let ended = episodes(&run(&own, std::slice::from_ref(&(0..8)), steps));
        let hits = |episode: &[f32]| -> f32 {
            let kinds = ["collisions_vehicle", "collisions_walker", "collisions_static"];
            kinds.into_iter().map(|kind| number(episode, kind)).sum()
        };
        let crashed: Vec<&Vec<f32>> = ended.iter().filter(|it| hits(it) > 0.0).collect();
        println!("{tier:?}: {} of {} episodes crashed", crashed.len(), ended.len());
        assert!(crashed.len() >= 2, "{tier:?}: {ended:?}");
        for episode in crashed {
            assert_eq!((number(episode, "cause"), number(episode, "success")), (2.0, 0.0));
            assert!(number(episode, "completion") < 1.0);
        }
        // Nothing but arriving, a collision or the time ends one.
        let causes: Vec<f32> = ended.iter().map(|episode| number(episode, "cause")).collect();
        assert!(causes.iter().all(|cause| [1.0, 2.0, 5.0].contains(cause)), "{causes:?}");
    }
}

#[test]
fn by_corls_own_rule_an_episode_goes_on_after_a_collision() {
    let own = Spec {
        ends: Some(vec![End::Arrived]),
        autoreset: Autoreset::SameStep,
        horizon_secs: Some(120.0),
        ..spec("corl17-traffic", TierKind::Physics, 4)
    };
    let ended = episodes(&run(&own, std::slice::from_ref(&(0..4)), 1_250));
    let hits = |episode: &[f32]| {
        number(episode, "collisions_vehicle") + number(episode, "collisions_walker")
    };
    let causes: Vec<(f32, f32)> = ended.iter().map(|it| (number(it, "cause"), hits(it))).collect();
    println!("causes and collisions: {causes:?}");
    assert!(causes.iter().all(|(cause, _)| [1.0, 5.0].contains(cause)), "{causes:?}");
    assert!(causes.iter().any(|(_, hits)| *hits >= 1.0), "{causes:?}");
    assert!(causes.iter().any(|(cause, _)| *cause == 1.0), "somebody arrives: {causes:?}");
    for episode in &ended {
        assert_eq!(number(episode, "success") == 1.0, number(episode, "cause") == 1.0);
    }
}
