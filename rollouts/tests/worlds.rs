//! Goal: what a batch promises whoever trains with it. Method: worlds of a real town, stepped by a
//! driver who follows the points it sees.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, Mutex};

use rollouts::{
    Autoreset, Buffers, Course, EPISODE_COLUMNS, End, Reset, Reward, Shard, Spec, TierKind,
};

fn course(spec: &Spec) -> Arc<Course> {
    type Key = (String, String, usize);
    static MADE: LazyLock<Mutex<BTreeMap<Key, Arc<Course>>>> = LazyLock::new(Mutex::default);
    let key = (spec.town.clone(), spec.task.clone(), spec.agents);
    let mut made = MADE.lock().unwrap();
    let new = || {
        let text = roads::town::build(&spec.town).unwrap();
        let map = Arc::new(roads::Map::parse(&spec.town, &text).unwrap());
        Arc::new(Course::new(spec, map).unwrap())
    };
    Arc::clone(made.entry(key).or_insert_with(new))
}

fn spec(task: &str, worlds: usize) -> Spec {
    Spec {
        task: task.to_owned(),
        town: "Town02".to_owned(),
        worlds,
        normalise: false,
        ..Spec::default()
    }
}

fn column(name: &str) -> usize {
    EPISODE_COLUMNS.iter().position(|known| *known == name).unwrap()
}

/// Steers for a point some metres ahead and keeps a speed that bends allow.
fn follow(spec: &Spec, buffers: &Buffers) -> Vec<f32> {
    let names: Vec<String> =
        spec.observation.columns().into_iter().map(|column| column.name).collect();
    let at = |name: &str| names.iter().position(|known| known == name).unwrap();
    let (x, y, speed) = (at("route.7m.x"), at("route.7m.y"), at("ego.speed"));
    let bend = [at("route.4m.curvature"), at("route.10m.curvature"), at("route.15m.curvature")];
    let rows = buffers.observations.chunks_exact(names.len());
    rows.flat_map(|row| {
        let reach = row[x] * row[x] + row[y] * row[y];
        let angle_rad = (2.0 * 2.85 * row[y] / reach.max(1.0)).atan();
        let sharpest = bend.iter().map(|at| row[*at].abs()).fold(0.01, f32::max);
        let wanted_mps = (2.0 / sharpest).sqrt().min(8.0);
        [angle_rad / 0.6, (wanted_mps - row[speed]).clamp(-1.0, 1.0)]
    })
    .collect()
}

fn run(spec: &Spec, parts: &[std::ops::Range<usize>], steps: usize) -> Vec<Buffers> {
    let course = course(spec);
    let mut shards = Shard::all(spec, &course, parts).unwrap();
    let mut buffers = Buffers::new(spec);
    let mut seen = Vec::new();
    for (shard, part) in shards.iter_mut().zip(parts) {
        shard.show(&mut buffers.of_worlds(part.clone()));
    }
    for _ in 0..steps {
        let actions = follow(spec, &buffers);
        let width = actions.len() / spec.worlds;
        for (shard, part) in shards.iter_mut().zip(parts) {
            let own = &actions[part.start * width..part.end * width];
            shard.step(own, &mut buffers.of_worlds(part.clone())).unwrap();
        }
        seen.push(buffers.clone());
    }
    seen
}

#[test]
fn a_driver_who_follows_the_points_arrives() {
    for (task, tier) in [
        ("corl17-straight", TierKind::Physics),
        ("corl17-one-turn", TierKind::Physics),
        ("lane-keep", TierKind::Physics),
        ("corl17-one-turn", TierKind::Kinematic),
        ("lane-keep", TierKind::Kinematic),
    ] {
        let spec = Spec { tier, autoreset: Autoreset::SameStep, ..spec(task, 16) };
        let seen = run(&spec, std::slice::from_ref(&(0..16)), 900);
        let (mut ended, mut arrived) = (0, 0);
        for buffers in &seen {
            for row in 0..spec.rows() {
                if buffers.terminations[row] + buffers.truncations[row] > 0 {
                    let episode = &buffers.episodes[row * EPISODE_COLUMNS.len()..];
                    ended += 1;
                    arrived += usize::from(episode[column("success")] == 1.0);
                }
            }
        }
        assert!(ended >= 16 && arrived * 10 >= ended * 9, "{task}, {tier:?}: {arrived} of {ended}");
    }
}

