//! Worlds that go with their service, and come back.

use super::*;
use crate::scenario::Profile;
use crate::world_port::WorldPort;

#[tokio::test]
async fn a_lost_world_is_told_until_a_reset_begins_anew() {
    let port = Arc::new(ToyWorlds::default());
    let shared = Arc::clone(&port) as Arc<dyn WorldPort>;
    let context = SessionContext::new(
        testing::visitor().tenant,
        shared,
        "trolley_saves".to_owned(),
        Profile::Documented,
    );
    let context = Arc::new(context.recovering(0));
    let mut session = Session::new(context, Quotas::default()).unwrap();
    session.reset(ResetRequest::default()).await.unwrap();
    port.crash();
    for _ in 0..2 {
        let error = session.step(&Action::of(ActionKind::Observe)).await.unwrap_err().to_string();
        assert!(error.starts_with("the world of this episode is gone ("), "{error}");
        assert!(error.ends_with("; reset to start a new episode"), "{error}");
    }
    session.reset(ResetRequest::default()).await.unwrap();
    assert_eq!(observe(&mut session, 1).await["step_number"], 1);
}

#[tokio::test]
async fn an_episode_goes_on_in_a_world_that_is_made_again() {
    let (_, mut quiet) = session();
    let (port, mut disturbed) = session();
    for session in [&mut quiet, &mut disturbed] {
        session.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
    }
    // Further than one state is good for.
    for step in 0..8 {
        if step % 3 != 0 {
            port.crash();
        }
        // What it does shows in how fast the car goes.
        let throttle = if step % 2 == 0 { 0.8 } else { 0.1 };
        let drive = Action { throttle, ..Action::of(ActionKind::Control) };
        for session in [&mut quiet, &mut disturbed] {
            session.step(&drive).await.unwrap();
        }
        if step % 3 == 1 {
            port.crash();
        }
        let ticks = 30 + step;
        let (wanted, found) =
            (observe(&mut quiet, ticks).await, observe(&mut disturbed, ticks).await);
        assert_eq!(found, wanted, "step {step}");
        assert_eq!(disturbed.present().unwrap().0, quiet.present().unwrap().0);
    }
    settle().await;
    assert_eq!(port.count(), 1, "what was made again took the place of what was lost");
}

#[tokio::test]
async fn a_refused_place_is_refused_in_a_world_that_is_made_again() {
    let (port, mut session) = session();
    session.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
    let before = observe(&mut session, 1).await["step_number"].clone();
    port.crash();
    let far = Action {
        destination_x: Some(9e4),
        destination_y: Some(0.0),
        destination_z: Some(0.0),
        ..Action::of(ActionKind::SetDestination)
    };
    assert!(matches!(session.step(&far).await, Err(SessionError::Refused(_))));
    assert_eq!(before, json!(1));
    assert_eq!(observe(&mut session, 1).await["step_number"], 2);
}

#[tokio::test]
async fn a_step_that_is_given_up_while_a_state_is_kept_was_not_done() {
    let (port, mut session) = session();
    session.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
    let (_, mut quiet) = super::session();
    quiet.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
    observe(&mut session, 199).await;
    observe(&mut quiet, 199).await;
    port.is_slow_to_save.store(true, Ordering::Relaxed);
    let observed = Action::of(ActionKind::Observe);
    let given_up =
        tokio::time::timeout(std::time::Duration::from_millis(50), session.step(&observed));
    assert!(given_up.await.is_err());
    port.is_slow_to_save.store(false, Ordering::Relaxed);
    assert_eq!(observe(&mut session, 3).await, observe(&mut quiet, 3).await);
}

#[tokio::test]
async fn a_world_that_found_no_room_to_be_made_again_has_it_when_there_is_some() {
    const ROOM: usize = 1 << 20;
    let port = Arc::new(ToyWorlds::default());
    let shared = Arc::clone(&port) as Arc<dyn WorldPort>;
    let context = SessionContext::new(
        testing::visitor().tenant,
        shared,
        "free_roam".to_owned(),
        Profile::Documented,
    );
    let context = Arc::new(context.recovering(ROOM));
    // All but less than any state needs.
    let taken = worlds::State::Snapshot(vec![0; ROOM - 2 * size_of::<worlds::State>() + 1]);
    let taken = worlds::Recovery::new(taken, &context.recovery).unwrap();
    let mut session = Session::new(Arc::clone(&context), Quotas::default()).unwrap();
    session.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
    drop(taken);
    observe(&mut session, worlds::RECOVERY_TICKS as usize + 5).await;
    port.crash();
    session.step(&Action::of(ActionKind::Observe)).await.unwrap();
}

#[tokio::test]
async fn a_world_that_cannot_be_made_again_now_is_made_again_later() {
    let (port, mut session) = session();
    session.reset(ResetRequest::default()).await.unwrap();
    port.crash();
    port.full.store(true, Ordering::Relaxed);
    let error = session.step(&Action::of(ActionKind::Observe)).await.unwrap_err();
    assert_eq!(error.to_string(), "the service is full");
    port.full.store(false, Ordering::Relaxed);
    assert_eq!(observe(&mut session, 1).await["step_number"], 1);
}
