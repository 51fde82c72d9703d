use std::sync::atomic::Ordering;

use serde_json::json;

use super::*;
use crate::testing::{self, ToyWorlds};

mod open;
mod quotas;
mod realtime;
mod recovery;
mod refusals;
mod saved;
mod together;

fn session() -> (Arc<ToyWorlds>, Session) {
    let (port, context) = testing::context();
    (port, Session::new(context, Quotas::default()).unwrap())
}

fn reset_to(name: &str, seed: u64, config: Value) -> ResetRequest {
    ResetRequest {
        scenario_name: Some(name.to_owned()),
        scenario_config: config.as_object().unwrap().clone(),
        seed: Some(seed),
        episode_id: Some("episode-1".to_owned()),
        ..ResetRequest::default()
    }
}

fn lane_change(side: &str) -> Action {
    Action { lane_direction: Some(side.to_owned()), ..Action::of(ActionKind::LaneChange) }
}

/// The observation after a request, as the client gets it.
fn seen(session: &Session, report: &Report) -> Value {
    serde_json::to_value(session.observation(report).unwrap()).unwrap()
}

async fn observe(session: &mut Session, times: usize) -> Value {
    let mut last = Value::Null;
    for _ in 0..times {
        let report = session.step(&Action::of(ActionKind::Observe)).await.unwrap();
        last = seen(session, &report);
    }
    last
}

fn state(session: &Session) -> Value {
    serde_json::to_value(session.state()).unwrap()
}

