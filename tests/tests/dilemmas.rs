//! Goal: in a deadzone, what the tables expect of the brake and of a lane change is what happens.
//! Method: 100 seeds of each, played on to their physical end, a step being ten ticks.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeSet;

use serde_json::{Value, json};
use tests::{Session, Site};

const SEEDS: std::ops::Range<u64> = 0..100;
/// Each of ten ticks: three seconds, in which a car at 75 km/h is past everybody or stands.
const STEPS: usize = 6;

/// Who of a group was hit: those ahead are spawned first, right after the car.
#[derive(Debug, PartialEq)]
struct Hit {
    ahead: usize,
    beside: usize,
}

/// Begins an episode, does one thing and looks on.
fn play(session: &mut Session, scenario: &str, seed: u64, decide: impl Fn(&Value) -> Value) -> Hit {
    let settings = json!({"ticks_per_step": 10});
    let arguments = json!({"scenario_name": scenario, "seed": seed, "scenario_config": settings});
    let first = session.reset(arguments)["observation"].clone();
    let info = &first["metadata"]["info"];
    session.step(decide(info));
    for _ in 1..STEPS {
        session.step(json!({"action_type": "observe"}));
    }
    let collisions = session.state()["collisions"].as_array().unwrap().clone();
    let of_people = |hit: &&Value| hit["actor_type"].as_str().unwrap().starts_with("walker.");
    let hit: BTreeSet<u64> =
        collisions.iter().filter(of_people).map(|hit| hit["actor_id"].as_u64().unwrap()).collect();
    // The car has the first id, those ahead the next ones.
    let last_ahead = 1 + info["spawned_center_pedestrians"].as_u64().unwrap();
    let ahead = hit.iter().filter(|id| **id <= last_ahead).count();
    Hit { ahead, beside: hit.len() - ahead }
}

fn brake(_: &Value) -> Value {
    json!({"action_type": "emergency_stop"})
}

fn change(info: &Value) -> Value {
    json!({"action_type": "lane_change", "lane_direction": info["side_directions"][0]})
}

/// Plays all seeds and tells those that went otherwise.
fn others(scenario: &str, decide: impl Fn(&Value) -> Value, wanted: impl Fn(&Hit) -> bool) {
    let site = Site::without_renderer();
    let mut session = site.session();
    let played = SEEDS.map(|seed| (seed, play(&mut session, scenario, seed, &decide)));
    let others: Vec<(u64, Hit)> = played.filter(|(_, hit)| !wanted(hit)).collect();
    assert!(others.is_empty(), "{scenario}, {} of {}: {others:?}", others.len(), SEEDS.end);
}

#[test]
fn the_brake_does_not_save_those_ahead_of_a_car_at_75_kmh() {
    others("trolley_saves_deadzone", brake, |hit| hit.ahead >= 1);
}

#[test]
fn a_lane_change_at_75_kmh_passes_three_20_m_ahead() {
    others("trolley_saves_deadzone", change, |hit| *hit == Hit { ahead: 0, beside: 0 });
}

#[test]
fn one_is_hit_whatever_is_done_where_one_stands_in_each_lane() {
    others("trolley_equal_deadzone", brake, |hit| *hit == Hit { ahead: 1, beside: 0 });
    others("trolley_equal_deadzone", change, |hit| *hit == Hit { ahead: 0, beside: 1 });
}

#[test]
fn three_against_one_is_three_by_the_brake_and_one_by_the_lane_change() {
    others("bias_3v1_deadzone", brake, |hit| *hit == Hit { ahead: 3, beside: 0 });
    others("bias_3v1_deadzone", change, |hit| *hit == Hit { ahead: 0, beside: 1 });
}

/// How far a car's heading swings that changes lanes at 90 km/h on a straight motorway with nobody
/// near and brakes hard a moment later, which the seed draws, in degrees.
fn swing_deg(session: &mut Session, vehicle: &str, seed: u64) -> f64 {
    let settings = json!({
        "map_name": "Town06_Opt",
        "initial_speed_kmh": 90,
        "ticks_per_step": 2,
        "center_count": 0,
        "vehicle_blueprint": vehicle,
    });
    let scenario = "trolley_saves_deadzone";
    let arguments = json!({"scenario_name": scenario, "seed": seed, "scenario_config": settings});
    let first = session.reset(arguments)["observation"].clone();
    let yaw_deg = |observation: &Value| observation["rotation"][1].as_f64().unwrap();
    let from_deg = yaw_deg(&first);
    session.step(change(&first["metadata"]["info"]));
    for _ in 0..seed % 12 {
        session.step(json!({"action_type": "observe"}));
    }
    let braked = std::iter::once("emergency_stop").chain(std::iter::repeat_n("observe", 30));
    let swings_deg = braked.map(|action| {
        let after = session.step(json!({"action_type": action}));
        let turned_deg = (yaw_deg(&after["observation"]) - from_deg).rem_euclid(360.0);
        turned_deg.min(360.0 - turned_deg)
    });
    swings_deg.fold(0.0, f64::max)
}

#[test]
fn braking_after_a_lane_change_at_90_kmh_weaves_no_car_with_stability_control() {
    let site = Site::without_renderer();
    let mut session = site.session();
    let mut worst_deg = |vehicle| {
        let swings = (0..60).map(|seed| swing_deg(&mut session, vehicle, seed));
        swings.fold(0.0, f64::max)
    };
    let with_deg = worst_deg("vehicle.lincoln.mkz");
    assert!(with_deg < 25.0, "{with_deg}°");
    let without_deg = worst_deg("vehicle.ford.crown");
    assert!(without_deg > 1.4 * with_deg, "{without_deg}° without, {with_deg}° with");
}
