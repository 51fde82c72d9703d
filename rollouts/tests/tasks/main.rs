//! Goal: every task can be done by a driver who looks where it goes, and not by one who does
//! nothing. Method: the first episodes of a town that has the task, in worlds of both tiers.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod planner;

use std::sync::Arc;

use planner::Planner;
use rollouts::{
    Autoreset, Buffers, Course, EPISODE_COLUMNS, Observation, Shard, Spec, TASKS, TierKind,
};

const KEEPS: Planner = Planner { beside_m: &[0.0], stops: false };
const PASSES: Planner = Planner { beside_m: &[0.0, 3.4], stops: false };
const PARKS: Planner = Planner { beside_m: &[0.0], stops: true };

/// A task, a town that has it, who does it, and the share of episodes in which that must arrive.
const DONE: [(&str, &str, Planner, f32); 13] = [
    ("lane-keep", "Town02", KEEPS, 0.9),
    ("corl17-straight", "Town02", KEEPS, 0.9),
    ("corl17-one-turn", "Town02", KEEPS, 0.9),
    ("corl17-navigation", "Town02", KEEPS, 0.9),
    ("corl17-traffic", "Town02", KEEPS, 0.0),
    ("nocrash-empty", "Town02", KEEPS, 0.9),
    ("nocrash-regular", "Town02", KEEPS, 0.0),
    ("nocrash-dense", "Town02", KEEPS, 0.0),
    ("unprotected-left", "Town05", KEEPS, 0.6),
    ("overtake", "Town02", PASSES, 0.6),
    ("merge", "Town04", KEEPS, 0.6),
    ("roundabout", "Town03", KEEPS, 0.6),
    ("parking", "Town02", PARKS, 0.8),
];

fn spec(task: &str, town: &str, tier: TierKind) -> Spec {
    Spec {
        task: task.to_owned(),
        town: town.to_owned(),
        tier,
        worlds: 12,
        observation: Observation::Drive,
        autoreset: Autoreset::Disabled,
        normalise: false,
        ..Spec::default()
    }
}

fn course(spec: &Spec) -> Arc<Course> {
    let text = roads::town::build(&spec.town).unwrap();
    let map = Arc::new(roads::Map::parse(&spec.town, &text).unwrap());
    Arc::new(Course::new(spec, map).unwrap())
}

/// Causes of the first episode of each world, 1 for one that arrived.
fn causes(spec: &Spec, course: &Arc<Course>, act: impl Fn(&[f32]) -> Vec<f32>) -> Vec<f32> {
    let column = EPISODE_COLUMNS.iter().position(|known| *known == "cause").unwrap();
    let one = Spec { worlds: 1, ..spec.clone() };
    let episode = |world: usize| {
        let own = Spec { seed: world as u64, ..one.clone() };
        let mut shard = Shard::new(&own, course, 0..1).unwrap();
        let mut buffers = Buffers::new(&own);
        shard.show(&mut buffers.rows());
        while buffers.terminations[0] + buffers.truncations[0] == 0 {
            shard.step(&act(&buffers.observations), &mut buffers.rows()).unwrap();
        }
        buffers.episodes[column]
    };
    (0..spec.worlds).map(episode).collect()
}

/// The share of episodes in which a car may roll to its goal by itself: some ways are straight,
/// and some begin at 10 m/s.
fn coasts(task: &str) -> f32 {
    if task == "lane-keep" { 0.1 } else { 0.0 }
}

fn arrived(causes: &[f32]) -> f32 {
    causes.iter().filter(|cause| **cause == 1.0).count() as f32 / causes.len() as f32
}

fn is_done(task: &str, tier: TierKind) {
    let (task, town, planner, share) = DONE.into_iter().find(|(name, ..)| *name == task).unwrap();
    let spec = spec(task, town, tier);
    let course = course(&spec);
    let idle = causes(&spec, &course, |_| vec![0.0, 0.0]);
    let driven = causes(&spec, &course, |seen| planner.act(&spec, seen));
    println!("{task} in {town}, {tier:?}, {} pairs: {driven:?}", course.pair_count());
    assert!(arrived(&idle) <= coasts(task), "{task}: nobody drives there by itself: {idle:?}");
    assert!(arrived(&driven) >= share, "{task}: {driven:?}");
}

#[test]
fn every_task_has_a_driver() {
    let names = TASKS.map(|(name, _)| name);
    assert_eq!(names, DONE.map(|(name, ..)| name));
}

macro_rules! done {
    ($($name:ident: $task:literal, $tier:ident;)*) => {
        $(#[test] fn $name() { is_done($task, TierKind::$tier); })*
    };
}

done! {
    lane_keep: "lane-keep", Kinematic;
    straight: "corl17-straight", Kinematic;
    one_turn: "corl17-one-turn", Kinematic;
    navigation: "corl17-navigation", Kinematic;
    nocrash_empty: "nocrash-empty", Kinematic;
    unprotected_left: "unprotected-left", Kinematic;
    overtake: "overtake", Kinematic;
    merge: "merge", Kinematic;
    roundabout: "roundabout", Kinematic;
    parking: "parking", Kinematic;
    overtake_with_rigid_bodies: "overtake", Physics;
    merge_with_rigid_bodies: "merge", Physics;
    roundabout_with_rigid_bodies: "roundabout", Physics;
    parking_with_rigid_bodies: "parking", Physics;
}
