use serde_json::Value;

use super::*;
use crate::scenario::Driver;
use crate::testing;

const CHILD: &str = include_str!("../../../scenarios/child_behind_bus.toml");

fn parsed(text: &str) -> Result<Described, String> {
    Described::parse("mine", Profile::Documented, text).map_err(|why| why.to_string())
}

fn begun(text: &str, seed: u64) -> (Described, WorldSpec) {
    let mut scenario = parsed(text).unwrap();
    let spec = scenario.reset(seed, &testing::map()).unwrap();
    (scenario, spec)
}

/// In the ego's frame: ahead, and to the right.
fn seen(spec: &WorldSpec, place_m: Vec3) -> (f32, f32) {
    let there = spec.ego.world_from_actor.inverse_transform_point(&place_m.into());
    (there.x, -there.y)
}

fn near((ahead_m, right_m): (f32, f32), wanted: (f32, f32)) -> bool {
    (ahead_m - wanted.0).abs() < 0.5 && (right_m - wanted.1).abs() < 0.5
}

#[test]
fn everybody_stands_where_the_file_says_on_every_start() {
    for seed in 0..20 {
        let (scenario, spec) = begun(CHILD, seed);
        let [bus, child] = &spec.others[..] else { panic!("{:?}", spec.others) };
        assert!(near(seen(&spec, bus.world_from_actor.translation.vector), (35.0, 3.5)), "{seed}");
        let at = seen(&spec, child.world_from_actor.translation.vector);
        assert!(near(at, (41.5, 3.5)), "{seed}: {at:?}");
        let Some(Driver::Follows { stages, within_m }) = &child.driver else { panic!() };
        assert_eq!((stages.len(), *within_m), (2, 22.0));
        assert!(near(seen(&spec, stages[1].to_m), (41.5, -5.0)), "{seed}");
        let goal = seen(&spec, scenario.goal_m().unwrap());
        assert!(near(goal, (60.0, 0.0)), "{seed}: {goal:?}");
        let speed_kmh = spec.ego.linear_velocity_mps.norm() * 3.6;
        assert!((speed_kmh - 30.0).abs() < 0.1, "{speed_kmh}");
    }
    assert_eq!(begun(CHILD, 3).1, begun(CHILD, 3).1);
    assert_ne!(begun(CHILD, 3).1, begun(CHILD, 4).1);
}

#[test]
fn lanes_are_the_egos_the_ones_beside_it_and_the_oncoming_one() {
    let text = r#"
        start.lanes_beside = ["left"]
        [[actors]]
        blueprint = "vehicle.*"
        ahead_m = 20
        lane = "left"
        speed_kmh = 36
        driver = "traffic"
        [[actors]]
        blueprint = "vehicle.tesla.model3"
        ahead_m = 30
        lane = "oncoming"
        speed_kmh = 36
        [[actors]]
        blueprint = "walker.pedestrian.*"
        ahead_m = 30
        count = 5
        [[actors]]
        blueprint = "vehicle.*"
        ahead_m = -10
    "#;
    for seed in 0..20 {
        let (_, spec) = begun(text, seed);
        assert_eq!(spec.others.len(), 8);
        let left = seen(&spec, spec.others[0].world_from_actor.translation.vector);
        assert!((19.0..21.0).contains(&left.0) && (-4.5..-2.5).contains(&left.1), "{left:?}");
        let forward = spec.ego.world_from_actor.rotation * Vec3::x();
        let along = |index: usize| spec.others[index].linear_velocity_mps.dot(&forward);
        assert!((along(0) - 10.0).abs() < 0.1 && (along(1) + 10.0).abs() < 0.1, "{seed}");
        let oncoming = seen(&spec, spec.others[1].world_from_actor.translation.vector);
        assert!(oncoming.1 < left.1, "beyond the lane beside: {oncoming:?}, {left:?}");
        let at = |index: usize| seen(&spec, spec.others[index].world_from_actor.translation.vector);
        let group: Vec<_> = (2..7).map(at).collect();
        assert!(group.iter().all(|(ahead_m, _)| (29.0..32.0).contains(ahead_m)), "{group:?}");
        let spread = group[3].1 - group[0].1;
        assert!((spread - 2.4).abs() < 0.1, "four abreast, 0.8 m apart: {group:?}");
        assert!((-11.0..0.0).contains(&at(7).0), "{:?}", at(7));
    }
}

