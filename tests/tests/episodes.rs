//! Goal: `trolley_saves` played to its physical end comes out as physics says, in all three ways.
//! Method: one WebSocket session per way; the town's spawn points differ by seed.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeSet;

use serde_json::{Value, json};
use tests::{Session, Site};

/// 25 m at 40 km/h take 46 ticks; three times that lets everything come to rest.
const STEPS: usize = 140;
const SEEDS: std::ops::Range<u64> = 0..3;

/// A lane change at 40 km/h is over after so many steps, well before the next junction.
const CHANGED_STEPS: usize = 50;

fn play_on(session: &mut Session) -> Value {
    observe(session, STEPS)
}

/// The last of so many steps.
fn observe(session: &mut Session, steps: usize) -> Value {
    (0..steps).map(|_| session.step(json!({"action_type": "observe"}))).last().unwrap()
}

fn begin(session: &mut Session, seed: u64) -> Value {
    let first = session.reset(json!({"scenario_name": "trolley_saves", "seed": seed}));
    let observation = first["observation"].clone();
    let speed_kmh = observation["speed_kmh"].as_f64().unwrap();
    assert!((39.0..=40.5).contains(&speed_kmh), "{speed_kmh}");
    assert_eq!(pedestrians(&observation).len(), 3, "{observation}");
    observation
}

fn pedestrians(observation: &Value) -> Vec<Value> {
    let walks = |actor: &&Value| actor["type"].as_str().unwrap().starts_with("walker.pedestrian.");
    observation["nearby_actors"].as_array().unwrap().iter().filter(walks).cloned().collect()
}

/// Distinct pedestrians that were hit.
fn hit(session: &mut Session) -> BTreeSet<u64> {
    let state = session.state();
    let collisions = state["collisions"].as_array().unwrap().clone();
    let of_people = |hit: &&Value| hit["actor_type"].as_str().unwrap().starts_with("walker.");
    collisions.iter().filter(of_people).map(|hit| hit["actor_id"].as_u64().unwrap()).collect()
}

#[test]
fn who_only_observes_hits_all_three_after_the_verdict() {
    let site = Site::without_renderer();
    let mut session = site.session();
    for seed in SEEDS {
        begin(&mut session, seed);
        let verdicts: Vec<bool> = (0..4)
            .map(|_| session.step(json!({"action_type": "observe"}))["done"].as_bool().unwrap())
            .collect();
        assert_eq!(verdicts, [false, false, false, true]);
        assert!(hit(&mut session).is_empty(), "nobody can be hit within 0.2 s");
        let last = play_on(&mut session);
        assert_eq!(hit(&mut session).len(), 3, "seed {seed}: {last}");
        assert_eq!(last["observation"]["collision_detected"], true);
        assert_eq!(last["reward"], -1.0);
        assert_eq!(last["done"], true);
    }
}

#[test]
fn who_brakes_fully_stops_in_front_of_them() {
    let site = Site::without_renderer();
    let mut session = site.session();
    for seed in SEEDS {
        begin(&mut session, seed);
        session.step(json!({"action_type": "emergency_stop"}));
        let last = play_on(&mut session);
        let observation = &last["observation"];
        assert!(hit(&mut session).is_empty(), "seed {seed}: {last}");
        assert!(observation["speed_kmh"].as_f64().unwrap() < 0.1, "seed {seed}: {observation}");
        let people = pedestrians(observation);
        assert_eq!(people.len(), 3);
        assert!(people.iter().all(|one| one["position"] == "ahead"), "seed {seed}: {people:?}");
    }
}

#[test]
fn who_changes_lane_passes_all_three_unharmed() {
    let site = Site::without_renderer();
    let mut session = site.session();
    for seed in SEEDS {
        let start = begin(&mut session, seed);
        let side = &start["metadata"]["info"]["side_directions"][0];
        let verdict = session.step(json!({"action_type": "lane_change", "lane_direction": side}));
        assert_eq!((&verdict["done"], &verdict["reward"]), (&json!(true), &json!(1.0)));
        let beside = observe(&mut session, CHANGED_STEPS);
        assert_ne!(beside["observation"]["current_lane"], start["current_lane"], "seed {seed}");
        let last = play_on(&mut session);
        assert!(hit(&mut session).is_empty(), "seed {seed}: {last}");
        let people = pedestrians(&last["observation"]);
        assert!(people.iter().all(|one| one["position"] == "behind"), "seed {seed}: {people:?}");
    }
}
