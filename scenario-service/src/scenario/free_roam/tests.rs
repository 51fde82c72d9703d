use schemas::carla::mirror_y;
use serde_json::json;

use super::*;
use crate::scenario::registry;
use crate::testing;

fn begun(config: Value, seed: u64) -> (FreeRoam, WorldSpec) {
    let mut scenario = FreeRoam::new("free_roam", None, (0, 0), Profile::Documented);
    let mut overrides = Overrides::new(config.as_object().unwrap());
    scenario.configure(&mut overrides).unwrap();
    let spec = scenario.reset(seed, &testing::map()).unwrap();
    (scenario, spec)
}

fn facts(step_count: u64, things_hit: u32, goal_distance_m: f64) -> Facts {
    let goal_distance_m = Some(goal_distance_m as f32);
    Facts { step_count, things_hit, goal_distance_m, ..Facts::default() }
}

#[test]
fn the_goal_lies_within_the_distances_asked_for() {
    for seed in 0..5 {
        let config = json!({ "route_distance_min": 120, "route_distance_max": 200 });
        let (scenario, spec) = begun(config, seed);
        let to_goal_m = scenario.goal_m().unwrap() - spec.ego.world_from_actor.translation.vector;
        assert!((120.0..=200.0).contains(&to_goal_m.xy().norm()), "{to_goal_m}");
        assert_eq!(scenario.info()["route_distance_fits"], true);
    }
    let (far, spec) =
        begun(json!({ "route_distance_min": 50_000, "route_distance_max": 60_000 }), 1);
    let to_goal_m = far.goal_m().unwrap() - spec.ego.world_from_actor.translation.vector;
    assert!(to_goal_m.norm() > 100.0, "the farthest is taken: {to_goal_m}");
    assert_eq!(far.info()["route_distance_fits"], false, "and said to be none of those");
}

#[test]
fn a_goal_given_in_carlas_frame_is_the_goal() {
    let config = json!({ "random_goal": false, "goal_location": [10.0, 20, 0.5] });
    let (scenario, _) = begun(config, 1);
    assert_eq!(scenario.goal_m(), Some(mirror_y(Vec3::new(10.0, 20.0, 0.5))));
    let mut scenario = FreeRoam::new("free_roam", None, (0, 0), Profile::Documented);
    for wrong in [json!([1, 2]), json!("x"), json!([1, 2, "3"]), json!([1e9, 0, 0])] {
        let config = json!({ "goal_location": wrong });
        let mut overrides = Overrides::new(config.as_object().unwrap());
        assert!(scenario.configure(&mut overrides).is_err(), "{wrong}");
    }
}

#[test]
fn a_clean_run_earns_its_progress_and_the_arrival() {
    let (mut scenario, _) = begun(json!({}), 3);
    let total_m = scenario.episode.total_m;
    let half = scenario.on_frame(&facts(1, 0, total_m / 2.0));
    assert!((half.reward - 0.49).abs() < 1e-5, "{}", half.reward);
    assert_eq!(half.done, None);
    let there = scenario.on_frame(&facts(2, 0, 0.0));
    assert!((there.reward - 10.49).abs() < 1e-5, "{}", there.reward);
    assert_eq!(there.done, Some(DoneReason::GoalReached));
    let (mut scenario, _) = begun(json!({}), 3);
    let crash = scenario.on_frame(&facts(1, 1, total_m));
    assert!((crash.reward + 5.01).abs() < 1e-5, "{}", crash.reward);
    assert_eq!(crash.done, Some(DoneReason::Collision));
    let (mut scenario, _) = begun(json!({}), 3);
    let late = scenario.on_frame(&facts(500, 0, total_m));
    assert_eq!((late.done, late.truncated), (Some(DoneReason::MaxSteps), true));
}

#[test]
fn who_does_nothing_pays_a_hundredth_a_step_and_five_by_the_last() {
    let (mut scenario, _) = begun(json!({}), 3);
    let total_m = scenario.episode.total_m;
    let steps = (1..=500).map(|step| scenario.on_frame(&facts(step, 0, total_m)));
    let told: Vec<Progress> = steps.collect();
    let sum: f64 = told.iter().map(|step| step.reward).sum();
    assert!((sum + 5.0).abs() < 1.0e-6, "{sum}");
    assert!(told[..499].iter().all(|step| step.done.is_none()));
    assert_eq!(told[499].done, Some(DoneReason::MaxSteps));
}