#[test]
fn who_leaves_its_lane_may_come_back_where_a_task_says_so() {
    let full_throttle = |task: &str| {
        let tier = TierKind::Kinematic;
        let spec = Spec { tier, autoreset: Autoreset::Disabled, ..spec(task, 16) };
        let mut shard = Shard::new(&spec, &course(&spec), 0..16).unwrap();
        let mut buffers = Buffers::new(&spec);
        for _ in 0..40 {
            shard.step(&[0.1, 1.0].repeat(16), &mut buffers.rows()).unwrap();
            if buffers.terminations.contains(&1) {
                let ended = buffers.terminations.iter().position(|ended| *ended == 1).unwrap();
                let episode = &buffers.episodes[ended * EPISODE_COLUMNS.len()..];
                return Some(episode[column("cause")]);
            }
        }
        None
    };
    assert_eq!(full_throttle("corl17-navigation"), Some(3.0), "it has left its lane");
    assert_ne!(full_throttle("nocrash-empty"), Some(3.0));
}

#[test]
fn equal_seeds_and_actions_give_equal_bytes_however_worlds_are_dealt_out() {
    for tier in [TierKind::Physics, TierKind::Kinematic] {
        equal_bytes(&Spec { tier, hash_every: 1, ..spec("lane-keep", 6) });
    }
}

fn equal_bytes(spec: &Spec) {
    let whole = run(spec, std::slice::from_ref(&(0..6)), 120);
    assert_eq!(whole, run(spec, &[0..1, 1..4, 4..6], 120));
    let fewer = run(&Spec { worlds: 4, ..spec.clone() }, std::slice::from_ref(&(0..4)), 120);
    for (six, four) in whole.iter().zip(&fewer) {
        assert_eq!(six.observations[..four.observations.len()], four.observations);
        assert_eq!(six.rewards[..4], four.rewards);
        assert_eq!(six.hashes[..4], four.hashes);
    }
    let other = Spec { seed: 1, ..spec.clone() };
    assert_ne!(whole, run(&other, std::slice::from_ref(&(0..6)), 120));
}

/// Full throttle straight on leaves every lane before long.
fn crash(shard: &mut Shard, buffers: &mut Buffers, until: usize) -> usize {
    let actions = [0.5, 1.0].repeat(shard.worlds());
    for step in 0..until {
        shard.step(&actions, &mut buffers.rows()).unwrap();
        if buffers.terminations.contains(&1) {
            return step;
        }
    }
    panic!("nobody left the lane")
}

#[test]
fn the_next_episode_begins_in_the_next_step_in_the_same_or_not_by_itself() {
    for autoreset in [Autoreset::NextStep, Autoreset::SameStep, Autoreset::Disabled] {
        let spec = Spec { autoreset, ..spec("lane-keep", 1) };
        let course = course(&spec);
        let mut shard = Shard::new(&spec, &course, 0..1).unwrap();
        let mut buffers = Buffers::new(&spec);
        shard.reset(Some(&[Reset::Seed(5)]), &mut buffers.rows()).unwrap();
        let seed = buffers.seeds[0];
        crash(&mut shard, &mut buffers, 400);
        assert_eq!(buffers.episodes[column("cause")], 3.0, "off route");
        let ended = buffers.clone();
        let mut next = Buffers::new(&spec);
        match autoreset {
            Autoreset::NextStep => {
                assert_eq!(ended.seeds[0], seed);
                shard.step(&[1.0, 1.0], &mut next.rows()).unwrap();
                assert_eq!((next.rewards[0], next.terminations[0], next.ticks[0]), (0.0, 0, 0));
                assert_ne!(next.seeds[0], seed);
            }
            Autoreset::SameStep => {
                assert_ne!(ended.seeds[0], seed);
                assert_ne!(ended.finals, ended.observations);
                shard.step(&[0.0, 0.0], &mut next.rows()).unwrap();
                assert_eq!(next.ticks[0], 2);
            }
            Autoreset::Disabled => {
                let error = shard.step(&[0.0, 0.0], &mut next.rows()).unwrap_err().to_string();
                assert!(error.contains("world 0") && error.contains("reset"), "{error}");
                shard.reset(None, &mut next.rows()).unwrap();
                shard.step(&[0.0, 0.0], &mut next.rows()).unwrap();
            }
        }
    }
}

