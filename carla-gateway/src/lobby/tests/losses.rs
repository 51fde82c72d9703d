//! Whose world is lost.

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
