//! What is reported when things touch.

mod common;

use common::*;
use schemas::{Collision, Command, ErrorCode, Vec3, VehicleControl, level_pose};

#[test]
fn hit_pedestrians_are_reported_with_both_ids_and_the_impulse() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    let group = [-0.8, 0.0, 0.8].map(|beside_m| walker(&mut world, 25.0, beside_m));
    let speed_before_mps = speed_mps(&world, car);
    let collisions = run(&mut world, 60);
    for walker in group {
        let first = collisions
            .iter()
            .find(|collision| collision.other == Some(walker))
            .unwrap_or_else(|| panic!("{walker} was not hit"));
        assert_eq!(first.actor, car);
        assert!(first.started);
        assert!(first.impulse_ns.x < -75.0 * 4.0, "the car is slowed: {:?}", first.impulse_ns);
        let closing = first.closing_speed_mps;
        assert!((closing / speed_before_mps - 1.0).abs() < 0.15, "closing at {closing} m/s");
        assert!((first.position_m.x - 25.0).abs() < 1.0, "{}", first.position_m);
    }
}

#[test]
fn who_stands_in_the_way_is_hit_also_after_many_others_came() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    let group = [-0.8, 0.8].map(|beside_m| walker(&mut world, 25.0, beside_m));
    run(&mut world, 20);
    for index in 0..30u8 {
        walker(&mut world, -50.0 - 2.0 * f32::from(index), 0.0);
    }
    let collisions = run(&mut world, 60);
    for walker in group {
        let is_hit = |hit: &Collision| (hit.actor, hit.other) == (car, Some(walker));
        assert!(collisions.iter().any(is_hit), "{walker}");
    }
}

#[test]
fn the_reported_impulse_is_the_momentum_that_the_pedestrian_gained() {
    let mut world = world();
    car(&mut world, 0.0, KMH_40);
    let walker = walker(&mut world, 8.0, 0.0);
    let mut impulse_ns = Vec3::zeros();
    loop {
        run(&mut world, 1);
        impulse_ns -= world.collisions().iter().map(|hit| hit.impulse_ns).sum::<Vec3>();
        if !world.collisions().is_empty() {
            break;
        }
    }
    let gained_ns = state(&world, walker).linear_velocity_mps * 75.0;
    let missing = (gained_ns.xy() - impulse_ns.xy()).norm() / gained_ns.norm();
    // Friction of the contact and of the ground is not in the report.
    assert!(missing < 0.15, "gained {gained_ns}, reported {impulse_ns}");
}

#[test]
fn a_hit_pedestrian_is_thrown_and_comes_to_rest_on_the_ground() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    let walker = walker(&mut world, 8.0, 0.3);
    let mut fastest_mps: f32 = 0.0;
    for _ in 0..200 {
        run(&mut world, 1);
        if !world.collisions().is_empty() {
            brake(&mut world, car);
        }
        fastest_mps = fastest_mps.max(speed_mps(&world, walker));
    }
    assert!(fastest_mps > 5.0, "{fastest_mps} m/s");
    let end = state(&world, walker);
    assert!(end.linear_velocity_mps.norm() < 0.01, "{}", end.linear_velocity_mps);
    assert!(end.world_from_actor.translation.z < 0.5, "it lies: {}", end.world_from_actor);
    assert!(end.world_from_actor.translation.z > 0.1, "on the ground: {}", end.world_from_actor);
}

#[test]
fn pedestrians_stand_still_as_long_as_nothing_touches_them() {
    let mut world = world();
    let group = [0.0, 0.8, 1.6].map(|beside_m| walker(&mut world, 25.0, beside_m));
    let before = group.map(|walker| state(&world, walker));
    run(&mut world, 2_000);
    assert_eq!(before, group.map(|walker| state(&world, walker)));
    let height_m = position_m(&world, group[0]).z;
    assert!(
        (height_m - 0.875).abs() < 1.0e-4,
        "the box's centre is half its height up: {height_m}"
    );
}

#[test]
fn a_hit_against_scenery_names_no_other_actor() {
    let mut world = world();
    let car = car(&mut world, 580.0, 15.0);
    let collisions = run(&mut world, 40);
    let hit = collisions.first().expect("the wall at x = 600 is hit");
    assert_eq!((hit.actor, hit.other, hit.started), (car, None, true));
    assert!(hit.impulse_ns.x < -1_000.0, "{}", hit.impulse_ns);
    assert!((hit.closing_speed_mps - 15.0).abs() < 1.0, "{}", hit.closing_speed_mps);
    assert!(position_m(&world, car).x < 600.0, "it does not pass: {}", position_m(&world, car));
}