#[test]
fn a_seed_gives_the_same_episode_again_and_a_mask_leaves_the_others_alone() {
    let spec = spec("corl17-straight", 3);
    let course = course(&spec);
    let mut shard = Shard::new(&spec, &course, 0..3).unwrap();
    let mut buffers = Buffers::new(&spec);
    shard
        .reset(Some(&[Reset::Seed(1), Reset::Seed(2), Reset::Seed(1)]), &mut buffers.rows())
        .unwrap();
    let width = spec.width();
    let row = |buffers: &Buffers, row: usize| {
        buffers.observations[row * width..(row + 1) * width].to_vec()
    };
    assert_eq!(row(&buffers, 0), row(&buffers, 2));
    assert_ne!(row(&buffers, 0), row(&buffers, 1));
    let first = buffers.clone();
    for _ in 0..20 {
        shard.step(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0], &mut buffers.rows()).unwrap();
    }
    let driven = buffers.clone();
    shard.reset(Some(&[Reset::Keep, Reset::Seed(1), Reset::Keep]), &mut buffers.rows()).unwrap();
    assert_eq!(row(&buffers, 1), row(&first, 0));
    assert_eq!((row(&buffers, 0), row(&buffers, 2)), (row(&driven, 0), row(&driven, 2)));
}

#[test]
fn a_fork_goes_on_as_its_origin_and_only_its_own_actions_change_it() {
    let spec = spec("lane-keep", 4);
    let course = course(&spec);
    let mut shard = Shard::new(&spec, &course, 0..4).unwrap();
    let mut buffers = Buffers::new(&spec);
    for _ in 0..10 {
        shard.step(&[0.01, 0.4].repeat(4), &mut buffers.rows()).unwrap();
    }
    let origin = shard.snapshot(0).unwrap();
    for world in 1..4 {
        shard.restore(world, &origin, None).unwrap();
    }
    let width = spec.width();
    let rows = |buffers: &Buffers| -> Vec<Vec<f32>> {
        buffers.observations.chunks_exact(width).map(<[f32]>::to_vec).collect()
    };
    for _ in 0..200 {
        shard.step(&[0.02, 0.4].repeat(4), &mut buffers.rows()).unwrap();
        let rows = rows(&buffers);
        assert!(rows.iter().all(|row| *row == rows[0]));
        assert!(buffers.seeds.iter().all(|seed| *seed == buffers.seeds[0]));
    }
    let mut actions = [0.02, 0.4].repeat(4);
    actions[4] = -0.3;
    for _ in 0..3 {
        shard.step(&actions, &mut buffers.rows()).unwrap();
    }
    let rows = rows(&buffers);
    assert!(rows[0] == rows[1] && rows[1] == rows[3] && rows[2] != rows[0]);
    assert!(shard.restore(9, &origin, None).is_err());
}

#[test]
fn several_agents_share_a_world_until_the_last_has_ended() {
    for tier in [TierKind::Physics, TierKind::Kinematic] {
        share(&Spec { tier, agents: 3, horizon_secs: Some(30.0), ..spec("lane-keep", 2) });
    }
}

