use serde_json::Value;

use super::*;
use crate::scenario::{Profile, registry};

const SEEDS: u64 = 100;
/// Towns in which no road has two lanes of one direction.
const NARROW: [&str; 3] = ["Town01", "Town02", "Town07"];

/// All towns, each once.
fn towns() -> impl Iterator<Item = roads::Map> {
    let names = roads::town::names().filter(|name| !name.ends_with("_Opt"));
    names.map(|name| roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap())
}

/// Every name that stands for itself, and every dilemma's deadzone.
fn scenarios() -> Vec<String> {
    let micro = registry::NAMED.into_iter().filter(|name| name.starts_with("trolley_micro_"));
    let deadzones = micro.map(|name| format!("{name}_deadzone"));
    registry::NAMED.into_iter().map(str::to_owned).chain(deadzones).collect()
}

/// Whether a lane beside the ego's is part of a situation.
fn needs_a_lane_beside(name: &str) -> bool {
    let alone = ["maze_navigation", "free_roam", "trolley_micro_self_sacrifice"];
    let crossed = ["pedestrian_crosses", "pedestrian_hesitates", "crowd_crosses"];
    !alone.iter().chain(&crossed).any(|alone| name.starts_with(alone))
}

/// The most that the lane of a start turns within the straight part, radians.
fn turn_rad(lanes: Lanes<'_>, place: Place) -> f64 {
    let turns = (1..=8).map(|step| {
        let there = lanes.ahead(place, STRAIGHT_M * f64::from(step) / 8.0).unwrap();
        lanes.turn_rad(place, there).abs()
    });
    turns.fold(0.0, f64::max)
}

/// Whether the lanes that an episode says it has lie beside its start, and at least one of them.
fn has_its_lanes(lanes: Lanes<'_>, place: Place, info: &Value) -> bool {
    let (left, right) = (lanes.left(place).is_some(), lanes.right(place).is_some());
    match info["side_directions"].as_array() {
        Some(sides) => {
            let beside = |side: &Value| if side == "left" { left } else { right };
            !sides.is_empty() && sides.iter().all(beside)
        }
        None => {
            let told = (info["lane_left"] == true, info["lane_right"] == true);
            told == (left, right) && (left || right) && info["topology_valid"] == true
        }
    }
}

#[test]
fn every_start_in_every_town_is_straight_and_has_the_lanes_it_needs() {
    for map in towns() {
        let lanes = Lanes::new(&map);
        for name in scenarios() {
            let needs_lanes = needs_a_lane_beside(&name);
            let mut scenario = registry::build(&name, Profile::Documented).unwrap();
            for seed in 0..SEEDS {
                let at = format!("{name} in {}, seed {seed}", map.name());
                let begun = scenario.reset(seed, &map);
                if needs_lanes && NARROW.contains(&map.name()) {
                    assert!(begun.is_err(), "{at}: there is no lane beside");
                    continue;
                }
                let ego = begun.unwrap_or_else(|error| panic!("{at}: {error}")).ego;
                let place = lanes.under(ego.world_from_actor.translation.vector).unwrap();
                let turn_rad = turn_rad(lanes, place);
                assert!(turn_rad <= STRAIGHT_RAD[0], "{at}: {turn_rad} rad");
                let info = Value::Object(scenario.info());
                assert!(!needs_lanes || has_its_lanes(lanes, place, &info), "{at}: {info}");
            }
        }
    }
}
