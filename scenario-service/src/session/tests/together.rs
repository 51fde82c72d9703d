use std::time::Duration;

use super::*;

/// Who makes a world for two, and the code of it.
async fn host(context: &Arc<SessionContext>, more: Value) -> (Session, String) {
    let mut config = json!({ "num_egos": 2, "lease_secs": 30, "num_npc_vehicles": 3 });
    config.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let mut host = Session::new(Arc::clone(context), Quotas::default()).unwrap();
    let report = host.reset(reset_to("free_roam", 7, config)).await.unwrap();
    let told = seen(&host, &report)["metadata"].clone();
    assert_eq!((&told["ego"], &told["egos"]), (&json!("ego_0"), &json!(["ego_0", "ego_1"])));
    assert_eq!(told["others"], json!([{ "ego": "ego_1", "live": false }]));
    (host, told["world_id"].as_str().unwrap().to_owned())
}

fn joining(code: &str, ego: Option<&str>) -> ResetRequest {
    let (join, ego) = (Some(code.to_owned()), ego.map(str::to_owned));
    ResetRequest { join, ego, ..ResetRequest::default() }
}

async fn guest(context: &Arc<SessionContext>, code: &str) -> (Session, Value) {
    let mut guest = Session::new(Arc::clone(context), Quotas::default()).unwrap();
    let report = guest.reset(joining(code, None)).await.unwrap();
    let seen = seen(&guest, &report);
    (guest, seen)
}

fn throttle(amount: f64) -> Action {
    Action { throttle: amount, ..Action::of(ActionKind::Control) }
}

async fn step(session: &mut Session, action: Action) -> Value {
    let report = session.step(&action).await.unwrap();
    seen(session, &report)
}

#[tokio::test]
async fn each_tick_waits_for_both_and_who_asks_first_makes_no_difference() {
    let mut ends = Vec::new();
    for is_host_first in [true, false] {
        let (port, context) = testing::context();
        let (mut host, code) = host(&context, json!({})).await;
        let (mut guest, first) = guest(&context, &code).await;
        assert_eq!(first["metadata"]["ego"], "ego_1");
        assert_ne!(first["location"], seen(&host, &Report::default())["location"]);
        for tick in 1..=20 {
            let ours = throttle(0.5);
            let theirs = throttle(1.0);
            let (left, right) = if is_host_first {
                tokio::join!(step(&mut host, ours), step(&mut guest, theirs))
            } else {
                let (right, left) = tokio::join!(step(&mut guest, theirs), step(&mut host, ours));
                (left, right)
            };
            assert_eq!(left["metadata"]["sim"]["tick"], tick);
            assert_eq!(
                left["metadata"]["sim"]["state_hash"],
                right["metadata"]["sim"]["state_hash"]
            );
            assert!(left["metadata"]["sim"]["waited_ms"].is_u64());
            if tick == 20 {
                ends.push(left["metadata"]["sim"]["state_hash"].clone());
            }
        }
        drop((host, guest));
        settle().await;
        assert_eq!(port.count(), 0, "the world has nobody any more");
    }
    assert_eq!(ends[0], ends[1]);
}

