//! What happens to a vehicle that stands.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{Vec3, VehicleControl, level_pose};

#[test]
fn the_wheels_of_a_standing_car_turn_from_lock_to_lock() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    brake(&mut world, car);
    run(&mut world, 60);
    let mut locks_rad = Vec::new();
    for steer in [-1.0, 1.0, -1.0] {
        control(&mut world, car, VehicleControl { steer, brake: 1.0, ..Default::default() });
        run(&mut world, 80);
        locks_rad.push(state(&world, car).road_wheel_rad);
    }
    let [right_rad, left_rad, again_rad] = locks_rad[..] else { panic!("{locks_rad:?}") };
    assert!(left_rad > 0.5 && (left_rad + right_rad).abs() < 0.01, "{locks_rad:?}");
    assert!((again_rad - right_rad).abs() < 0.01, "{locks_rad:?}");
}

#[test]
fn a_standing_car_sleeps_again_once_its_wheels_are_where_they_should_be() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    control(&mut world, car, VehicleControl { steer: 1.0, brake: 1.0, ..Default::default() });
    run(&mut world, 100);
    let at_m = position_m(&world, car);
    run(&mut world, 100);
    assert_eq!(position_m(&world, car), at_m, "not one bit: it sleeps");
}

/// Seconds after which a vehicle put above the road moves no more, and the way that it makes within
/// a second under a throttle from its first tick on.
fn landing(blueprint: &str, above_m: f32) -> (f32, f32) {
    let put = |throttle: f32| {
        let mut world = world_on(flat(), 0.01);
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, above_m), 0.0);
        let car = spawn_at(&mut world, blueprint, pose, 0.0);
        control(&mut world, car, VehicleControl { throttle, ..Default::default() });
        (world, car)
    };
    let (mut world, car) = put(0.0);
    let mut moves_secs = 0.0;
    for tick in 1..=150u8 {
        run(&mut world, 1);
        if speed_mps(&world, car) > 0.1 {
            moves_secs = f32::from(tick) * 0.01;
        }
    }
    let (mut world, car) = put(0.5);
    run(&mut world, 100);
    (moves_secs, position_m(&world, car).x)
}

#[test]
fn a_vehicle_put_above_the_road_lands_without_a_bounce_and_drives_off_at_once() {
    for blueprint in vehicles() {
        let (_, from_rest_m) = landing(blueprint, 0.0);
        // The fall alone takes 0.25 and 0.32 s, less the travel of the springs.
        for (above_m, secs, share) in [(0.3, 0.45, 0.5), (0.5, 0.5, 0.4)] {
            let (moves_secs, driven_m) = landing(blueprint, above_m);
            assert!(moves_secs <= secs, "{blueprint}, {above_m} m: {moves_secs} s");
            let way = format!("{blueprint}, {above_m} m: {driven_m} of {from_rest_m} m");
            assert!(driven_m > share * from_rest_m, "{way}");
        }
    }
}
