//! Traffic Managers that sleep, and their ports.

use super::*;

#[test]
fn one_that_sleeps_through_a_frame_is_woken_once() {
    let mut stage = Stage::with(1, true);
    stage.start_manager(1, 8_000);
    stage.call_and_finish(1, "tick_cue", ());
    stage.pass(crate::lobby::managers::PATIENCE - MOMENT);
    assert_eq!(stage.woken, [0; 0]);
    stage.pass(Duration::from_secs(60));
    assert_eq!(stage.woken, [8_000]);
}

#[test]
fn one_that_finds_no_address_of_its_own_is_where_its_client_asked_for_it() {
    let mut stage = Stage::with(2, true);
    stage.call(1, "is_traffic_manager_running", (8_000,));
    stage.call(1, "add_traffic_manager_running", (("", 0),));
    stage.call_and_finish(1, "apply_batch", ((), false));
    stage.call(2, "is_traffic_manager_running", (8_000,));
    assert_eq!(stage.borrowed, [8_000]);
    stage.call_and_finish(1, "tick_cue", ());
    stage.pass(Duration::from_secs(60));
    assert_eq!(stage.woken, [8_000]);
}

#[test]
fn a_change_of_the_settings_is_a_frame_too() {
    let mut stage = Stage::with(1, true);
    stage.start_manager(1, 8_000);
    stage.call_and_finish(1, "set_episode_settings", ());
    stage.pass(Duration::from_secs(3));
    assert_eq!(stage.woken, [8_000]);
}

#[test]
fn who_gives_a_sign_of_life_is_let_sleep() {
    type Sign = fn(&mut Stage) -> u32;
    let signs: [(&str, Sign); 3] = [
        ("a batch", |stage| stage.call_and_finish(1, "apply_batch", ((), false))),
        ("a call every second", |stage| stage.call_and_finish(1, "get_spectator", ())),
        ("a read every second", |stage| stage.call(1, "get_episode_settings", ())),
    ];
    for (name, sign) in signs {
        let mut stage = Stage::with(1, true);
        stage.start_manager(1, 8_000);
        stage.call_and_finish(1, "tick_cue", ());
        for _ in 0..10 {
            stage.pass(Duration::from_secs(1));
            sign(&mut stage);
        }
        assert_eq!(stage.woken, [0; 0], "{name}");
    }
}

#[test]
fn one_whose_batch_still_waits_for_its_turn_is_not_taken_for_asleep() {
    let mut stage = Stage::with(2, true);
    stage.start_manager(1, 8_000);
    stage.call_and_finish(1, "tick_cue", ());
    stage.call(2, "get_navigation_mesh", ());
    stage.call(1, "apply_batch", ((), false));
    stage.pass(Duration::ZERO);
    stage.now += Duration::from_secs(10);
    stage.tell(Event::Due);
    stage.finish();
    stage.pass(Duration::from_secs(10));
    assert_eq!(stage.woken, [0; 0]);
}

#[test]
fn a_port_is_had_by_one_and_free_when_its_client_is_gone() {
    let mut stage = Stage::with(3, true);
    stage.start_manager(1, 8_000);
    stage.call(2, "is_traffic_manager_running", (8_000,));
    assert_eq!(stage.borrowed, [0; 0]);
    stage.disconnect(1);
    stage.call(2, "is_traffic_manager_running", (8_000,));
    assert_eq!(stage.borrowed, [8_000]);
    stage.start_manager(2, 8_000);
    stage.call(3, "destroy_traffic_manager", (8_000,));
    stage.call(3, "is_traffic_manager_running", (8_000,));
    assert_eq!(stage.borrowed, [8_000, 8_000]);
}

#[test]
fn arguments_that_do_not_fit_are_refused() {
    let mut stage = Stage::with(1, true);
    for method in [
        "is_traffic_manager_running",
        "get_traffic_manager_running",
        "add_traffic_manager_running",
        "destroy_traffic_manager",
    ] {
        let id = stage.call(1, method, ("what", 3));
        assert!(stage.is_answered(1, id), "{method}");
    }
    assert_eq!(stage.refusals, 4);
}

#[test]
fn one_in_asynchronous_mode_is_told_once_when_its_client_ticks() {
    for (reads, told) in [(1, 0), (15, 0), (400, 1)] {
        let mut stage = Stage::with(1, true);
        stage.start_manager(1, 8_000);
        for _ in 0..50 {
            for _ in 0..reads {
                stage.call(1, "get_episode_settings", ());
            }
            stage.call_and_finish(1, "apply_batch", ((), false));
            stage.call_and_finish(1, "tick_cue", ());
        }
        assert_eq!(stage.restless, vec![8_000; told], "{reads} reads between two ticks");
    }
}

#[test]
fn one_whose_world_ticks_by_itself_may_read_as_it_likes() {
    let mut stage = Stage::with(1, false);
    stage.start_manager(1, 8_000);
    for _ in 0..5_000 {
        stage.call(1, "get_episode_settings", ());
        stage.pass(MOMENT);
    }
    assert_eq!(stage.restless, [0; 0]);
}