#[tokio::test]
async fn the_first_tick_waits_for_the_others_to_come_and_every_other_one_for_a_lease() {
    let (_, context) = testing::context();
    let times = json!({ "join_timeout_secs": 0.4, "lease_secs": 0.2 });
    let (mut host, code) = host(&context, times).await;
    let alone = step(&mut host, throttle(0.5)).await;
    assert!(alone["metadata"]["sim"]["waited_ms"].as_u64() >= Some(400), "{alone}");
    assert_eq!(alone["metadata"]["events"], json!(["ego_1 was waited for in vain: brake"]));
    let (mut guest, first) = guest(&context, &code).await;
    assert_eq!(first["metadata"]["sim"]["tick"], 1);
    let late = step(&mut host, throttle(0.5)).await;
    let waited_ms = late["metadata"]["sim"]["waited_ms"].as_u64().unwrap();
    assert!((200..400).contains(&waited_ms), "{waited_ms}");
    assert_eq!(late["metadata"]["others"], json!([{ "ego": "ego_1", "live": false }]));
    // Nobody waits for who was late, until there is a step.
    let alone = step(&mut host, throttle(0.5)).await;
    assert_eq!(alone["metadata"]["events"], json!([]));
    let both = tokio::join!(step(&mut guest, throttle(0.5)), async {
        tokio::time::sleep(Duration::from_millis(50)).await;
        step(&mut host, throttle(0.5)).await
    });
    assert_eq!(both.0["metadata"]["sim"]["tick"], both.1["metadata"]["sim"]["tick"]);
    assert_eq!(both.1["metadata"]["others"], json!([{ "ego": "ego_1", "live": true }]));
}

#[tokio::test]
async fn who_comes_late_has_a_whole_lease() {
    let (_, context) = testing::context();
    let times = json!({ "join_timeout_secs": 60, "lease_secs": 1 });
    let (mut host, code) = host(&context, times).await;
    let late = async {
        tokio::time::sleep(Duration::from_millis(1_200)).await;
        let (mut guest, _) = guest(&context, &code).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
        step(&mut guest, throttle(0.5)).await
    };
    let (first, _) = tokio::join!(step(&mut host, throttle(0.5)), late);
    assert_eq!(first["metadata"]["events"], json!([]));
}

#[tokio::test]
async fn who_goes_is_not_waited_for_and_another_may_come() {
    let (_, context) = testing::context();
    let (mut host, code) = host(&context, json!({ "absent": "autopilot" })).await;
    let (mut first, _) = guest(&context, &code).await;
    tokio::join!(step(&mut host, throttle(0.5)), step(&mut first, throttle(0.5)));
    drop(first);
    let alone = step(&mut host, throttle(0.5)).await;
    assert_eq!(alone["metadata"]["sim"]["tick"], 2);
    let (second, seen) = guest(&context, &code).await;
    assert_eq!(
        (&seen["metadata"]["ego"], &seen["metadata"]["sim"]["tick"]),
        (&json!("ego_1"), &json!(2))
    );
    assert_eq!(seen["step_number"], 0);
    drop(second);
}

#[tokio::test]
async fn steps_of_different_lengths_and_steps_without_time_go_together() {
    let (_, context) = testing::context();
    let (mut host, code) = host(&context, json!({})).await;
    let (mut guest, _) = guest(&context, &code).await;
    // A picture takes no time and waits for nobody.
    let picture = step(&mut guest, Action::of(ActionKind::CaptureImage)).await;
    assert_eq!(picture["metadata"]["sim"]["tick"], 0);
    let long = Action { route_steps: Some(5), ..Action::of(ActionKind::FollowRoute) };
    let many = async {
        let mut last = Value::Null;
        for _ in 0..5 {
            last = step(&mut host, throttle(0.2)).await;
        }
        last
    };
    let (short, long) = tokio::join!(many, step(&mut guest, long));
    assert_eq!(short["metadata"]["sim"]["tick"], 5);
    assert_eq!(long["metadata"]["sim"]["tick"], 5);
}

#[tokio::test]
async fn a_step_that_was_given_up_is_done_before_the_next_one() {
    let (_, context) = testing::context();
    let (mut host, code) = host(&context, json!({})).await;
    let (mut guest, _) = guest(&context, &code).await;
    let forward = throttle(1.0);
    for _ in 0..2 {
        let waited = guest.step(&forward);
        assert!(tokio::time::timeout(Duration::from_millis(50), waited).await.is_err());
    }
    let both = async {
        for _ in 0..2 {
            step(&mut host, throttle(0.0)).await;
        }
        step(&mut host, throttle(0.0)).await
    };
    let (left, right) = tokio::join!(both, step(&mut guest, throttle(0.0)));
    assert_eq!((tick_of(&left), tick_of(&right)), (3, 3));
}