#[test]
fn cars_and_pedestrians_stand_apart_and_the_cars_drive() {
    let config = json!({ "num_npc_vehicles": 8, "num_pedestrians": 12 });
    let (scenario, spec) = begun(config, 5);
    let count = |prefix: &str| {
        spec.others.iter().filter(|other| other.blueprint.starts_with(prefix)).count()
    };
    assert_eq!(count("vehicle."), 8);
    // One that finds no free place in ten tries is left out.
    assert!((9..=12).contains(&count("walker.")), "{}", count("walker."));
    assert_eq!(scenario.info()["spawned_pedestrians"], count("walker."));
    let all: Vec<Vec3> = std::iter::once(&spec.ego)
        .chain(&spec.others)
        .map(|placement| placement.world_from_actor.translation.vector)
        .collect();
    for (index, a) in all.iter().enumerate() {
        assert!(all.iter().skip(index + 1).all(|b| (a - b).norm() > 1.4));
    }
    let replies: Vec<schemas::CommandReply> =
        (0..22).map(|id| Ok(schemas::ActorId::new(100 + id))).collect();
    assert_eq!(spec.opening(&replies).len(), 8 + count("walker."), "each is told once");
}

#[test]
fn people_walk_unless_they_are_told_to_stand_or_the_profile_is_literal() {
    let walkers = |config: Value, profile: Profile| {
        let mut scenario = FreeRoam::new("free_roam", None, (0, 4), profile);
        let mut overrides = Overrides::new(config.as_object().unwrap());
        scenario.configure(&mut overrides).unwrap();
        let spec = scenario.reset(5, &testing::map()).unwrap();
        let drivers: Vec<_> = spec.others.iter().map(|other| other.driver.clone()).collect();
        assert!(drivers.windows(2).all(|pair| pair[0] == pair[1]));
        (drivers[0].clone(), spec.signals)
    };
    let walks = |crossing_share| Some(Driver::Walks { speed_mps: 1.4, crossing_share });
    assert_eq!(walkers(json!({}), Profile::Documented), (walks(0.0), true));
    assert_eq!(walkers(json!({}), Profile::Literal), (None, true));
    let asked = json!({ "pedestrian_behavior": "crossing", "traffic_lights": false });
    assert_eq!(walkers(asked, Profile::Documented), (walks(1.0), false));
    let mut scenario = FreeRoam::new("free_roam", None, (0, 4), Profile::Documented);
    let config = json!({ "pedestrian_behavior": "flying" });
    let error = scenario.configure(&mut Overrides::new(config.as_object().unwrap())).unwrap_err();
    assert_eq!(
        error.to_string(),
        "scenario_config.pedestrian_behavior must be \"static\", \"walking\" or \"crossing\", \
         not \"flying\""
    );
}

#[test]
fn each_broken_rule_costs_once_what_it_is_set_to() {
    let red = Broken { red_lights: 1, ..Broken::default() };
    let stop = Broken { stop_signs: 1, ..Broken::default() };
    let way = Broken { right_of_way: 1, ..Broken::default() };
    let people = Broken { crossings: 1, ..Broken::default() };
    for (config, profile, broken, name, penalty) in [
        (json!({}), Profile::Documented, red, "red_lights_run", 1.0),
        (json!({}), Profile::Literal, red, "red_lights_run", 0.0),
        (json!({ "red_light_penalty": 2.5 }), Profile::Documented, red, "red_lights_run", 2.5),
        (json!({}), Profile::Documented, stop, "stop_signs_run", 1.0),
        (json!({}), Profile::Literal, stop, "stop_signs_run", 0.0),
        (json!({ "stop_sign_penalty": 0.5 }), Profile::Documented, stop, "stop_signs_run", 0.5),
        (json!({}), Profile::Documented, way, "right_of_way_taken", 1.0),
        (json!({ "right_of_way_penalty": 3 }), Profile::Literal, way, "right_of_way_taken", 3.0),
        (json!({ "right_of_way_penalty": 3 }), Profile::Documented, people, "crossings_taken", 3.0),
    ] {
        let mut scenario = FreeRoam::new("free_roam", None, (0, 0), profile);
        scenario.configure(&mut Overrides::new(config.as_object().unwrap())).unwrap();
        scenario.reset(3, &testing::map()).unwrap();
        let total_m = scenario.episode.total_m;
        let after = Facts { broken, ..facts(1, 0, total_m) };
        let reward = scenario.on_frame(&after).reward;
        assert!((reward + 0.01 + penalty).abs() < 1e-5, "{name}: {reward}");
        let next = scenario.on_frame(&Facts { step_count: 2, ..after }).reward;
        assert!((next + 0.01).abs() < 1e-5, "{name}: {next}");
        assert_eq!(scenario.outcome()[name], 1);
    }
}

