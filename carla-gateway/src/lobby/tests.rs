//! What is known to end or to stop a client, without one: who waits for what, and how long.

mod late_answers;
mod loads;
mod losses;
mod managers;
mod participants;
mod simulation;
mod stage;
mod turns;
mod visits;

use std::time::Duration;

use super::*;
use stage::{PACING, PERIOD, Stage};

const MOMENT: Duration = Duration::from_millis(1);

#[test]
fn calls_are_answered_one_after_the_other_in_the_order_of_arrival() {
    let mut stage = Stage::with(2, true);
    let first = stage.call(1, "get_weather_parameters", ());
    let second = stage.call(2, "get_spectator", ());
    let third = stage.call(1, "get_map_info", ());
    for (client, id) in [(1, first), (2, second), (1, third)] {
        assert!(!stage.is_answered(client, id));
        stage.finish_one(Timing::Now, true);
        assert!(stage.is_answered(client, id));
    }
}

#[test]
fn every_call_that_the_table_leaves_to_the_lobby_is_answered_here() {
    let mut stage = Stage::with(1, true);
    let mut count = 0;
    for name in crate::calls::left_to_the_lobby() {
        let id = match name {
            "version" | "get_episode_settings" => stage.call(1, name, ()),
            "add_traffic_manager_running" => stage.call(1, name, (("localhost", 8_000),)),
            _ => stage.call(1, name, (8_000,)),
        };
        assert!(stage.job.is_none(), "{name} has come to the endpoint");
        assert!(stage.is_answered(1, id), "{name}");
        count += 1;
    }
    assert_eq!((count, stage.refusals), (6, 0));
}

#[test]
fn version_and_settings_are_told_while_a_call_is_under_way() {
    let mut stage = Stage::with(2, true);
    let slow = stage.call(1, "load_new_episode", (true,));
    for method in ["version", "get_episode_settings"] {
        let id = stage.call(2, method, ());
        assert!(stage.is_answered(2, id), "{method}");
    }
    assert!(!stage.is_answered(1, slow));
}

#[tokio::test]
async fn a_call_whose_answer_comes_later_holds_nobody_up() {
    let mut stage = Stage::with(2, true);
    let question = stage.call(1, "show_recorder_file_info", ("a.log", false));
    let tick = stage.call(2, "tick_cue", ());
    stage.later = Some(tokio::spawn(std::future::pending()));
    stage.finish_one(Timing::Now, true);
    assert_eq!(stage.answered_later, [(1, question)]);
    stage.finish();
    assert!(stage.is_answered(2, tick) && !stage.is_answered(1, question));
}

#[tokio::test]
async fn a_call_that_comes_again_holds_nobody_up_and_is_answered_then() {
    let mut stage = Stage::with(2, true);
    let replay = stage.call(1, "replay_file", ());
    let tick = stage.call(2, "tick_cue", ());
    stage.opening = Some(tokio::spawn(std::future::pending()));
    stage.finish_one(Timing::Now, true);
    stage.finish();
    assert!(stage.is_answered(2, tick) && !stage.is_answered(1, replay));
    stage.come_again();
    stage.finish();
    assert!(stage.is_answered(1, replay));
    // Nobody waits for this one any more when it comes again.
    stage.call(1, "replay_file", ());
    stage.opening = Some(tokio::spawn(std::future::pending()));
    stage.finish_one(Timing::Now, true);
    stage.disconnect(1);
    stage.come_again();
    assert!(stage.job.is_none());
}

#[test]
fn a_tick_is_answered_before_the_world_advances() {
    let mut stage = Stage::with(1, true);
    let before = stage.frame_number;
    let tick = stage.call(1, "tick_cue", ());
    assert!(matches!(stage.job.as_ref().unwrap().task, Task::Prepare));
    stage.finish_one(Timing::Now, true);
    assert!(stage.is_answered(1, tick));
    assert_eq!(stage.frame_number, before);
    stage.finish();
    assert_eq!(stage.frame_number, before + 1);
}

#[test]
fn a_tick_that_cannot_be_says_so_and_advances_nothing() {
    let mut stage = Stage::with(1, true);
    let before = stage.frame_number;
    let tick = stage.call(1, "tick_cue", ());
    stage.finish_one(Timing::Now, false);
    assert!(stage.is_answered(1, tick) && stage.job.is_none());
    assert_eq!((stage.refusals, stage.frame_number), (1, before));
}

/// Whether the world ticks by itself within a second of doing nothing.
#[test]
fn the_world_ticks_by_itself_only_where_nobody_else_does() {
    type Change = fn(&mut Stage);
    let table: [(&str, bool, Change); 5] = [
        ("asynchronous mode", true, |_| {}),
        ("synchronous mode", false, |stage| {
            stage.settings.synchronous_mode = true;
            stage.call_and_finish(1, "set_episode_settings", ());
        }),
        ("nobody is connected", false, |stage| stage.disconnect(1)),
        ("the world is lost", false, |stage| {
            stage.world = WorldState::Lost;
            stage.call_and_finish(1, "get_spectator", ());
        }),
        ("Traffic Managers change over", false, |stage| {
            stage.start_manager(1, 8_000);
            stage.call_and_finish(1, "load_new_episode", ());
        }),
    ];
    for (name, wanted, change) in table {
        let mut stage = Stage::with(1, false);
        change(&mut stage);
        let before = stage.frame_number;
        stage.pass(Duration::from_secs(1));
        assert_eq!(stage.frame_number > before, wanted, "{name}");
    }
}

#[test]
fn the_world_goes_on_where_it_stood_when_somebody_comes_back() {
    let mut stage = Stage::with(1, false);
    stage.disconnect(1);
    stage.pass(Duration::from_secs(60));
    let before = stage.frame_number;
    stage.connect(2);
    stage.pass(PERIOD - MOMENT);
    assert_eq!(stage.frame_number, before);
    stage.pass(MOMENT);
    assert_eq!(stage.frame_number, before + 1);
}

#[test]
fn a_lease_ends_synchronous_mode_when_nobody_ticks() {
    let mut stage = Stage::new();
    let pacing = Pacing { sync_lease: Some(Duration::from_secs(2)), ..PACING };
    stage.lobby = Lobby::new(pacing, ClientVersion::V0_9, stage.now);
    stage.connect(1);
    stage.settings.synchronous_mode = true;
    stage.call_and_finish(1, "load_new_episode", (true,));
    let before = stage.frame_number;
    stage.pass(Duration::from_millis(2_240));
    assert_eq!(stage.frame_number, before);
    stage.pass(Duration::from_millis(20));
    assert_eq!(stage.frame_number, before + 1);
}

#[test]
fn after_a_tick_that_failed_the_world_pauses() {
    let mut stage = Stage::with(1, false);
    stage.now = stage.lobby.due().unwrap();
    stage.tell(Event::Due);
    stage.finish_one(Timing::Now, false);
    assert!(stage.lobby.due().unwrap() >= stage.now + Duration::from_millis(500));
}