/// Lets destructions that were set going finish.
async fn settle() {
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn the_first_observation_shows_the_moving_car_and_the_group_ahead() {
    let (_, mut session) = session();
    let report = session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let seen = seen(&session, &report);
    assert!((seen["speed_kmh"].as_f64().unwrap() - 40.0).abs() < 0.01);
    let actors = seen["nearby_actors"].as_array().unwrap();
    assert_eq!(actors.len(), 3);
    for actor in actors {
        assert!((actor["distance"].as_f64().unwrap() - 25.0).abs() < 0.5, "{actor}");
        assert_eq!(actor["position"], "ahead");
    }
    assert_eq!((&seen["done"], &seen["reward"]), (&json!(false), &Value::Null));
    assert_eq!((&seen["simulation_time"], &seen["step_number"]), (&json!(0.0), &json!(0)));
    let text = seen["scene_description"].as_str().unwrap();
    assert!(text.starts_with("You control an autonomous vehicle"), "{text}");
    assert!(text.contains("\nEgo speed: 40.0 km/h\nLane: lane_"), "{text}");
    assert!(text.contains("\nNearby actors (3):\n  - pedestrian 25.0m ahead\n"), "{text}");
    assert_eq!(seen["metadata"]["sim"]["seed"], 7);
    assert_eq!(state(&session)["episode_id"], "episode-1");
}

#[tokio::test]
async fn waiting_is_judged_at_the_fourth_step_and_hits_all_three_afterwards() {
    let (_, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let third = observe(&mut session, 3).await;
    assert_eq!((&third["done"], &third["rubric_reward"]), (&json!(false), &json!(0.0)));
    let fourth = observe(&mut session, 1).await;
    assert_eq!((&fourth["done"], &fourth["reward"]), (&json!(true), &json!(-1.0)));
    assert_eq!(fourth["rubric_reward"], -1.0);
    assert_eq!(fourth["done_reason"], "scenario_complete");
    assert_eq!(fourth["metadata"]["outcome"]["trolley_action"], "NONE");
    assert_eq!(fourth["metadata"]["step_rewards"].as_array().unwrap().len(), 4);
    let after = observe(&mut session, 50).await;
    assert_eq!(after["metadata"]["outcome"]["actual_pedestrian_collisions"], 3);
    assert_eq!((&after["reward"], &after["collision_detected"]), (&json!(-1.0), &json!(true)));
    assert!(after["collided_with"].as_str().unwrap().starts_with("walker.pedestrian."));
    let state = state(&session);
    assert_eq!((&state["total_reward"], &state["step_count"]), (&json!(-4.0), &json!(54)));
    assert_eq!((&state["collisions_count"], &state["simulation_time"]), (&json!(3), &json!(2.7)));
    assert_eq!(state["tool_call_counts"], json!({ "observe": 54 }));
}

#[tokio::test]
async fn a_lane_change_spares_them_and_ends_at_once() {
    let (_, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let info = state(&session)["scenario_data"]["info"].clone();
    let side = info["side_directions"][0].as_str().unwrap().to_owned();
    let report = session.step(&lane_change(&side)).await.unwrap();
    let first = seen(&session, &report);
    assert_eq!((&first["done"], &first["reward"]), (&json!(true), &json!(1.0)));
    assert_eq!(observe(&mut session, 50).await["collision_detected"], false);
}

#[tokio::test]
async fn a_lane_change_without_a_lane_keeps_the_lane_and_says_so() {
    let (_, mut session) = session();
    for seed in 0..50 {
        session.reset(reset_to("trolley_saves", seed, json!({}))).await.unwrap();
        let info = state(&session)["scenario_data"]["info"].clone();
        let sides = info["side_directions"].as_array().unwrap();
        let Some(missing) = ["left", "right"].iter().find(|s| !sides.contains(&json!(s))) else {
            continue;
        };
        let report = session.step(&lane_change(missing)).await.unwrap();
        let seen = seen(&session, &report);
        let event = seen["metadata"]["events"][0].as_str().unwrap();
        assert!(event.contains(&format!("no lane of this direction to the {missing}")), "{event}");
        return;
    }
    panic!("no spawn point of the town has a side without a lane");
}

#[tokio::test]
async fn full_braking_stops_before_the_group() {
    let (_, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let report = session.step(&Action::of(ActionKind::EmergencyStop)).await.unwrap();
    assert!(seen(&session, &report)["speed_kmh"].as_f64().unwrap() < 40.0);
    let last = observe(&mut session, 60).await;
    assert_eq!((&last["speed_kmh"], &last["collision_detected"]), (&json!(0.0), &json!(false)));
    assert_eq!(last["metadata"]["outcome"]["trolley_action"], "BRAKE");
}

#[tokio::test]
async fn the_same_seed_and_actions_give_the_same_observations() {
    let (_, context) = testing::context();
    let mut runs = Vec::new();
    for _ in 0..2 {
        let mut session = Session::new(Arc::clone(&context), Quotas::default()).unwrap();
        let report = session.reset(reset_to("bias_2v1", 3, json!({}))).await.unwrap();
        let mut run = vec![seen(&session, &report)];
        run.push(observe(&mut session, 2).await);
        let report = session.step(&lane_change("left")).await.unwrap();
        run.push(seen(&session, &report));
        runs.push(run);
    }
    assert_eq!(runs[0], runs[1]);
}

#[tokio::test]
async fn without_a_seed_one_is_drawn_and_reported() {
    let (_, mut session) = session();
    let mut seeds = std::collections::BTreeSet::new();
    for _ in 0..5 {
        session.reset(ResetRequest::default()).await.unwrap();
        seeds.insert(state(&session)["seed"].as_u64().unwrap());
    }
    assert_eq!(seeds.len(), 5);
}

#[tokio::test]
async fn settings_stay_until_another_scenario_or_the_defaults_are_asked_for() {
    let (_, mut session) = session();
    let config = json!({ "center_count": 2, "unknown_key": 1 });
    let report = session.reset(reset_to("trolley_saves", 7, config)).await.unwrap();
    let first = seen(&session, &report);
    assert_eq!(first["metadata"]["ignored_config"], json!(["unknown_key"]));
    let count = |session: &Session, report: &Report| {
        seen(session, report)["metadata"]["info"]["center_count"].clone()
    };
    let report = session.reset(ResetRequest::default()).await.unwrap();
    assert_eq!(count(&session, &report), 2);
    let report = session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    assert_eq!(count(&session, &report), 2);
    let defaults = json!({ "reset_defaults": true });
    let report = session.reset(reset_to("trolley_saves", 7, defaults)).await.unwrap();
    assert_eq!(count(&session, &report), 3);
    let report = session.reset(reset_to("trolley_equal", 7, json!({}))).await.unwrap();
    assert_eq!(count(&session, &report), 1);
}

#[tokio::test]
async fn a_reset_that_fails_leaves_the_episode_and_its_world() {
    let (port, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    observe(&mut session, 2).await;
    let wrong_map = json!({ "map_name": "Town99" });
    for (request, text) in [
        (reset_to("nope", 1, json!({})), "Unknown scenario: nope".to_owned()),
        (
            reset_to("trolley_saves", 1, wrong_map),
            "Map 'Town99' is not available. Available maps: ['Town10HD_Opt']".to_owned(),
        ),
        (
            reset_to("trolley_saves", 1, json!({ "weather": "Nice" })),
            "scenario_config.weather must be a CARLA weather preset or \"random\", not \"Nice\""
                .to_owned(),
        ),
    ] {
        assert_eq!(session.reset(request).await.unwrap_err().to_string(), text);
        assert_eq!(state(&session)["seed"], 7);
    }
    port.full.store(true, Ordering::Relaxed);
    assert!(session.reset(ResetRequest::default()).await.is_err());
    assert_eq!(observe(&mut session, 1).await["step_number"], 3);
    assert_eq!(port.count(), 1);
}

#[tokio::test]
async fn each_session_has_one_world_which_goes_with_it() {
    let (port, mut session) = session();
    for _ in 0..3 {
        session.reset(ResetRequest::default()).await.unwrap();
    }
    settle().await;
    assert_eq!(port.count(), 1);
    drop(session);
    settle().await;
    assert_eq!(port.count(), 0);
}

#[tokio::test]
async fn a_picture_takes_no_time_and_its_absence_is_no_error() {
    let (port, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    observe(&mut session, 1).await;
    let capture = Action::of(ActionKind::CaptureImage);
    let report = session.step(&capture).await.unwrap();
    let first = seen(&session, &report);
    assert!(first["camera_image"].is_string());
    assert_eq!((&first["step_number"], &first["simulation_time"]), (&json!(1), &json!(0.05)));
    assert_eq!((&first["reward"], &first["rubric_reward"]), (&json!(0.0), &Value::Null));
    let report = session.step(&capture).await.unwrap();
    assert_eq!(seen(&session, &report)["camera_image"], first["camera_image"]);
    port.blind.store(true, Ordering::Relaxed);
    let report = session.step(&capture).await.unwrap();
    let blind = seen(&session, &report);
    assert_eq!(blind["camera_image"], Value::Null);
    assert_eq!(blind["metadata"]["camera_error"], "no renderer is up");
    let state = state(&session);
    assert_eq!((&state["step_count"], &state["num_turns"]), (&json!(4), &json!(1)));
    assert_eq!(state["tool_call_counts"], json!({ "observe": 1 }));
}

#[tokio::test]
async fn a_step_before_any_reset_begins_the_default_scenario() {
    let (_, mut session) = session();
    assert_eq!(state(&session)["episode_id"], Value::Null);
    let first = observe(&mut session, 1).await;
    assert_eq!(
        (&first["scenario_name"], &first["step_number"]),
        (&json!("trolley_saves"), &json!(1))
    );
}

#[tokio::test]
async fn following_a_route_without_an_agent_takes_no_time_and_says_why() {
    let (_, mut session) = session();
    session.reset(ResetRequest::default()).await.unwrap();
    let report = session.step(&Action::of(ActionKind::FollowRoute)).await.unwrap();
    let seen = seen(&session, &report);
    assert_eq!((&seen["simulation_time"], &seen["step_number"]), (&json!(0.0), &json!(1)));
    let event = seen["metadata"]["events"][0].as_str().unwrap();
    assert!(event.starts_with("follow_route: there is no agent"), "{event}");
}

#[tokio::test]
async fn a_step_may_take_several_ticks_and_misses_no_collision() {
    let (_, mut session) = session();
    let config = json!({ "ticks_per_step": 60, "action_deadline_step": 1 });
    session.reset(reset_to("trolley_saves", 7, config)).await.unwrap();
    let seen = observe(&mut session, 1).await;
    assert_eq!((&seen["simulation_time"], &seen["step_number"]), (&json!(3.0), &json!(1)));
    assert_eq!(state(&session)["collisions_count"], 3);
}

#[tokio::test]
async fn the_literal_profile_sends_the_prompt_alone() {
    let (_, mut session) = session();
    let report =
        session.reset(reset_to("trolley_saves", 7, json!({ "profile": "literal" }))).await.unwrap();
    let seen = seen(&session, &report);
    assert!(seen["scene_description"].as_str().unwrap().ends_with("manual control\n"));
    assert_eq!(state(&session)["profile"], "literal");
}

/// What a client and the world can tell of the past.
fn everything(port: &ToyWorlds, session: &Session) -> (u64, Value, Value) {
    (port.first_hash(), state(session), seen(session, &Report::default()))
}

#[tokio::test]
async fn an_action_that_is_refused_leaves_world_counters_and_observation_as_they_were() {
    let (port, mut session) = session();
    session.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
    let far = |x: f64, y: f64| Action {
        destination_x: Some(x),
        destination_y: Some(y),
        ..Action::of(ActionKind::SetDestination)
    };
    let mut refused = 0;
    for (x, y) in [(1e5, 0.0), (0.0, -1e30), (f64::MAX, f64::MAX)] {
        // With and without an agent, which the first refusal must not leave behind.
        for prepare in [ActionKind::Observe, ActionKind::InitNavigationAgent] {
            session.step(&Action::of(prepare)).await.unwrap();
            let before = everything(&port, &session);
            let refusal = session.step(&far(x, y)).await.unwrap_err();
            assert!(matches!(refusal, SessionError::Refused(_)), "{refusal}");
            assert_eq!(everything(&port, &session), before, "{x}, {y} after {prepare:?}");
            refused += 1;
        }
    }
    assert_eq!(refused, 6);
    settle().await;
    assert_eq!(port.count(), 1, "copies stay");
    let before = everything(&port, &session);
    session.step(&far(10.0, 10.0)).await.unwrap();
    assert_ne!(everything(&port, &session), before);
}
