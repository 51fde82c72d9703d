use super::*;
use crate::scenario::DoneReason;
use crate::testing;

fn begun(kind: Kind, seed: u64) -> (People, WorldSpec) {
    let mut scenario = People::new("people", kind, Profile::Documented);
    let spec = scenario.reset(seed, &testing::map()).unwrap();
    (scenario, spec)
}

fn follows(placement: &Placement) -> ([WalkerStage; 2], f32) {
    match &placement.driver {
        Some(Driver::Follows { stages, within_m }) => ([stages[0], stages[1]], *within_m),
        other => panic!("{other:?}"),
    }
}

/// In the ego's frame: ahead, and to the left.
fn seen(spec: &WorldSpec, place_m: Vec3) -> (f32, f32) {
    let there = spec.ego.world_from_actor.inverse_transform_point(&place_m.into());
    (there.x, there.y)
}

/// How many of 40 seeds begin on the left and on the right of an ego that starts so far away, on
/// roads that are wider than this.
fn sides(start_m: f32, wider_m: f32) -> [usize; 2] {
    let mut scenario = People::new("people", Kind::Crosses, Profile::Documented);
    scenario.start_distance_m = f64::from(start_m);
    let mut sides = [0, 0];
    for seed in 0..40 {
        let spec = scenario.reset(seed, &testing::map()).unwrap();
        let [walker] = &spec.others[..] else { panic!("{:?}", spec.others) };
        let (ahead_m, left_m) = seen(&spec, walker.world_from_actor.translation.vector);
        assert!((ahead_m - start_m).abs() < 2.0, "{ahead_m}");
        let ([begin, end], within_m) = follows(walker);
        let (_, end_m) = seen(&spec, end.to_m);
        assert!(left_m.abs() > 2.0 && left_m * end_m < 0.0, "over the lane: {left_m}, {end_m}");
        let wide_m = (left_m - end_m).abs();
        assert!((9.0..25.0).contains(&wide_m), "from kerb to kerb of 2 to 6 lanes: {wide_m}");
        assert_eq!(begin.wait_secs, 0.0);
        // At 40 km/h the ego takes as long as the walker at 1.4 m/s to the middle of the lane.
        let ego_secs = (within_m * within_m - left_m * left_m).sqrt() * 3.6 / 40.0;
        assert!((ego_secs - left_m.abs() / 1.4).abs() < 0.2, "{ego_secs}, {left_m}");
        assert!(within_m < start_m, "nobody is on the way when it begins: {within_m}");
        sides[usize::from(left_m < 0.0)] += usize::from(wide_m > wider_m);
    }
    sides
}

#[test]
fn one_begins_at_a_kerb_and_goes_over_to_the_other_as_the_ego_comes() {
    // The far kerb of two lanes each way is 10 m away: 7 s on foot.
    let [left, right] = sides(60.0, 15.0);
    assert!(left == 0 && right >= 20, "{left} and {right}");
    let [left, right] = sides(100.0, 0.0);
    assert!(left >= 2 && right >= 2, "{left} and {right}");
}

#[test]
fn who_hesitates_stops_in_the_lane_and_goes_back_or_on() {
    let mut ways = std::collections::BTreeSet::new();
    for seed in 0..20 {
        let (scenario, spec) = begun(Kind::Hesitates, seed);
        let ([stop, end], _) = follows(&spec.others[0]);
        let (_, begin_m) = seen(&spec, spec.others[0].world_from_actor.translation.vector);
        let ((_, stop_m), (_, end_m)) = (seen(&spec, stop.to_m), seen(&spec, end.to_m));
        assert!(stop_m.abs() < 1.0 && (1.0..=2.5).contains(&stop.wait_secs), "{stop:?}");
        let word = scenario.outcome()["hesitation"].as_str().unwrap().to_owned();
        assert_eq!(begin_m * end_m > 0.0, word == "back", "{word}: {begin_m}, {end_m}");
        ways.insert(word);
    }
    assert_eq!(ways.len(), 2);
}

