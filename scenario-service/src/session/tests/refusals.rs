//! Whatever is asked of a session, a refusal changes nothing.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;

/// Numbers that clients can send, most of them useless.
fn number() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![
        Just(None),
        prop::num::f64::NORMAL.prop_map(Some),
        prop::sample::select(vec![0.0, -0.0, 1e-300, -1.0, 1e30, f64::MAX, f64::MIN])
            .prop_map(Some),
    ]
}

fn word() -> impl Strategy<Value = Option<String>> {
    prop::option::of("[a-z_0-9]{0,9}|lane_[0-9-]{1,4}|left|right")
}

prop_compose! {
    fn action()(
        // One in two wants to go somewhere, which is refused more often than anything else.
        kind in prop_oneof![
            Just(ActionKind::SetDestination),
            prop::sample::select(ActionKind::ALL.to_vec()),
        ],
        (x, y, z) in (number(), number(), number()),
        // The face keeps these within their bounds.
        (speed, brake) in (prop::option::of(0.0..200.0), prop::option::of(0.0..=1.0)),
        (direction, lane, behaviour) in (word(), word(), word()),
        steps in prop::option::of(any::<u64>()),
    ) -> Action {
        Action {
            destination_x: x,
            destination_y: y,
            destination_z: z,
            target_speed_kmh: speed,
            brake_intensity: brake,
            lane_direction: direction,
            target_lane_id: lane,
            navigation_behavior: behaviour,
            route_steps: steps,
            ..Action::of(kind)
        }
    }
}

#[test]
fn whatever_is_asked_a_refusal_changes_nothing() {
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    let (refused, done) = (Cell::new(0), Cell::new(0));
    let mut runner = TestRunner::new(ProptestConfig::with_cases(16));
    let outcome = runner.run(&prop::collection::vec(action(), 1..12), |actions| {
        runtime.block_on(async {
            let (port, mut session) = session();
            session.reset(reset_to("free_roam", 7, json!({}))).await.unwrap();
            for action in actions {
                let before = everything(&port, &session);
                if session.step(&action).await.is_ok() {
                    done.set(done.get() + 1);
                    continue;
                }
                refused.set(refused.get() + 1);
                prop_assert_eq!(everything(&port, &session), before, "{:?}", action);
            }
            Ok(())
        })
    });
    outcome.unwrap();
    assert!(refused.get() >= 8, "only {} of the actions were refused", refused.get());
    assert!(done.get() >= 8, "only {} of the actions were done", done.get());
}
