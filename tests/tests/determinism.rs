//! Goal: the same seed and actions give the same observations and rewards, whatever else happens.
//! Method: play one list of actions alone, interleaved, and after a restart; compare everything.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use serde_json::{Value, json};
use tests::{Service, Session, Site};

/// Accelerates into the pedestrians and brakes: contacts are where simulations differ first.
fn actions() -> Vec<Value> {
    let mut actions = vec![json!({"action_type": "observe"}); 3];
    actions.push(json!({"action_type": "control", "throttle": 0.7, "steer": 0.0}));
    actions.extend(vec![json!({"action_type": "observe"}); 45]);
    actions.push(json!({"action_type": "brake_vehicle", "brake_intensity": 0.4}));
    actions.extend(vec![json!({"action_type": "observe"}); 10]);
    actions
}

fn start(session: &mut Session, seed: u64) -> Value {
    session.reset(json!({"scenario_name": "trolley_saves", "seed": seed}))
}

/// One session from reset to the last action.
fn play(site: &Site, seed: u64) -> Vec<Value> {
    let mut session = site.session();
    let mut seen = vec![start(&mut session, seed)];
    seen.extend(actions().into_iter().map(|action| session.step(action)));
    seen
}

fn assert_same(left: &[Value], right: &[Value]) {
    assert_eq!(left.len(), right.len());
    for (step, (left, right)) in left.iter().zip(right).enumerate() {
        assert_eq!(left, right, "first difference at step {step}");
    }
}

#[test]
fn sessions_with_one_seed_agree_in_every_interleaving() {
    let site = Site::without_renderer();
    let alone = play(&site, 7);
    let last = &alone.last().unwrap()["observation"];
    assert_eq!(last["collision_detected"], true, "the comparison must hold a collision: {last}");

    let mut sessions: Vec<Session> = (0..4).map(|_| site.session()).collect();
    let mut seen: Vec<Vec<Value>> =
        sessions.iter_mut().map(|session| vec![start(session, 7)]).collect();
    let mut stranger = site.session();
    start(&mut stranger, 8);
    // Session n takes n + 1 steps in its turn, so that no two are ever in step.
    let actions = actions();
    while seen.iter().any(|seen| seen.len() <= actions.len()) {
        for (index, (session, seen)) in sessions.iter_mut().zip(&mut seen).enumerate() {
            for action in actions.iter().skip(seen.len() - 1).take(index + 1) {
                seen.push(session.step(action.clone()));
            }
        }
        stranger.step(json!({"action_type": "control", "throttle": 1.0}));
    }
    for seen in seen {
        assert_same(&alone, &seen);
    }
}

#[test]
fn another_seed_is_another_episode() {
    let site = Site::without_renderer();
    let mut session = site.session();
    let starts: Vec<Value> =
        (0..8).map(|seed| start(&mut session, seed)["observation"]["location"].clone()).collect();
    assert!(starts.iter().any(|location| *location != starts[0]), "{starts:?}");
}

#[test]
fn restarted_services_give_the_same_episode_again() {
    let site = Site::without_renderer();
    let before = play(&site, 7);
    site.kill(Service::World);
    site.kill(Service::Scenario);
    site.wait_until_healthy();
    assert_same(&before, &play(&site, 7));
}

#[test]
fn two_sites_give_the_same_episode() {
    let first = play(&Site::start(&["--no-render", "--threads", "1"]), 9);
    let second = play(&Site::start(&["--no-render", "--threads", "2"]), 9);
    assert_same(&first, &second);
}
