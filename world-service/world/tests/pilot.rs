//! Driving by a pilot inside the tick.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{ActorId, Command, PilotMode, VehicleCommand, VehicleControl};
use world::World;

fn pilot(world: &mut World, actor: ActorId, mode: PilotMode, target_speed_mps: Option<f32>) {
    world
        .apply(&Command::Vehicle(VehicleCommand::Pilot { actor, mode, target_speed_mps }))
        .unwrap();
}

#[test]
fn a_lane_change_begun_25_m_before_a_group_passes_it_without_contact() {
    for (mode, lane_y_m) in
        [(PilotMode::ChangeLaneRight, -5.25), (PilotMode::ChangeLaneLeft, -1.75)]
    {
        let own_y_m = -7.0 - lane_y_m;
        let mut world = world();
        let pose = schemas::level_pose(schemas::Vec3::new(0.0, own_y_m, 0.3), 0.0);
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, KMH_40);
        for beside_m in [-0.8, 0.0, 0.8] {
            walker(&mut world, 25.0, own_y_m - LANE_Y_M + beside_m);
        }
        run(&mut world, 1);
        pilot(&mut world, car, mode, None);
        let mut peak_mps2: f32 = 0.0;
        let mut slowest_mps = f32::INFINITY;
        for _ in 0..60 {
            let hits = run(&mut world, 1);
            assert!(hits.is_empty(), "{mode:?}: {hits:?}");
            let state = state(&world, car);
            peak_mps2 = peak_mps2.max(state.linear_acceleration_mps2.y.abs());
            slowest_mps = slowest_mps.min(state.linear_velocity_mps.norm());
        }
        assert!(peak_mps2 <= 7.5, "{mode:?}: {peak_mps2} m/s²");
        assert!(slowest_mps > 0.93 * KMH_40, "{mode:?}: {slowest_mps} m/s");
        run(&mut world, 60);
        let beside_m = position_m(&world, car).y - lane_y_m;
        assert!(beside_m.abs() < 0.15, "{mode:?}: {beside_m} m beside the new lane");
    }
}

#[test]
fn a_lane_change_stays_within_the_two_lanes() {
    for forward_mps in [5.0, KMH_40, 25.0] {
        let mut world = world();
        let car = car(&mut world, -800.0, forward_mps);
        pilot(&mut world, car, PilotMode::ChangeLaneRight, None);
        for _ in 0..200 {
            run(&mut world, 1);
            let y_m = position_m(&world, car).y;
            assert!((-5.75..-1.25).contains(&y_m), "{forward_mps} m/s: {y_m}");
        }
    }
}

#[test]
fn without_a_lane_on_that_side_the_car_keeps_its_own() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    pilot(&mut world, car, PilotMode::ChangeLaneLeft, None);
    for _ in 0..100 {
        run(&mut world, 1);
        assert!((position_m(&world, car).y - LANE_Y_M).abs() < 0.1);
    }
}

#[test]
fn keep_lane_reaches_and_holds_the_target_speed() {
    let mut world = world();
    let car = car(&mut world, -900.0, 5.0);
    pilot(&mut world, car, PilotMode::KeepLane, Some(15.0));
    run(&mut world, 400);
    for _ in 0..100 {
        run(&mut world, 1);
        let mps = speed_mps(&world, car);
        assert!((mps - 15.0).abs() < 0.3, "{mps} m/s");
    }
    pilot(&mut world, car, PilotMode::KeepLane, Some(0.0));
    run(&mut world, 200);
    assert!(speed_mps(&world, car) < 0.01);
}

#[test]
fn a_speed_asked_for_again_in_every_tick_is_reached_and_held_on_a_slope() {
    let mut world = world_on(slope_of_ten_percent(), 0.05);
    let pose = schemas::level_pose(schemas::Vec3::new(0.0, LANE_Y_M, 100.1), 0.0);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 10.0);
    for tick in 0..300 {
        pilot(&mut world, car, PilotMode::KeepLane, Some(15.0));
        run(&mut world, 1);
        let mps = speed_mps(&world, car);
        assert!(tick < 200 || (mps - 15.0).abs() < 2.0 / 3.6, "{mps} m/s after tick {tick}");
    }
}

#[test]
fn the_pilot_returns_to_the_lane_it_was_pushed_from() {
    let mut world = world();
    let pose = schemas::level_pose(schemas::Vec3::new(0.0, LANE_Y_M + 1.0, 0.3), 0.1);
    let car = spawn_at(&mut world, "vehicle.tesla.model3", pose, 15.0);
    pilot(&mut world, car, PilotMode::KeepLane, Some(15.0));
    run(&mut world, 120);
    assert!((position_m(&world, car).y - LANE_Y_M).abs() < 0.1, "{}", position_m(&world, car));
}

#[test]
fn setting_a_control_ends_the_pilot() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    pilot(&mut world, car, PilotMode::ChangeLaneRight, Some(KMH_40));
    run(&mut world, 2);
    let coast = VehicleControl::default();
    control(&mut world, car, coast);
    run(&mut world, 5);
    assert_eq!(state(&world, car).control, coast);
}

#[test]
fn at_the_end_of_the_road_the_car_stops() {
    let mut world = world();
    let pose = schemas::level_pose(schemas::Vec3::new(900.0, LANE_Y_M, 0.3), 0.0);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 15.0);
    pilot(&mut world, car, PilotMode::KeepLane, Some(15.0));
    run(&mut world, 400);
    let x_m = position_m(&world, car).x;
    assert!(speed_mps(&world, car) < 0.5 && x_m > 950.0 && x_m < 1_003.0, "{x_m}");
}

/// How far the heading of a car swings that changes lanes at 75 km/h and brakes hard after so many
/// ticks, in degrees.
fn swing_deg(ticks: usize) -> f32 {
    let mut world = world();
    let car = car(&mut world, -800.0, 75.0 / 3.6);
    pilot(&mut world, car, PilotMode::ChangeLaneRight, None);
    run(&mut world, ticks);
    brake(&mut world, car);
    let mut swing_rad: f32 = 0.0;
    for _ in 0..80 {
        run(&mut world, 1);
        swing_rad = swing_rad.max(schemas::yaw_rad(&state(&world, car).world_from_actor).abs());
    }
    swing_rad.to_degrees()
}

#[test]
fn braking_in_or_after_a_lane_change_weaves_no_car_that_has_its_aids() {
    let swings: Vec<f32> = (1..=60).map(swing_deg).collect();
    let worst_deg = swings.iter().copied().fold(0.0, f32::max);
    assert!(worst_deg < 15.0, "{swings:?}");
}