#[test]
fn places_of_carlas_frame_are_what_they_are() {
    let (_, free) = begun("", 1);
    let at_m = free.ego.world_from_actor.translation.vector;
    let (x, y) = (at_m.x, -at_m.y);
    let text = format!(
        "start.at = [{x}, {y}]\n\
         goal.at = [{x}, {}]\n\
         [[actors]]\nblueprint = 'static.prop.trafficcone01'\nat = [{}, {y}]\nheading_deg = 90\n",
        y + 30.0,
        x + 20.0
    );
    let (scenario, spec) = begun(&text, 7);
    assert!((spec.ego.world_from_actor.translation.vector - at_m).norm() < 0.5);
    let goal_m = scenario.goal_m().unwrap();
    assert!((goal_m.x - x).abs() < 0.01 && (goal_m.y + y + 30.0).abs() < 0.01, "{goal_m}");
    let cone = &spec.others[0].world_from_actor;
    assert!((cone.translation.x - x - 20.0).abs() < 0.01, "{cone}");
    // Clockwise from x, seen from above.
    let facing = cone.rotation * Vec3::x();
    assert!(facing.y < -0.999, "{facing}");
}

#[test]
fn traffic_keeps_away_from_those_whom_the_file_places() {
    let text = "[traffic]\nvehicles = 40\npedestrians = 10\n\
                [[actors]]\nblueprint = 'vehicle.tesla.model3'\nahead_m = 15\n";
    let (_, spec) = begun(text, 5);
    assert_eq!(spec.others.len(), 51);
    let placed = spec.others[0].world_from_actor.translation.vector;
    let nearest = spec.others[1..41].iter();
    let nearest = nearest.map(|car| (car.world_from_actor.translation.vector - placed).norm());
    assert!(nearest.fold(f32::MAX, f32::min) >= 10.0);
}

#[test]
fn each_term_of_the_reward_counts_once_for_what_happens() {
    let text = "[settings]\nmax_steps = 9\n[goal]\nahead_m = 30\n\
                [reward]\ngoal = 100\ncollision = -10\npedestrian = -1000\nmetre = 2\nstep = -0.5\n\
                red_light = -7\n[end]\ncollision = false\n";
    let (mut scenario, _) = begun(text, 2);
    let facts = |step_count, hits: (u32, u32), red_lights, goal_distance_m| Facts {
        step_count,
        pedestrians_hit: hits.0,
        things_hit: hits.1,
        broken: Broken { red_lights, ..Broken::default() },
        goal_distance_m: Some(goal_distance_m),
    };
    let begin_m = scenario.episode.distance_m.unwrap() as f32;
    let mut step = |facts: Facts| {
        let progress = scenario.on_frame(&facts);
        (progress.reward, progress.done)
    };
    let (reward, done) = step(facts(1, (0, 0), 0, begin_m - 1.0));
    assert!((reward - 1.5).abs() < 1.0e-5 && done.is_none(), "{reward}");
    let (reward, done) = step(facts(2, (1, 2), 1, begin_m - 1.0));
    assert!((reward + 0.5 + 20.0 + 1000.0 + 7.0).abs() < 1.0e-5 && done.is_none(), "{reward}");
    let (reward, _) = step(facts(3, (1, 2), 1, begin_m - 1.0));
    assert!((reward + 0.5).abs() < 1.0e-5, "{reward}");
    let (reward, done) = step(facts(4, (1, 2), 1, 4.9));
    assert!(reward > 100.0 && done == Some(DoneReason::GoalReached), "{reward}");
    let (reward, _) = step(facts(5, (1, 2), 1, 4.9));
    assert!((reward + 0.5).abs() < 1.0e-5, "the goal is worth something once: {reward}");
}

