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

/// A lane that loses 0.4 m of its width in each metre: 3 m at the first row, 1.4 m at the sixth.
#[test]
fn every_row_of_a_group_stands_within_the_lane_where_it_is() {
    let text = "<OpenDRIVE><header/><road id=\"1\" length=\"16\" junction=\"-1\"><planView>\
        <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"16\"><line/></geometry></planView>\
        <lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center><right>\
        <lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"7\" b=\"-0.4\" c=\"0\" d=\"0\"/>\
        </lane></right></laneSection></lanes></road></OpenDRIVE>";
    let map = roads::Map::parse("narrows", text).unwrap();
    let lanes = Lanes::new(&map);
    let at = lanes.under(Vec3::new(10.0, -1.5, 0.0)).unwrap();
    let mut group = Vec::new();
    walkers_abreast(lanes, at, 24, &mut SplitMix64::new(7), &mut group).unwrap();
    assert_eq!(group.len(), 24);
    for walker in &group {
        let at_m = walker.world_from_actor.translation.vector;
        let width_m = 7.0 - 0.4 * at_m.x;
        assert!((-width_m..0.0).contains(&at_m.y), "{at_m:?} on a lane {width_m} m wide");
    }
}
