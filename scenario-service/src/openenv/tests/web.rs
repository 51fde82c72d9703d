//! The web interface: on and off, and its session.

use super::*;

async fn serve_web(has_web: bool, mode: Mode) -> (Arc<ToyWorlds>, SocketAddr) {
    let door = Door::open(testing::visitor().tenant);
    serve_with(Bounds::for_sessions(4), door, (4, has_web), mode).await
}

#[tokio::test]
async fn without_the_web_interface_there_is_no_page_and_the_rest_stays() {
    for (has_web, wanted) in [(true, 200), (false, 404)] {
        let (_port, address) = serve_web(has_web, Mode::Simulation).await;
        for path in ["/", "/web", "/web/metadata", "/web/state"] {
            assert_eq!(json_of(address, "GET", path, None).await.0, wanted, "{path} {has_web}");
        }
        let (status, _) = json_of(address, "POST", "/web/reset", Some("{}")).await;
        assert_eq!(status, wanted, "{has_web}");
        let to_page = json_of(address, "GET", "/web/", None).await.0;
        assert_eq!(to_page, if has_web { 307 } else { 404 });
        for path in ["/health", "/docs", "/state"] {
            assert_eq!(json_of(address, "GET", path, None).await.0, 200, "{path} {has_web}");
        }
    }
}

#[tokio::test]
async fn all_who_use_the_routes_below_web_share_one_session() {
    let (port, address) = serve_web(true, Mode::Simulation).await;
    let (status, fresh) = json_of(address, "GET", "/web/state", None).await;
    assert_eq!((status, &fresh["step_count"]), (200, &json!(0)), "{fresh}");
    until_no_worlds(&port).await;
    let asked = json!({ "seed": 7, "episode_id": "by-hand", "scenario_name": "free_roam" });
    let (status, begun) = json_of(address, "POST", "/web/reset", Some(&asked.to_string())).await;
    assert_eq!((status, &begun["done"], &begun["reward"]), (200, &json!(false), &Value::Null));
    assert!(begun["observation"]["scene_description"].is_string(), "{begun}");
    // Without an action, and without a body, it observes.
    for body in [Some("{}"), None, Some(r#"{"action":{"action_type":"observe"}}"#)] {
        let (status, stepped) = json_of(address, "POST", "/web/step", body).await;
        assert_eq!((status, &stepped["done"]), (200, &json!(false)), "{body:?}: {stepped}");
    }
    let (_, state) = json_of(address, "GET", "/web/state", None).await;
    let found = (&state["episode_id"], &state["step_count"], &state["seed"]);
    assert_eq!(found, (&json!("by-hand"), &json!(3), &json!(7)), "{state}");
    assert_eq!(port.count(), 1);
    let (status, refused) =
        json_of(address, "POST", "/web/step", Some(r#"{"action":{"throttle":7}}"#)).await;
    assert_eq!((status, &refused["detail"][0]["type"]), (422, &json!("less_than_equal")));
}

#[tokio::test]
async fn in_production_the_web_interface_controls_no_episode() {
    let (_port, address) = serve_web(true, Mode::Production).await;
    assert_eq!(json_of(address, "GET", "/web", None).await.0, 200);
    for (method, path) in [("POST", "/web/reset"), ("POST", "/web/step"), ("GET", "/web/state")] {
        let body = (method == "POST").then_some("{}");
        assert_eq!(json_of(address, method, path, body).await.0, 404, "{path}");
    }
}

#[tokio::test]
async fn who_listens_is_told_what_the_session_of_the_web_interface_does() {
    let (_port, address) = serve_web(true, Mode::Simulation).await;
    let mut socket = connect(address, "/ui").await;
    let fresh = receive(&mut socket).await;
    assert_eq!(
        fresh,
        json!({ "type": "state_update", "episode_state": { "episode_id": null, "step_count": 0,
            "current_observation": null, "action_logs": [], "is_reset": true } })
    );
    let asked = json!({ "seed": 7, "episode_id": "by-hand" }).to_string();
    let (_, begun) = json_of(address, "POST", "/web/reset", Some(&asked)).await;
    let told = receive(&mut socket).await["episode_state"].take();
    assert_eq!((&told["episode_id"], &told["step_count"]), (&json!("by-hand"), &json!(0)));
    assert_eq!(told["current_observation"]["seed"], begun["observation"]["seed"]);
    // What a client says keeps the connection and is not answered.
    socket.send(Message::text("still here")).await.unwrap();
    for step in 1..=102 {
        let action = json!({ "action": { "action_type": "maintain_speed" } }).to_string();
        assert_eq!(json_of(address, "POST", "/web/step", Some(&action)).await.0, 200);
        let told = receive(&mut socket).await["episode_state"].take();
        let logs = told["action_logs"].as_array().unwrap();
        assert_eq!((&told["is_reset"], &told["step_count"]), (&json!(false), &json!(step)));
        assert_eq!(logs.len(), step.min(100));
        let last = logs.last().unwrap();
        assert_eq!(last["action"]["action_type"], "maintain_speed");
        let time = last["timestamp"].as_str().unwrap();
        let time: jiff::Timestamp = time.parse().unwrap();
        assert!(jiff::Timestamp::now().duration_since(time).as_secs() < 60, "{time}");
        assert_eq!(last["step_count"], step);
        assert_eq!(told["current_observation"]["step_number"], step);
    }
    // Who comes later is told at once, and a reset begins a new log.
    let mut second = connect(address, "/ui").await;
    assert_eq!(receive(&mut second).await["episode_state"]["step_count"], 102);
    json_of(address, "POST", "/web/reset", None).await;
    for socket in [&mut socket, &mut second] {
        let told = receive(socket).await["episode_state"].take();
        assert_eq!((&told["is_reset"], &told["action_logs"]), (&json!(true), &json!([])));
    }
}

#[test]
fn the_page_offers_every_scenario_that_has_a_name() {
    let page = crate::openenv::docs::INDEX;
    let options = page.split("<option>").skip(1).filter_map(|rest| rest.split('<').next());
    assert_eq!(options.collect::<Vec<_>>(), crate::scenario::registry::NAMED);
}