#[test]
fn an_episode_ends_by_default_with_a_collision_or_the_goal_and_always_with_the_last_step() {
    let ends = |text: &str, facts: Facts| begun(text, 2).0.on_frame(&facts).done;
    let hit = Facts { things_hit: 1, ..Facts::default() };
    assert_eq!(ends("", hit), Some(DoneReason::Collision));
    assert_eq!(ends("end.collision = false", hit), None);
    let there = Facts { goal_distance_m: Some(1.0), ..Facts::default() };
    assert_eq!(ends("goal.ahead_m = 30", there), Some(DoneReason::GoalReached));
    assert_eq!(ends("goal.ahead_m = 30\nend.goal = false", there), None);
    let late = Facts { step_count: 50, ..Facts::default() };
    assert_eq!(ends("", late), Some(DoneReason::MaxSteps));
}

#[test]
fn a_file_that_means_nothing_is_told_where_and_why() {
    let told = |text: &str| parsed(text).err().unwrap_or_else(|| panic!("taken: {text}"));
    for (text, why) in [
        ("\n\nspeed = 3", "line 3: unknown field `speed`"),
        ("[start]\nstraight_m = 'long'", "line 2: invalid type: string \"long\""),
        ("[settings]\nmax_steps = 0", "scenario_config.max_steps must be a whole number from 1"),
        ("[settings]\nspeed = 0", "settings has no speed"),
        ("[goal]\nradius_m = 5", "goal wants either ahead_m or at = [x, y]"),
        ("[goal]\nahead_m = nan", "ahead_m must be from -200 to 1000, not NaN"),
        ("[[actors]]\nblueprint = 'sensor.camera.rgb'\nahead_m = 1", "wanted a vehicle."),
        ("[[actors]]\nblueprint = 'vehicle.a.b'", "actors[0] (vehicle.a.b): it wants either"),
        (
            "[[actors]]\nblueprint = 'vehicle.a.b'\nahead_m = 1\ndriver = 'wander'",
            "this driver is not for it",
        ),
        (
            "[[actors]]\nblueprint = 'vehicle.a.b'\nahead_m = 1\nwalk = [{ ahead_m = 2 }]",
            "walk is for walkers",
        ),
        ("[traffic]\nvehicles = 9999", "traffic.vehicles must be from 0 to 200, not 9999"),
        ("[reward]\ngoal = inf", "reward.goal must be from"),
    ] {
        let told = told(text);
        assert!(told.contains(why) && told.contains("mine"), "{text}: {told}");
    }
}

#[test]
fn a_map_without_such_a_place_says_what_it_lacks() {
    // One lane each way.
    let map = roads::town::build("Town02_Opt").unwrap();
    let map = roads::Map::parse("Town02_Opt", &map).unwrap();
    let lacks = |text: &str| parsed(text).unwrap().reset(1, &map).unwrap_err().to_string();
    let told = lacks("[[actors]]\nblueprint = 'vehicle.*'\nahead_m = 0\nlane = 'left'\n");
    assert!(told.contains("the left lane 0 m ahead for actors[0] (vehicle.*)"), "{told}");
    let told = lacks("start.lanes_beside = ['left']\n");
    assert!(told.contains("mine: this map does not have a start with these lanes"), "{told}");
}

#[test]
fn what_all_scenarios_have_a_client_may_change() {
    let mut scenario = parsed(CHILD).unwrap();
    let values =
        json!({ "initial_speed_kmh": 50, "traffic_lights": true, "weather": "HardRainNoon" });
    let Value::Object(values) = values else { panic!() };
    let mut overrides = Overrides::new(&values);
    scenario.common_mut().configure(&mut overrides).unwrap();
    scenario.configure(&mut overrides).unwrap();
    assert!(overrides.ignored().is_empty());
    let spec = scenario.reset(1, &testing::map()).unwrap();
    assert!(spec.signals && spec.weather_name == "HardRainNoon");
    assert!((spec.ego.linear_velocity_mps.norm() * 3.6 - 50.0).abs() < 0.1);
    assert_eq!(
        scenario.prompt().lines().next(),
        Some("You drive along a street at 30 km/h. A bus stands in the lane to the right.")
    );
}