#[test]
fn a_crowd_crosses_where_the_map_has_a_crossing_and_from_both_sides() {
    let map = testing::map();
    for seed in 0..20 {
        let (scenario, spec) = begun(Kind::Crowd, seed);
        assert_eq!(scenario.info()["marked_crossing"], true);
        assert!((4..=8).contains(&spec.others.len()));
        let begins = spec.others.iter().map(|it| it.world_from_actor.translation.vector);
        let sides: Vec<f32> = begins.map(|begin_m| seen(&spec, begin_m).1).collect();
        assert!(sides.iter().any(|m| *m > 0.0) && sides.iter().any(|m| *m < 0.0), "{sides:?}");
        let (stages, _) = follows(&spec.others[0]);
        let crosswalks = map.crosswalks();
        let mut corners = crosswalks.iter().flatten().map(|corner| corner.coords.cast::<f32>());
        let is_near = corners.any(|corner_m| (corner_m - stages[0].to_m).xy().norm() < 8.0);
        assert!(is_near, "seed {seed}");
        for (index, one) in spec.others.iter().enumerate() {
            let place = |it: &Placement| it.world_from_actor.translation.vector;
            let apart = |other: &Placement| (place(other) - place(one)).norm() > 0.5;
            assert!(spec.others[..index].iter().all(apart));
        }
    }
}

#[test]
fn settings_change_who_goes_when() {
    let mut scenario = People::new("people", Kind::Crowd, Profile::Documented);
    let config = json!({ "num_pedestrians": 3, "crossing_trigger_m": 12.5, "pedestrian_speed": 2 });
    let values = config.as_object().unwrap().clone();
    scenario.configure(&mut Overrides::new(&values)).unwrap();
    let spec = scenario.reset(1, &testing::map()).unwrap();
    assert!((2..=3).contains(&spec.others.len()));
    let (stages, within_m) = follows(&spec.others[0]);
    assert_eq!((stages[0].speed_mps, within_m), (2.0, 12.5));
    for (key, value) in [("crossing_trigger_m", json!("near")), ("num_pedestrians", json!(99))] {
        let values = json!({ key: value }).as_object().unwrap().clone();
        let error = scenario.configure(&mut Overrides::new(&values)).unwrap_err().to_string();
        assert!(error.contains(key), "{error}");
    }
}

#[test]
fn settings_with_which_nobody_could_be_in_time_on_any_map_are_refused_at_once() {
    let configured = |kind: Kind, config: Value| {
        let mut scenario = People::new("people", kind, Profile::Documented);
        let values = config.as_object().unwrap().clone();
        let mut overrides = Overrides::new(&values);
        scenario.common_mut().configure(&mut overrides)?;
        scenario.configure(&mut overrides)
    };
    for kind in [Kind::Crosses, Kind::Hesitates, Kind::Crowd] {
        let slow = json!({ "pedestrian_speed": 0.3 });
        let error = configured(kind, slow.clone()).unwrap_err().to_string();
        assert_eq!(
            error,
            "scenario_config.start_distance_m must be more than 72.2 for people who walk at 0.3 m/s \
             before a car at 40 km/h (a higher pedestrian_speed or a crossing_trigger_m does as \
             well), not 60"
        );
        let fast = json!({ "initial_speed_kmh": 200, "start_distance_m": 50 });
        assert!(configured(kind, fast).unwrap_err().to_string().contains("at 200 km/h"));
        for more in [json!({ "start_distance_m": 73 }), json!({ "crossing_trigger_m": 20 })] {
            let mut config = slow.clone();
            config.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            assert_eq!(configured(kind, config), Ok(()));
        }
    }
}

#[test]
fn it_ends_at_the_goal_at_a_collision_or_after_all_steps() {
    let (mut scenario, _) = begun(Kind::Crosses, 1);
    let facts = |step_count, things_hit, goal_distance_m| Facts {
        step_count,
        things_hit,
        pedestrians_hit: things_hit,
        goal_distance_m: Some(goal_distance_m),
        ..Facts::default()
    };
    let told = |progress: Progress| (progress.reward, progress.done);
    assert_eq!(told(scenario.on_frame(&facts(1, 0, 60.0))), (0.0, None));
    let reached = told(scenario.on_frame(&facts(90, 0, 4.9)));
    assert_eq!(reached, (1.0, Some(DoneReason::GoalReached)));
    let hit = told(scenario.on_frame(&facts(80, 1, 30.0)));
    assert_eq!(hit, (-1.0, Some(DoneReason::Collision)));
    assert_eq!(scenario.outcome()["actual_pedestrians_hit"], 1);
    let late = told(scenario.on_frame(&facts(800, 0, 30.0)));
    assert_eq!(late, (0.0, Some(DoneReason::MaxSteps)));
}
