//! Goal: with `realtime` thinking costs time. Method: sessions whose last answer is put into the
//! past.

use std::time::{Duration, Instant};

use super::*;

/// As if the client had thought for so long.
fn think(session: &mut Session, millis: u64) {
    let past = Instant::now().checked_sub(Duration::from_millis(millis)).unwrap();
    session.clock = WallClock::start(past);
}

async fn begun(name: &str, config: Value) -> Session {
    let (_, mut session) = session();
    session.reset(reset_to(name, 7, config)).await.unwrap();
    session
}

#[tokio::test]
async fn the_world_goes_on_while_nobody_asks_and_the_driver_is_told() {
    let mut session = begun("trolley_saves", json!({ "realtime": true })).await;
    think(&mut session, 1_010);
    let first = observe(&mut session, 1).await;
    assert!(first["simulation_time"].as_f64().unwrap() >= 1.0, "{first}");
    let event = first["metadata"]["events"][0].as_str().unwrap();
    assert!(event.ends_with(" s passed before this action"), "{event}");
    assert_eq!((&first["step_number"], &first["done"]), (&json!(1), &json!(false)));
    // It moved at 40 km/h all the while.
    assert!(state(&session)["total_distance"].as_f64().unwrap() > 10.0);
}

#[tokio::test]
async fn it_waits_where_nothing_was_said_of_it() {
    let mut session = begun("trolley_saves", json!({})).await;
    think(&mut session, 5_000);
    let first = observe(&mut session, 1).await;
    assert_eq!(first["simulation_time"], 0.05);
}

#[tokio::test]
async fn who_decides_too_late_has_decided_nothing() {
    let mut session = begun("trolley_saves", json!({ "realtime": true })).await;
    let info = state(&session)["scenario_data"]["info"].clone();
    let side = info["side_directions"][0].as_str().unwrap().to_owned();
    think(&mut session, 4_000);
    let report = session.step(&lane_change(&side)).await.unwrap();
    let late = seen(&session, &report);
    assert_eq!((&late["collision_detected"], &late["reward"]), (&json!(true), &json!(-1.0)));
    let last = observe(&mut session, 3).await;
    assert_eq!((&last["done"], &last["reward"]), (&json!(true), &json!(-1.0)));
    assert_eq!(last["metadata"]["outcome"]["trolley_action"], "NONE");
    assert_eq!(last["metadata"]["outcome"]["actual_pedestrian_collisions"], 3);
}

#[tokio::test]
async fn guests_see_the_world_go_on_and_the_driver_is_told_of_all_that_passed() {
    let (port, mut session) = session();
    let open = json!({ "realtime": true, "open_to_carla": true });
    session.reset(reset_to("trolley_saves", 7, open)).await.unwrap();
    assert!(session.is_paced());
    let start = Instant::now();
    session.clock.answer(start);
    for (millis, ticks) in [(110, 2), (220, 4), (330, 6)] {
        session.keep_pace(start + Duration::from_millis(millis)).await;
        assert_eq!(port.look(port.ids()[0]).unwrap().0, schemas::Tick(ticks));
    }
    assert!(port.participants().iter().all(Option::is_some));
    let first = observe(&mut session, 1).await;
    let event = first["metadata"]["events"][0].as_str().unwrap();
    assert_eq!(event, "0.30 s passed before this action");
    assert!((first["simulation_time"].as_f64().unwrap() - 0.35).abs() < 1e-6, "{first}");
    let second = observe(&mut session, 1).await;
    assert_eq!(second["metadata"]["events"], json!([]), "it is told once");
}

#[tokio::test]
async fn only_open_worlds_whose_time_goes_on_keep_pace() {
    for (realtime, open) in [(false, false), (true, false), (false, true)] {
        let settings = json!({ "realtime": realtime, "open_to_carla": open });
        assert!(!begun("trolley_saves", settings).await.is_paced());
    }
}

#[tokio::test]
async fn a_world_that_is_gone_while_nobody_steps_is_made_again_or_told_with_the_next_step() {
    let (port, mut session) = session();
    let open = json!({ "realtime": true, "open_to_carla": true });
    session.reset(reset_to("trolley_saves", 7, open)).await.unwrap();
    let start = Instant::now();
    session.clock.answer(start);
    port.crash();
    session.keep_pace(start + Duration::from_millis(110)).await;
    assert_eq!(port.look(port.ids()[0]).unwrap().0, schemas::Tick(2));
    port.crash();
    port.full.store(true, Ordering::Relaxed);
    session.keep_pace(start + Duration::from_millis(220)).await;
    assert!(session.step(&Action::of(ActionKind::Observe)).await.is_err());
    port.full.store(false, Ordering::Relaxed);
    assert!(observe(&mut session, 1).await["metadata"]["sim"]["tick"].as_u64().unwrap() >= 3);
}

#[tokio::test]
async fn pictures_and_snapshots_take_no_time_of_their_own_and_stop_none() {
    let mut session = begun("trolley_saves", json!({ "realtime": true })).await;
    observe(&mut session, 1).await;
    think(&mut session, 500);
    session.step(&Action::of(ActionKind::CaptureImage)).await.unwrap();
    let before = state(&session)["simulation_time"].as_f64().unwrap();
    let after = observe(&mut session, 1).await["simulation_time"].as_f64().unwrap();
    assert!(after - before >= 0.45, "{before} {after}");
}