fn share(spec: &Spec) {
    let course = course(spec);
    let mut shard = Shard::new(spec, &course, 0..2).unwrap();
    let mut buffers = Buffers::new(spec);
    shard.reset(None, &mut buffers.rows()).unwrap();
    assert_eq!(buffers.alive, [1; 6]);
    // The first agent of the first world leaves its lane; the others stand.
    let actions = [[0.6, 1.0], [0.0, -1.0], [0.0, -1.0], [0.0, -1.0], [0.0, -1.0], [0.0, -1.0]];
    let actions = actions.as_flattened();
    for _ in 0..100 {
        shard.step(actions, &mut buffers.rows()).unwrap();
        if buffers.terminations[0] == 1 {
            break;
        }
    }
    assert_eq!((buffers.terminations[0], buffers.alive[0]), (1, 1));
    shard.step(actions, &mut buffers.rows()).unwrap();
    assert_eq!((buffers.terminations[0], buffers.alive[0]), (0, 0));
    assert!(buffers.observations[..spec.width()].iter().all(|value| *value == 0.0));
    let seed = buffers.seeds[0];
    let mut steps = 0;
    while buffers.seeds[0] == seed {
        shard.step(actions, &mut buffers.rows()).unwrap();
        steps += 1;
        assert!(steps < 400);
    }
    assert_eq!(buffers.alive[..3], [1; 3], "all of them begin anew together");
}

#[test]
fn rewards_and_ends_are_those_that_the_spec_names() {
    let completion = Spec {
        reward: Reward::Named("completion".to_owned()),
        ends: Some(vec![End::Arrived]),
        autoreset: Autoreset::SameStep,
        ..spec("corl17-straight", 8)
    };
    let seen = run(&completion, std::slice::from_ref(&(0..8)), 600);
    let mut ended = 0;
    for buffers in &seen {
        for row in (0..8).filter(|row| buffers.terminations[*row] == 1) {
            let episode = &buffers.episodes[row * EPISODE_COLUMNS.len()..];
            let (sum, cause) = (episode[column("return")], episode[column("cause")]);
            assert!((sum - 1.0).abs() < 0.05 && cause == 1.0, "{sum}, {cause}");
            ended += 1;
        }
    }
    assert!(ended >= 8, "{ended}");
}

#[test]
fn actions_that_are_none_change_nothing() {
    let spec = spec("lane-keep", 2);
    let course = course(&spec);
    let mut shard = Shard::new(&spec, &course, 0..2).unwrap();
    let mut buffers = Buffers::new(&spec);
    shard.step(&[0.0; 4], &mut buffers.rows()).unwrap();
    let before = buffers.clone();
    assert!(shard.step(&[0.0, f32::NAN, 0.0, 0.0], &mut buffers.rows()).is_err());
    assert!(shard.step(&[0.0; 3], &mut buffers.rows()).is_err());
    assert_eq!(buffers, before);
    shard.show(&mut buffers.rows());
    assert_eq!(buffers.observations, before.observations);
}

#[test]
fn worlds_of_rigid_bodies_are_told_as_frames_and_kinematic_ones_are_not() {
    let spec = Spec { hash_every: 1, ..spec("lane-keep", 2) };
    let mut shard = Shard::new(&spec, &course(&spec), 0..2).unwrap();
    let mut buffers = Buffers::new(&spec);
    shard.step(&[0.0; 4], &mut buffers.rows()).unwrap();
    let (frame, cars) = shard.frame(1).unwrap();
    assert_eq!((frame.state_hash, frame.map.name.as_str()), (buffers.hashes[1], "Town02"));
    assert!(cars.len() == 1 && frame.actors.iter().any(|actor| actor.id == cars[0]));
    assert!(shard.frame(2).unwrap_err().to_string().contains("below 2"));
    let tier = TierKind::Kinematic;
    let kinematic = Shard::new(&Spec { tier, ..spec.clone() }, &course(&spec), 0..2).unwrap();
    let error = kinematic.frame(0).err().unwrap().to_string();
    assert!(error.contains("cannot be drawn") && error.contains("tier physics"), "{error}");
}