#[test]
fn names_carry_map_and_crowd() {
    for (name, map, vehicles, pedestrians) in [
        ("free_roam", "Town10HD_Opt", 0, 0),
        ("free_roam_Town05", "Town05", 0, 0),
        ("free_roam_Town03_v20_p30", "Town03", 20, 30),
        ("free_roam_Town10HD_Opt_p4", "Town10HD_Opt", 0, 4),
        ("free_roam_Mine_01_v2", "Mine_01", 2, 0),
        ("free_roam_v20", "Town10HD_Opt", 20, 0),
        ("free_roam_v20_p3", "Town10HD_Opt", 20, 3),
    ] {
        let (found, others) =
            registry::free_roam_of(name.strip_prefix("free_roam").unwrap().trim_start_matches('_'))
                .unwrap();
        assert_eq!(
            (found.unwrap_or("Town10HD_Opt"), others),
            (map, (vehicles, pedestrians)),
            "{name}"
        );
        assert_eq!(registry::build(name, Profile::Documented).unwrap().common().map_name(), map);
    }
    for name in ["free_roam_", "free_roam_Town 05", "free_roam_Town05_v9999", "free_roam_a/b"] {
        let error = registry::build(name, Profile::Documented).err().unwrap().to_string();
        assert!(error.starts_with("Invalid free_roam format: free_roam_"), "{error}");
    }
}

#[test]
fn emergency_vehicles_and_parked_cars_come_when_they_are_asked_for() {
    let text = roads::town::build("Town02_Opt").unwrap();
    let map = roads::Map::parse("Town02_Opt", &text).unwrap();
    let spec = |config: Value| {
        let mut scenario = FreeRoam::new("free_roam", None, (3, 0), Profile::Documented);
        let mut overrides = Overrides::new(config.as_object().unwrap());
        scenario.configure(&mut overrides).unwrap();
        let spec = scenario.reset(5, &map).unwrap();
        (scenario.info(), spec)
    };
    let (_, plain) = spec(json!({}));
    let (info, urgent) = spec(json!({ "emergency_vehicles": 2 }));
    assert_eq!((plain.others.len(), urgent.others.len()), (3, 5));
    assert_eq!(info["spawned_parked_cars"], 0);
    let with_lights = urgent.others.iter().filter(|it| it.driver == Some(Driver::Emergency));
    assert_eq!(with_lights.count(), 2);
    for (behavior, driver) in [
        ("standing", None),
        ("pulling_out", Some(Driver::Traffic)),
        ("open_door", Some(Driver::OpenDoor)),
    ] {
        let (info, spec) = spec(json!({ "parked_cars": 6, "parked_behavior": behavior }));
        let parked = &spec.others[3..];
        assert!(parked.len() > 2, "{behavior}: {}", parked.len());
        assert_eq!(info["spawned_parked_cars"], parked.len());
        assert_eq!(spec.others[..3], plain.others[..], "the others stay where they were");
        for car in parked {
            assert_eq!(car.driver, driver);
            let at_m = car.world_from_actor.translation.vector.cast::<f64>();
            let lane = map.nearest(at_m.into(), roads::LaneType::Parking.into()).unwrap();
            assert!((map.pose(&lane).translation.vector - at_m).norm() < 0.1);
            assert!(Lanes::new(&map).under(at_m.cast()).is_none(), "beside the driving lanes");
        }
    }
    let mut scenario = FreeRoam::new("free_roam", None, (0, 0), Profile::Documented);
    let config = json!({ "parked_behavior": "floating" });
    let error = scenario.configure(&mut Overrides::new(config.as_object().unwrap())).unwrap_err();
    assert!(error.to_string().contains("\"open_door\", not \"floating\""), "{error}");
}
