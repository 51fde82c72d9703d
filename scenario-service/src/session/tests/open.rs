//! Worlds that CARLA's clients may come into.

use super::*;

#[tokio::test]
async fn a_world_that_is_open_says_so_and_its_steps_are_single_ticks_of_a_participant() {
    let (port, context) = testing::context();
    let mut session = Session::new(Arc::clone(&context), Quotas::default()).unwrap();
    let config = json!({ "open_to_carla": true, "ticks_per_step": 3 });
    let report = session.reset(reset_to("trolley_saves", 7, config)).await.unwrap();
    let world = port.ids()[0];
    let told = seen(&session, &report)["metadata"]["carla_world"].clone();
    assert_eq!(told, json!(schemas::carla::name_of_world(world)));
    let report = session.step(&Action::of(ActionKind::Observe)).await.unwrap();
    let seen = seen(&session, &report);
    assert_eq!(seen["metadata"]["carla_world"], told);
    assert_eq!(seen["metadata"]["sim"]["tick"], json!(3));
    let ticks = port.participants();
    assert_eq!(ticks.len(), 3);
    assert!(ticks.iter().all(|participant| participant.as_deref() == Some("face")), "{ticks:?}");
}

fn open() -> ResetRequest {
    reset_to("free_roam", 7, json!({ "open_to_carla": true }))
}

fn guest() -> schemas::ServiceId {
    "carla-1".parse().unwrap()
}

/// The world dies and is made again as it was while nobody steps. Gives its tick.
async fn comes_back(port: &ToyWorlds, session: &mut Session) -> schemas::Tick {
    let before = port.look(port.ids()[0]).unwrap();
    port.crash();
    session.move_away().await.unwrap();
    assert_eq!(port.look(port.ids()[0]).unwrap(), before);
    before.0
}

#[tokio::test]
async fn a_world_that_guests_changed_is_made_again_as_they_left_it_and_waits_for_them() {
    let (port, mut session) = session();
    session.reset(open()).await.unwrap();
    let first = port.ids()[0];
    port.guests.lock().unwrap().push(guest());
    observe(&mut session, 2).await;
    port.disturb();
    observe(&mut session, 1).await;
    comes_back(&port, &mut session).await;
    let sharing = port.sharings.lock().unwrap().last().unwrap().clone();
    assert_eq!((sharing.stands_for, sharing.guests), (Some(first), vec![guest()]));
    assert_eq!(observe(&mut session, 1).await["step_number"], 4);
}

#[tokio::test]
async fn a_world_that_guests_changed_since_the_last_step_moves_as_it_is_and_comes_back_then() {
    let (port, mut session) = session();
    session.reset(open()).await.unwrap();
    observe(&mut session, 2).await;
    let old = port.ids()[0];
    port.disturb();
    let before = port.look(old).unwrap();
    port.drains.store(true, Ordering::Relaxed);
    session.move_away().await.unwrap();
    port.drains.store(false, Ordering::Relaxed);
    settle().await;
    assert_eq!(port.ids().len(), 1);
    assert_ne!(port.ids()[0], old);
    assert_eq!(port.look(port.ids()[0]).unwrap(), before);
    port.crash();
    assert_eq!(observe(&mut session, 1).await["step_number"], 3);
}

#[tokio::test]
async fn what_a_guest_did_who_came_and_went_between_two_steps_is_kept() {
    let (port, mut session) = session();
    session.reset(open()).await.unwrap();
    observe(&mut session, 2).await;
    port.disturb();
    observe(&mut session, 1).await;
    observe(&mut session, 1).await;
    comes_back(&port, &mut session).await;
    assert_eq!(observe(&mut session, 1).await["step_number"], 5);
}

#[tokio::test]
async fn what_a_guest_did_before_a_step_without_time_is_kept() {
    let (port, mut session) = session();
    let settings = json!({ "open_to_carla": true });
    session.reset(reset_to("trolley_saves", 7, settings)).await.unwrap();
    observe(&mut session, 1).await;
    port.disturb();
    session.step(&Action::of(ActionKind::FollowRoute)).await.unwrap();
    assert_eq!(comes_back(&port, &mut session).await, schemas::Tick(1));
}

#[tokio::test]
async fn a_state_is_kept_where_guests_have_acted_and_not_where_they_only_look() {
    let (port, mut session) = session();
    session.reset(open()).await.unwrap();
    port.guests.lock().unwrap().push(guest());
    observe(&mut session, 5).await;
    assert_eq!(port.saved.lock().unwrap().len(), 0);
    for saves in 1..3 {
        port.disturb();
        observe(&mut session, 5).await;
        assert_eq!(port.saved.lock().unwrap().len(), saves);
    }
}

#[tokio::test]
async fn a_state_that_could_not_be_had_is_asked_for_again_with_the_next_step() {
    let (port, mut session) = session();
    session.reset(open()).await.unwrap();
    port.disturb();
    port.refuses_to_save.store(true, Ordering::Relaxed);
    observe(&mut session, 1).await;
    port.refuses_to_save.store(false, Ordering::Relaxed);
    observe(&mut session, 2).await;
    assert_eq!(port.saved.lock().unwrap().len(), 1);
    comes_back(&port, &mut session).await;
}

#[tokio::test]
async fn a_snapshot_has_what_guests_did_since_the_step_before_it() {
    let (port, mut session) = session();
    session.reset(open()).await.unwrap();
    observe(&mut session, 1).await;
    port.disturb();
    let before = port.look(port.ids()[0]).unwrap();
    let saved = session.saved().await.unwrap();
    session.go_on_from(saved, None).await.unwrap();
    settle().await;
    assert_eq!(port.look(port.ids()[0]).unwrap(), before);
}

#[tokio::test]
async fn a_world_with_several_egos_moves_as_well() {
    let (port, mut session) = session();
    let shared = json!({ "num_egos": 2, "join_timeout_secs": 0.1 });
    session.reset(reset_to("free_roam", 7, shared)).await.unwrap();
    observe(&mut session, 1).await;
    let old = port.ids()[0];
    port.drains.store(true, Ordering::Relaxed);
    session.move_away().await.unwrap();
    settle().await;
    assert_eq!(port.ids().len(), 1);
    assert_ne!(port.ids()[0], old);
    assert_eq!(observe(&mut session, 1).await["step_number"], 2);
}

#[tokio::test]
async fn a_world_that_is_not_open_is_ticked_as_a_whole_and_has_no_name() {
    let (port, context) = testing::context();
    let mut session = Session::new(Arc::clone(&context), Quotas::default()).unwrap();
    let config = json!({ "ticks_per_step": 3 });
    let report = session.reset(reset_to("trolley_saves", 7, config)).await.unwrap();
    assert!(seen(&session, &report)["metadata"].get("carla_world").is_none());
    session.step(&Action::of(ActionKind::Observe)).await.unwrap();
    assert_eq!(port.participants(), [None]);
}
