//! A map is loaded while Traffic Managers run.

use super::*;
use crate::lobby::changeover::{PATIENCE, RETURN_PATIENCE, SETTLING};
use crate::lobby::held::READY_AFTER;

/// Loads a map while a Traffic Manager runs in client 1; gives the call.
fn begin(stage: &mut Stage) -> u32 {
    stage.start_manager(1, 8_000);
    let load = stage.call(1, "load_new_episode", ());
    stage.finish_one(Timing::Now, true);
    assert!(matches!(stage.job.as_ref().unwrap().task, Task::ShowEpisode), "all see it first");
    stage.finish();
    assert!(!stage.is_answered(1, load));
    load
}

/// The Traffic Manager of client 1 has got the new map.
fn get_map(stage: &mut Stage) {
    stage.call_and_finish(1, "get_required_files", ("TM",));
}

#[test]
fn without_traffic_managers_it_is_answered_at_once() {
    let mut stage = Stage::with(1, false);
    let load = stage.call_and_finish(1, "load_new_episode", ());
    assert!(stage.is_answered(1, load));
}

#[test]
fn it_is_answered_when_the_traffic_manager_has_changed_over_and_all_go_on_after_it() {
    for synchronous in [false, true] {
        let mut stage = Stage::with(1, synchronous);
        let load = begin(&mut stage);
        get_map(&mut stage);
        let read = stage.call(1, "get_episode_settings", ());
        assert!(!stage.is_answered(1, read));
        stage.pass(SETTLING - MOMENT);
        assert!(!stage.is_answered(1, load));
        stage.pass(MOMENT);
        assert!(stage.is_answered(1, load) && !stage.is_answered(1, read));
        stage.call_and_finish(1, "get_episode_info", ());
        assert!(!stage.is_answered(1, read));
        let own = stage.call(1, "get_episode_settings", ());
        assert!(stage.is_answered(1, own) && stage.is_answered(1, read));
        assert!(matches!(stage.lobby.phase, Phase::Settled));
    }
}

#[test]
fn reads_pass_until_the_traffic_manager_has_the_map() {
    let mut stage = Stage::with(1, false);
    begin(&mut stage);
    for _ in 0..3 {
        let read = stage.call(1, "get_episode_settings", ());
        assert!(stage.is_answered(1, read));
    }
    stage.call_and_finish(1, "get_required_files", ("",));
    let read = stage.call(1, "get_episode_settings", ());
    assert!(stage.is_answered(1, read), "files of others");
}

#[test]
fn two_traffic_managers_of_a_client_are_waited_for() {
    let mut stage = Stage::with(1, false);
    stage.start_manager(1, 8_001);
    let load = begin(&mut stage);
    get_map(&mut stage);
    let read = stage.call(1, "get_episode_settings", ());
    assert!(stage.is_answered(1, read));
    get_map(&mut stage);
    stage.call(1, "get_episode_settings", ());
    stage.pass(SETTLING);
    assert!(stage.is_answered(1, load));
}

#[test]
fn one_that_never_changes_over_holds_its_client_up_for_so_long() {
    let mut stage = Stage::with(1, false);
    let load = begin(&mut stage);
    stage.pass(PATIENCE - MOMENT);
    assert!(!stage.is_answered(1, load));
    stage.pass(MOMENT);
    assert!(stage.is_answered(1, load));
}

#[test]
fn a_client_that_never_returns_holds_its_reads_up_for_so_long() {
    let mut stage = Stage::with(1, false);
    let load = begin(&mut stage);
    get_map(&mut stage);
    let read = stage.call(1, "get_episode_settings", ());
    stage.pass(SETTLING + RETURN_PATIENCE - MOMENT);
    assert!(stage.is_answered(1, load) && !stage.is_answered(1, read));
    stage.pass(MOMENT);
    assert!(stage.is_answered(1, read));
}

#[test]
fn a_read_of_the_version_lets_nobody_through_nor_shuts_anybody_out() {
    let mut stage = Stage::with(1, false);
    begin(&mut stage);
    get_map(&mut stage);
    stage.pass(PATIENCE);
    stage.call(1, "version", ());
    let read = stage.call(1, "get_episode_settings", ());
    assert!(!stage.is_answered(1, read));
    stage.pass(RETURN_PATIENCE);
    assert!(stage.is_answered(1, read));
}

#[test]
fn the_silence_of_one_that_reads_its_map_is_not_taken_for_sleep() {
    let mut stage = Stage::with(1, true);
    begin(&mut stage);
    get_map(&mut stage);
    stage.pass(Duration::from_secs(5));
    assert_eq!(stage.woken, [0; 0]);
}

#[test]
fn that_of_another_client_waits_until_the_traffic_managers_are_ready() {
    let mut stage = Stage::with(2, false);
    stage.start_manager(2, 8_001);
    let first = begin(&mut stage);
    let loaded_at = stage.now;
    let second = stage.call(2, "load_new_episode", ());
    assert!(stage.job.is_none(), "one load replaces the map of another");
    get_map(&mut stage);
    stage.call(1, "get_episode_settings", ());
    stage.pass(SETTLING);
    assert!(stage.is_answered(1, first));
    stage.call_and_finish(1, "get_episode_info", ());
    stage.call(1, "get_episode_settings", ());
    stage.pass(READY_AFTER - (stage.now - loaded_at) - MOMENT);
    let episodes = stage.episodes_begun;
    stage.pass(MOMENT);
    assert_eq!(stage.episodes_begun, episodes + 1);
    stage.pass(PATIENCE);
    assert!(stage.is_answered(2, second));
}

#[test]
fn that_of_another_client_waits_for_nobody_where_no_traffic_manager_runs() {
    let mut stage = Stage::with(2, false);
    let first = stage.call_and_finish(1, "load_new_episode", ());
    let second = stage.call_and_finish(2, "load_new_episode", ());
    assert!(stage.is_answered(1, first) && stage.is_answered(2, second));
}

#[test]
fn who_goes_while_it_waits_leaves_nothing_behind() {
    let mut stage = Stage::with(2, false);
    begin(&mut stage);
    let held = stage.call(2, "load_new_episode", ());
    stage.disconnect(2);
    assert_eq!(stage.lobby.held.len(), 0);
    stage.disconnect(1);
    assert!(matches!(stage.lobby.phase, Phase::Settled));
    stage.pass(Duration::from_secs(20));
    assert!(!stage.is_answered(2, held));
}

#[test]
fn a_load_that_fails_is_answered_at_once() {
    let mut stage = Stage::with(1, false);
    stage.start_manager(1, 8_000);
    let load = stage.call(1, "load_new_episode", ());
    stage.finish_one(Timing::Now, false);
    assert!(stage.is_answered(1, load));
    assert_eq!(stage.refusals, 1);
}

#[test]
fn the_world_stands_still_for_a_moment_after_it() {
    let mut stage = Stage::with(1, false);
    stage.call_and_finish(1, "load_new_episode", ());
    let before = stage.frame_number;
    stage.pass(QUIET_AFTER_LOAD);
    assert_eq!(stage.frame_number, before);
    stage.pass(PERIOD);
    assert_eq!(stage.frame_number, before + 1);
}
