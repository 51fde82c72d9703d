//! Ticks and calls take turns.

use super::*;
use crate::lobby::pace::Loss;

/// Lets a tick that is due take so long.
fn long_tick(stage: &mut Stage, span: Duration) {
    stage.now = stage.now.max(stage.lobby.due().unwrap());
    stage.tell(Event::Due);
    assert!(matches!(stage.job.as_ref().unwrap().task, Task::TickByItself));
    stage.now += span;
}

#[test]
fn calls_have_their_turn_between_ticks_that_take_longer_than_their_period() {
    let mut stage = Stage::with(1, false);
    for _ in 0..20 {
        long_tick(&mut stage, PERIOD * 5);
        let waiting = stage.call(1, "get_spectator", ());
        stage.finish_one(Timing::Now, true);
        assert!(matches!(stage.job.as_ref().unwrap().task, Task::Call(..)));
        stage.finish_one(Timing::Now, true);
        assert!(stage.is_answered(1, waiting));
        // So has who answers to an answer.
        stage.now += Duration::from_millis(5);
        let next = stage.call_and_finish(1, "get_spectator", ());
        assert!(stage.is_answered(1, next));
    }
}

#[test]
fn a_flood_of_calls_does_not_keep_the_world_from_ticking() {
    let mut stage = Stage::with(1, false);
    long_tick(&mut stage, PERIOD * 5);
    for _ in 0..CALLS_MAX {
        stage.call(1, "get_spectator", ());
    }
    assert!(!stage.lobby.has_room());
    stage.finish_one(Timing::Now, true);
    let mut calls = 0;
    while matches!(stage.job.as_ref().unwrap().task, Task::Call(..)) {
        stage.now += MOMENT;
        stage.finish_one(Timing::Now, true);
        calls += 1;
    }
    assert_eq!(calls, 64);
}

#[test]
fn who_disconnects_is_noticed_between_long_ticks_and_the_world_stands_still() {
    let mut stage = Stage::with(1, false);
    long_tick(&mut stage, PERIOD * 5);
    stage.disconnect(1);
    stage.finish();
    let before = stage.frame_number;
    stage.pass(Duration::from_secs(10));
    assert_eq!(stage.frame_number, before);
}

#[test]
fn time_that_is_lost_is_told_now_and_then() {
    let mut stage = Stage::with(1, false);
    // Nearly a minute.
    for _ in 0..250 {
        long_tick(&mut stage, PERIOD * 5);
        stage.finish();
    }
    assert_eq!(stage.losses.len(), 2, "{:?}", stage.losses);
    let Loss { lost, of } = stage.losses[0];
    let share = lost.as_secs_f64() / of.as_secs_f64();
    assert!((0.75..0.85).contains(&share), "{share}");
}

#[test]
fn a_world_that_keeps_up_loses_no_time() {
    let mut stage = Stage::with(1, false);
    for _ in 0..1_000 {
        long_tick(&mut stage, PERIOD / 2);
        stage.finish();
    }
    stage.settings.synchronous_mode = true;
    stage.call_and_finish(1, "set_episode_settings", ());
    stage.pass(Duration::from_secs(60));
    stage.settings.synchronous_mode = false;
    stage.call_and_finish(1, "set_episode_settings", ());
    stage.pass(Duration::from_secs(10));
    assert_eq!(stage.losses, []);
}
