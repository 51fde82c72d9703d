use super::*;

fn operation(name: &str, id: Option<&str>) -> Action {
    let metadata = json!({ "op": name, "snapshot_id": id });
    let metadata = metadata.as_object().unwrap().clone();
    Action { metadata, ..Action::of(ActionKind::Observe) }
}

fn from(id: &str) -> ResetRequest {
    ResetRequest { snapshot_id: Some(id.to_owned()), ..ResetRequest::default() }
}

async fn snapshot(session: &mut Session) -> Value {
    let report = session.step(&operation("snapshot", None)).await.unwrap();
    seen(session, &report)
}

/// Without what only an episode that was resumed has.
fn plain(mut seen: Value) -> Value {
    let sim = seen["metadata"]["sim"].as_object_mut().unwrap();
    sim.remove("restored_from");
    sim.remove("restores");
    seen
}

#[tokio::test]
async fn branches_of_one_state_go_on_as_the_episode_itself_did() {
    let (port, context) = testing::context();
    let new = || Session::new(Arc::clone(&context), Quotas::default()).unwrap();
    let mut first = new();
    first.reset(reset_to("trolley_saves", 7, json!({ "max_steps": 30 }))).await.unwrap();
    let before = observe(&mut first, 3).await;
    let kept = snapshot(&mut first).await;
    assert_eq!(kept["step_number"], before["step_number"], "no step is counted");
    assert_eq!(kept["metadata"]["sim"], before["metadata"]["sim"], "no time passes");
    assert!(kept["metadata"]["snapshot_bytes"].as_u64().unwrap() > 0);
    let id = kept["metadata"]["snapshot_id"].as_str().unwrap();
    let after = observe(&mut first, 4).await;
    for times in 1..=3 {
        let mut branch = new();
        let report = branch.reset(from(id)).await.unwrap();
        let begun = seen(&branch, &report);
        assert_eq!(begun["metadata"]["sim"]["restored_from"], id);
        assert_eq!(begun["metadata"]["sim"]["restores"], 1);
        assert_eq!(begun["step_number"], 3);
        assert_eq!(plain(observe(&mut branch, 4).await), after, "branch {times}");
        assert_eq!(state(&branch)["step_count"], state(&first)["step_count"]);
        assert_ne!(state(&branch)["episode_id"], state(&first)["episode_id"]);
        // Another action leads elsewhere, in this branch alone.
        let report = branch.step(&lane_change("left")).await.unwrap();
        assert_ne!(seen(&branch, &report)["metadata"]["sim"], Value::Null);
        // A state of a branch is one, too.
        let again = snapshot(&mut branch).await;
        let report = branch.reset(from(again["metadata"]["snapshot_id"].as_str().unwrap())).await;
        assert_eq!(seen(&branch, &report.unwrap())["metadata"]["sim"]["restores"], 2);
    }
    drop(first);
    settle().await;
    let mut late = new();
    late.reset(from(id)).await.unwrap();
    assert!(port.count() >= 1, "a snapshot outlives the session that it is of");
}

#[tokio::test]
async fn what_cannot_be_gone_back_to_is_refused_and_changes_nothing() {
    let (_, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let before = observe(&mut session, 2).await;
    let kept = snapshot(&mut session).await;
    let id = kept["metadata"]["snapshot_id"].as_str().unwrap().to_owned();
    let other = ResetRequest { seed: Some(3), ..from(&id) };
    for (refused, words) in [
        (session.reset(from("nobody")).await, "there is no such snapshot"),
        (session.reset(other).await, "has that one's scenario"),
        (session.step(&operation("forget", Some("nobody"))).await, "there is no such snapshot"),
    ] {
        let error = refused.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    assert_eq!(observe(&mut session, 0).await, Value::Null);
    session.step(&operation("forget", Some(&id))).await.unwrap();
    assert!(session.reset(from(&id)).await.is_err(), "it was given up");
    let now = snapshot(&mut session).await;
    assert_eq!(now["metadata"]["sim"], before["metadata"]["sim"]);
    let report = session.step(&operation("another's", None)).await.unwrap();
    let steps = before["step_number"].as_u64().unwrap();
    assert_eq!(seen(&session, &report)["step_number"], steps + 1, "metadata that is not ours");
}

#[tokio::test]
async fn a_sealed_episode_knows_no_snapshots() {
    let (_, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let kept = snapshot(&mut session).await;
    let id = kept["metadata"]["snapshot_id"].as_str().unwrap();
    session.reset(reset_to("trolley_saves", 7, json!({ "sealed": true }))).await.unwrap();
    let before = observe(&mut session, 1).await;
    for refused in [session.step(&operation("snapshot", None)).await, session.reset(from(id)).await]
    {
        let error = refused.unwrap_err();
        assert!(error.is_callers_fault() && error.to_string().contains("SEALED"), "{error}");
    }
    let after = observe(&mut session, 1).await;
    assert_eq!(after["step_number"], before["step_number"].as_u64().unwrap() + 1);
    session.reset(reset_to("trolley_saves", 7, json!({ "sealed": false }))).await.unwrap();
    snapshot(&mut session).await;
}

#[tokio::test]
async fn the_oldest_snapshots_go_where_there_is_no_room() {
    let (_, mut session) = session();
    session.reset(reset_to("trolley_saves", 7, json!({}))).await.unwrap();
    let first = snapshot(&mut session).await;
    let first = first["metadata"]["snapshot_id"].as_str().unwrap().to_owned();
    for _ in 1..crate::limits::SAVED_MAX {
        snapshot(&mut session).await;
    }
    session.reset(from(&first)).await.unwrap();
    let last = snapshot(&mut session).await;
    let error = session.reset(from(&first)).await.unwrap_err().to_string();
    assert!(error.contains("no such snapshot") && error.contains("256 at most"), "{error}");
    session.reset(from(last["metadata"]["snapshot_id"].as_str().unwrap())).await.unwrap();
}
