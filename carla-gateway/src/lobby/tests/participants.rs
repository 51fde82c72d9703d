//! Clients that tick one world together.

use std::time::Duration;

use super::super::*;
use super::stage::{PACING, Stage};

const LEASE: Duration = Duration::from_secs(2);
const MOMENT: Duration = Duration::from_millis(1);

/// So many clients of a world that they tick together, each of which has ticked once.
fn stage_with(clients: u64) -> Stage {
    let mut stage = Stage::new();
    stage.lobby =
        Lobby::new(Pacing { clock_lease: Some(LEASE), ..PACING }, ClientVersion::V0_9, stage.now);
    for client in 1..=clients {
        stage.connect(client);
    }
    stage.settings.synchronous_mode = true;
    stage.call_and_finish(1, "load_new_episode", (true,));
    // Whoever ticks for the first time takes part from then on.
    for client in 1..=clients {
        stage.call_and_finish(client, "tick_cue", ());
    }
    stage.pass(LEASE);
    for client in 1..=clients {
        stage.call_and_finish(client, "tick_cue", ());
    }
    stage.missed = 0;
    stage
}

#[test]
fn the_world_advances_once_when_all_have_asked_whoever_asks_first() {
    for order in [[1, 2, 3], [3, 1, 2]] {
        let mut stage = stage_with(3);
        let before = stage.frame_number;
        for (asked, client) in (1..).zip(order) {
            let tick = stage.call_and_finish(client, "tick_cue", ());
            assert!(stage.is_answered(client, tick), "who has asked is told which frame comes");
            assert_eq!(stage.frame_number, before + u64::from(asked == 3));
        }
    }
}

#[test]
fn without_a_shared_clock_every_tick_counts() {
    let mut stage = Stage::with(2, true);
    let before = stage.frame_number;
    for client in [1, 2, 1, 2] {
        stage.call_and_finish(client, "tick_cue", ());
    }
    assert_eq!(stage.frame_number, before + 4);
}

#[test]
fn who_does_not_ask_in_time_is_not_waited_for_until_it_asks_again() {
    let mut stage = stage_with(2);
    let before = stage.frame_number;
    stage.call_and_finish(1, "tick_cue", ());
    stage.pass(LEASE - MOMENT);
    assert_eq!(stage.frame_number, before);
    stage.pass(MOMENT);
    assert_eq!((stage.frame_number, stage.missed), (before + 1, 1));
    stage.call_and_finish(1, "tick_cue", ());
    assert_eq!(stage.frame_number, before + 2, "nobody else is waited for");
    stage.call_and_finish(2, "tick_cue", ());
    assert_eq!(stage.frame_number, before + 2, "it takes part again");
    stage.call_and_finish(1, "tick_cue", ());
    assert_eq!((stage.frame_number, stage.missed), (before + 3, 1));
}

#[test]
fn who_is_gone_is_not_waited_for() {
    let mut stage = stage_with(2);
    let before = stage.frame_number;
    stage.call_and_finish(1, "tick_cue", ());
    assert_eq!(stage.frame_number, before);
    stage.disconnect(2);
    stage.finish();
    assert_eq!(stage.frame_number, before + 1);
}

#[test]
fn who_only_looks_on_is_not_waited_for() {
    let mut stage = stage_with(2);
    stage.connect(3);
    stage.call_and_finish(3, "get_spectator", ());
    let before = stage.frame_number;
    for client in [1, 2] {
        stage.call_and_finish(client, "tick_cue", ());
    }
    assert_eq!(stage.frame_number, before + 1);
}

#[test]
fn a_tick_at_the_end_of_a_batch_waits_like_others() {
    let mut stage = stage_with(2);
    let before = stage.frame_number;
    stage.batches_tick = true;
    let batch = stage.call_and_finish(1, "apply_batch", ((), true));
    assert!(stage.is_answered(1, batch));
    assert_eq!(stage.frame_number, before);
    stage.call_and_finish(2, "tick_cue", ());
    assert_eq!(stage.frame_number, before + 1);
}

/// Nobody is promised a frame of a world that is gone, or that advances by itself.
#[test]
fn a_new_world_and_asynchronous_mode_end_the_round() {
    for method in ["load_new_episode", "set_episode_settings"] {
        let mut stage = stage_with(2);
        stage.call_and_finish(1, "tick_cue", ());
        stage.settings.synchronous_mode = method == "load_new_episode";
        stage.call_and_finish(2, method, (true,));
        stage.settings.synchronous_mode = true;
        stage.call_and_finish(2, "set_episode_settings", ());
        let before = stage.frame_number;
        stage.call_and_finish(2, "tick_cue", ());
        assert_eq!(stage.frame_number, before, "{method}");
        stage.call_and_finish(1, "tick_cue", ());
        assert_eq!(stage.frame_number, before + 1, "{method}");
    }
}
