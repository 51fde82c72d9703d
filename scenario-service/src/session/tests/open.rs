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