fn tick_of(seen: &Value) -> u64 {
    seen["metadata"]["sim"]["tick"].as_u64().unwrap()
}

#[tokio::test]
async fn a_new_episode_of_who_made_the_world_ends_that_of_all() {
    let (port, context) = testing::context();
    let (mut host, code) = host(&context, json!({})).await;
    let (mut guest, _) = guest(&context, &code).await;
    host.reset(ResetRequest::default()).await.unwrap();
    let over = step(&mut guest, throttle(0.5)).await;
    assert_eq!((&over["done"], &over["done_reason"]), (&json!(true), &json!("world_reset")));
    assert_eq!(step(&mut guest, throttle(0.5)).await["done_reason"], "world_reset");
    let gone = guest.reset(joining(&code, None)).await.unwrap_err().to_string();
    assert!(gone.contains("ended") || gone.contains("no such world"), "{gone}");
    drop(guest);
    settle().await;
    // That of the new episode.
    assert_eq!(port.count(), 1);
}

#[tokio::test]
async fn what_cannot_be_joined_says_why_and_changes_nothing() {
    let (_, context) = testing::context();
    let (host, code) = host(&context, json!({})).await;
    let (mut guest, _) = guest(&context, &code).await;
    let before = state(&guest);
    let seeded = ResetRequest { seed: Some(1), ..joining(&code, None) };
    for (request, told) in [
        (joining("nowhere", None), "no such world"),
        (joining(&code, Some("ego_0")), "no other session"),
        (joining(&code, Some("ego_7")), "ego_0 to ego_1"),
        (joining(&code, None), "an ego that is free"),
        (seeded, "no other of these"),
    ] {
        let refused = guest.reset(request).await.unwrap_err();
        assert!(refused.to_string().contains(told), "{refused}");
        assert!(refused.is_callers_fault());
    }
    assert_eq!(state(&guest), before);
    let keep = Action {
        metadata: json!({ "op": "snapshot" }).as_object().unwrap().clone(),
        ..Action::of(ActionKind::Observe)
    };
    let refused = guest.step(&keep).await.unwrap_err();
    assert!(
        refused.is_callers_fault() && refused.to_string().contains("several egos"),
        "{refused}"
    );
    drop(host);
}

#[tokio::test]
async fn a_shared_world_that_is_lost_comes_back_for_all() {
    let (port, context) = testing::context();
    let (mut host, code) = host(&context, json!({})).await;
    let (mut guest, _) = guest(&context, &code).await;
    tokio::join!(step(&mut host, throttle(0.5)), step(&mut guest, throttle(0.5)));
    port.crash();
    let (left, right) =
        tokio::join!(step(&mut host, throttle(0.5)), step(&mut guest, throttle(0.5)));
    assert_eq!(left["metadata"]["sim"]["tick"], 2);
    assert_eq!(right["metadata"]["sim"]["tick"], 2);
}

#[tokio::test]
async fn an_ego_whose_episode_is_over_is_waited_for_by_nobody() {
    let (_, context) = testing::context();
    let (mut host, code) = host(&context, json!({ "max_steps": 2 })).await;
    let (mut guest, _) = guest(&context, &code).await;
    for _ in 0..2 {
        tokio::join!(step(&mut host, throttle(0.0)), step(&mut guest, throttle(0.0)));
    }
    let over = step(&mut host, throttle(0.0)).await;
    assert_eq!((&over["done"], &over["metadata"]["sim"]["tick"]), (&json!(true), &json!(2)));
    let mut other = Session::new(Arc::clone(&context), Quotas::default()).unwrap();
    let refused = other.reset(joining(&code, Some("ego_1"))).await.unwrap_err().to_string();
    assert!(refused.contains("not over"), "{refused}");
}
