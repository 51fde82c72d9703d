//! Answers that wait for a frame or a step of a Traffic Manager.

use super::*;

#[test]
fn who_is_spawned_is_answered_half_a_frame_after_it_is_seen() {
    let mut stage = Stage::with(1, false);
    stage.pass(MOMENT);
    let next_frame = stage.lobby.due().unwrap();
    let spawn = stage.call(1, "spawn_actor", ());
    stage.finish_one(Timing::WithNextFrame, true);
    stage.pass(next_frame - stage.now);
    assert!(!stage.is_answered(1, spawn));
    stage.pass(PERIOD / 2 - MOMENT);
    assert!(!stage.is_answered(1, spawn));
    stage.pass(MOMENT);
    assert!(stage.is_answered(1, spawn));
}

#[test]
fn a_call_waits_for_no_frame_that_will_not_come() {
    let mut stage = Stage::with(2, true);
    let spawn = stage.call(1, "spawn_actor", ());
    stage.finish_one(Timing::WithNextFrame, true);
    assert!(stage.is_answered(1, spawn), "synchronous mode");

    let mut stage = Stage::with(2, false);
    let spawn = stage.call(1, "spawn_actor", ());
    stage.finish_one(Timing::WithNextFrame, true);
    stage.settings.synchronous_mode = true;
    stage.call_and_finish(2, "set_episode_settings", ());
    assert!(stage.is_answered(1, spawn), "synchronous mode from now on");

    let mut stage = Stage::with(2, false);
    let spawn = stage.call(1, "spawn_actor", ());
    stage.finish_one(Timing::WithNextFrame, true);
    stage.world = WorldState::Lost;
    stage.call_and_finish(2, "get_spectator", ());
    assert!(stage.is_answered(1, spawn), "the world is lost");
}

#[test]
fn who_destroys_a_vehicle_waits_only_if_a_traffic_manager_of_its_own_runs() {
    for (manager_of, waits) in [(None, false), (Some(2), false), (Some(1), true)] {
        let mut stage = Stage::with(2, false);
        if let Some(client) = manager_of {
            stage.start_manager(client, 8_000);
            // It has no vehicles: no step comes.
            stage.pass(Duration::from_secs(1));
        }
        let destroy = stage.call(1, "destroy_actor", ());
        stage.finish_one(Timing::AfterManagersStep, true);
        assert_eq!(!stage.is_answered(1, destroy), waits, "manager of {manager_of:?}");
        stage.pass(PERIOD * 2);
        assert!(stage.is_answered(1, destroy));
    }
}

#[test]
fn who_destroys_a_vehicle_waits_for_steps_while_they_come() {
    let mut stage = Stage::with(2, false);
    stage.start_manager(1, 8_000);
    stage.start_manager(2, 8_010);
    for _ in 0..2 {
        let destroy = stage.call(1, "destroy_actor", ());
        stage.finish_one(Timing::AfterManagersStep, true);
        stage.call_and_finish(1, "apply_batch", ((), false));
        stage.pass(PERIOD * 2);
        assert!(!stage.is_answered(1, destroy), "one step was before the frame");
        stage.call_and_finish(1, "apply_batch", ((), false));
        stage.call_and_finish(2, "apply_batch", ((), false));
        stage.pass(MOMENT);
        assert!(!stage.is_answered(1, destroy), "of two steps one was of another client");
        stage.call_and_finish(1, "apply_batch", ((), false));
        stage.pass(MOMENT);
        assert!(stage.is_answered(1, destroy));
    }
    let last = stage.call(1, "destroy_actor", ());
    stage.finish_one(Timing::AfterManagersStep, true);
    stage.pass(PERIOD * 2 + crate::lobby::late::STEPS_PATIENCE);
    assert!(stage.is_answered(1, last), "no step comes");
}

#[test]
fn a_manager_steps_into_asynchronous_mode_when_destroyed_vehicles_are_out_of_sight() {
    for (manager_of, destroys, ticks, waits) in [
        (1, true, false, true),
        (1, false, false, false),
        (1, true, true, false),
        (2, true, false, false),
    ] {
        let mut stage = Stage::with(2, true);
        stage.start_manager(manager_of, 8_000);
        if destroys {
            let destroy = stage.call(1, "destroy_actor", ());
            stage.finish_one(Timing::AfterManagersStep, true);
            assert!(stage.is_answered(1, destroy), "no frame comes");
        }
        if ticks {
            stage.call_and_finish(1, "tick_cue", ());
        }
        stage.settings.synchronous_mode = false;
        let change = stage.call(1, "set_episode_settings", ());
        stage.finish_one(Timing::Now, true);
        let case = format!("manager of {manager_of}, destroys: {destroys}, ticks: {ticks}");
        assert_eq!(!stage.is_answered(1, change), waits, "{case}");
        stage.finish();
        stage.pass(PERIOD);
        assert!(stage.is_answered(1, change), "{case}");
    }
}

#[test]
fn nothing_waits_for_who_is_gone() {
    let mut stage = Stage::with(2, false);
    stage.call(2, "spawn_actor", ());
    stage.finish_one(Timing::WithNextFrame, true);
    assert_eq!(stage.lobby.late.len(), 1);
    stage.disconnect(2);
    assert_eq!(stage.lobby.late.len(), 0);
}

#[test]
fn who_destroys_vehicles_in_a_batch_that_ticks_waits_for_no_frame_afterwards() {
    for (batches_tick, waits) in [(true, false), (false, true)] {
        let mut stage = Stage::with(1, true);
        stage.start_manager(1, 8_000);
        stage.batches_tick = batches_tick;
        let before = stage.frame_number;
        stage.call(1, "apply_batch", ((), batches_tick));
        stage.finish_one(Timing::AfterManagersStep, true);
        assert_eq!(stage.frame_number - before, u64::from(batches_tick));
        stage.settings.synchronous_mode = false;
        let change = stage.call(1, "set_episode_settings", ());
        stage.finish_one(Timing::Now, true);
        assert_eq!(!stage.is_answered(1, change), waits, "the batch ticks: {batches_tick}");
    }
}