#[test]
fn standing_and_driving_on_the_ground_is_no_collision() {
    let mut world = world();
    car(&mut world, 0.0, 20.0);
    walker(&mut world, -20.0, 0.0);
    assert!(run(&mut world, 100).is_empty());
}

#[test]
fn two_cars_push_each_other_and_one_collision_starts() {
    let mut world = world();
    let rear = car(&mut world, 0.0, 12.0);
    let front = car(&mut world, 10.0, 0.0);
    let collisions = run(&mut world, 40);
    let started: Vec<&Collision> = collisions.iter().filter(|hit| hit.started).collect();
    assert!(!started.is_empty() && started[0].other == Some(front) && started[0].actor == rear);
    assert!(speed_mps(&world, front) > 3.0, "{}", speed_mps(&world, front));
    assert!(started[0].impulse_ns.x < -1_800.0, "{}", started[0].impulse_ns);
}

#[test]
fn collisions_are_ordered_by_their_actors() {
    let mut world = world();
    let car = car(&mut world, 0.0, 20.0);
    for beside_m in [0.8, 0.0, -0.8] {
        walker(&mut world, 6.0, beside_m);
    }
    for _ in 0..20 {
        run(&mut world, 1);
        let pairs: Vec<_> = world.collisions().iter().map(|hit| (hit.actor, hit.other)).collect();
        assert!(pairs.windows(2).all(|pair| pair[0] < pair[1]), "{pairs:?}");
        assert!(pairs.iter().all(|&(first, second)| second.is_none_or(|second| first < second)));
    }
    assert!(speed_mps(&world, car) < 20.0);
}

#[test]
fn nothing_can_be_spawned_into_another_actor_or_a_wall() {
    let mut world = world();
    car(&mut world, 0.0, 0.0);
    for (x_m, y_m) in [(1.0, LANE_Y_M), (600.0, 0.0)] {
        let refusal = world
            .apply(&Command::spawn(
                "vehicle.audi.tt",
                level_pose(Vec3::new(x_m, y_m, 0.3), 0.0),
                Vec3::zeros(),
            ))
            .unwrap_err();
        assert_eq!(refusal.code, ErrorCode::SpawnBlocked);
    }
    assert_eq!(world.actor_count(), 1);
}

/// What lies still costs nothing; what trembles on the ground costs a world most of its time.
#[test]
fn people_who_were_hit_and_the_car_come_to_rest() {
    for case in 0..16u8 {
        let mut world = world();
        let mut actors = vec![car(&mut world, 0.0, 8.0 + f32::from(case) / 2.0)];
        for beside_m in [-0.8, 0.0, 0.8] {
            actors.push(walker(&mut world, 25.0, beside_m + 0.03 * f32::from(case)));
        }
        run(&mut world, 100);
        brake(&mut world, actors[0]);
        let at_rest = (0..300).find(|_| {
            run(&mut world, 1);
            actors.iter().all(|actor| speed_mps(&world, *actor) == 0.0)
        });
        assert!(at_rest.is_some(), "case {case} trembles");
    }
}

#[test]
fn cars_that_brake_and_swerve_pass_over_what_lies_flat() {
    let mut world = world();
    let car = car(&mut world, 0.0, 15.0);
    for nth in 0..20u8 {
        let at_m = Vec3::new(5.0 + f32::from(nth), LANE_Y_M, 0.0);
        for name in ["dirtdebris01", "dirtdebris02", "ironplank"] {
            spawn_at(&mut world, &format!("static.prop.{name}"), level_pose(at_m, 0.0), 0.0);
        }
    }
    for steer in [0.5, -0.5, 0.5, -0.5] {
        let wild = VehicleControl { brake: 0.6, steer, ..Default::default() };
        control(&mut world, car, wild);
        assert_eq!(run(&mut world, 10), []);
    }
    let at = position_m(&world, car);
    assert!(at.x > 10.0 && at.z.abs() < 0.02, "{at}");
    // A bag of garbage as high as a kerb is no such thing.
    let ahead = level_pose(at + Vec3::new(4.0, 0.0, 0.0), 0.0);
    spawn_at(&mut world, "static.prop.trashbag", ahead, 0.0);
    control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
    assert!(!run(&mut world, 60).is_empty(), "the car passed through a bag");
}
