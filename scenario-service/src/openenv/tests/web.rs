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
