//! Clients in the world of a session.

use std::time::Duration;

use schemas::{Error, ErrorCode, WorldId};

use super::super::*;
use super::stage::Stage;
use crate::lobby::pace::QUIET_AFTER_LOAD;
use crate::lobby::visits::STANDING;
use crate::visited::VisitedTick;

/// One client in a world whose session can step.
fn visiting(synchronous_mode: bool) -> Stage {
    let mut stage = Stage::with(1, synchronous_mode);
    stage.world = WorldState::Visited;
    stage.call_and_finish(1, "get_map_info", ());
    stage
}

fn step(stage: &mut Stage) {
    let outcome = Err(Error::new(ErrorCode::UnknownWorld, "the lobby does not look at it"));
    stage.tell(Event::Ticked(VisitedTick { world: WorldId::of_host(0, 1), outcome }));
}

#[test]
fn the_world_ticks_when_its_session_steps_and_not_by_itself() {
    let mut stage = visiting(false);
    let before = stage.frame_number;
    let call = stage.call_and_finish(1, "spawn_actor", ());
    assert!(stage.is_answered(1, call), "no frame may come for long");
    step(&mut stage);
    stage.finish();
    assert_eq!(stage.frame_number, before + 1);
}

#[test]
fn a_world_that_stands_still_is_shown_now_and_then_to_those_who_follow() {
    for (synchronous_mode, clients) in [(false, 1), (true, 1), (false, 0)] {
        let mut stage = visiting(synchronous_mode);
        (clients..1).for_each(|_| stage.disconnect(1));
        stage.pass(STANDING);
        let before = stage.frame_number;
        stage.pass(4 * STANDING);
        let count = if synchronous_mode || clients == 0 { 0 } else { 4 };
        assert_eq!(stage.frame_number, before + count);
    }
}

#[test]
fn a_client_that_ticks_is_answered_and_has_its_frame_when_the_session_steps() {
    let mut stage = visiting(true);
    stage.start_manager(1, 8_000);
    let before = stage.frame_number;
    let tick = stage.call_and_finish(1, "tick_cue", ());
    assert!(stage.is_answered(1, tick));
    stage.pass(Duration::from_secs(5));
    assert_eq!((stage.frame_number, stage.woken.as_slice()), (before, &[][..]));
    let call = stage.call_and_finish(1, "get_map_info", ());
    assert!(stage.is_answered(1, call), "who waits for a frame may ask for other things");
    step(&mut stage);
    stage.finish();
    assert_eq!(stage.frame_number, before + 1);
    stage.pass(Duration::from_secs(5));
    assert_eq!(stage.woken, [8_000], "it has slept through the frame");
}

#[test]
fn frames_come_when_clients_know_the_new_world() {
    let mut stage = visiting(false);
    stage.loads_visit = true;
    stage.call_and_finish(1, "load_new_episode", (true,));
    let before = stage.frame_number;
    step(&mut stage);
    assert!(stage.job.is_none());
    stage.pass(QUIET_AFTER_LOAD);
    assert_eq!(stage.frame_number, before + 1);
}
