//! What is known to end or to stop a client, without one: who waits for what, and how long.

mod simulation;
mod stage;

use super::changeover::{PATIENCE, RETURN_PATIENCE, SETTLING};
use super::held::READY_AFTER;
use super::pace::Loss;
use super::*;
use stage::{PERIOD, Stage};

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
    stage.lobby = Lobby::new(PERIOD, Some(Duration::from_secs(2)), stage.now);
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

mod turns {
    use super::*;

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
}

mod late_answers {
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
        stage.pass(PERIOD * 2 + super::super::late::STEPS_PATIENCE);
        assert!(stage.is_answered(1, last), "no step comes");
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
}

mod managers {
    use super::*;

    #[test]
    fn one_that_sleeps_through_a_frame_is_woken_once() {
        let mut stage = Stage::with(1, true);
        stage.start_manager(1, 8_000);
        stage.call_and_finish(1, "tick_cue", ());
        stage.pass(super::super::managers::PATIENCE - MOMENT);
        assert_eq!(stage.woken, [0; 0]);
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
}

mod loads {
    use super::*;

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
}

mod losses {
    use super::*;

    #[test]
    fn who_comes_after_a_loss_finds_a_new_world_and_who_knew_the_old_one_does_not() {
        let mut stage = Stage::with(1, true);
        stage.world = WorldState::Lost;
        stage.call_and_finish(1, "get_spectator", ());
        let finds_new_world = |stage: &Stage| stage.job.as_ref().unwrap().brief.finds_new_world;
        stage.call(1, "get_spectator", ());
        assert!(!finds_new_world(&stage));
        stage.finish();
        stage.connect(2);
        stage.call(2, "get_spectator", ());
        assert!(finds_new_world(&stage));
        stage.finish();
        stage.call(1, "tick_cue", ());
        assert!(!finds_new_world(&stage));
    }

    #[test]
    fn who_came_while_the_call_was_under_way_that_found_the_loss_did_not_know_the_old_world() {
        let mut stage = Stage::with(1, true);
        stage.call(1, "get_spectator", ());
        stage.connect(2);
        stage.world = WorldState::Lost;
        stage.finish();
        stage.call(2, "get_spectator", ());
        assert!(stage.job.as_ref().unwrap().brief.finds_new_world);
    }
}
