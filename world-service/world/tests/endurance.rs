//! Long runs of parked and driving vehicles: nothing diverges, sinks or drifts.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{ActorId, BodyCommand, Command, PilotMode, Vec3, VehicleCommand, level_pose};
use world::World;

/// Ten cars on the left-hand lanes that drive back and forth, ten parked ones beside the road.
fn traffic(world: &mut World) -> (Vec<ActorId>, Vec<ActorId>) {
    let spawn = |world: &mut World, x_m, y_m, z_m, forward_mps| {
        let pose = level_pose(Vec3::new(x_m, y_m, z_m), 0.0);
        spawn_at(world, "vehicle.tesla.model3", pose, forward_mps)
    };
    let mut driving = Vec::new();
    for index in 0..10u8 {
        let car = spawn(world, -900.0 + 30.0 * f32::from(index), LANE_Y_M, 0.0, 8.0);
        driving.push(car);
    }
    let parked = (0..10u8)
        .map(|index| spawn(world, -900.0 + 30.0 * f32::from(index), LANE_Y_M - 3.5, 0.4, 0.0));
    (driving, parked.collect())
}

/// Drives in laps of two minutes: to the far end and, put back by a command, again.
fn endure(minutes: u16) {
    let mut world = world();
    let (driving, parked) = traffic(&mut world);
    run(&mut world, 100);
    let stands_m: Vec<Vec3> = parked.iter().map(|&car| position_m(&world, car)).collect();
    for lap in 0..minutes.div_ceil(2) {
        for (index, &actor) in (0..).zip(&driving) {
            let x_m = -900.0 + 30.0 * f32::from(index as u8);
            let world_from_actor = level_pose(Vec3::new(x_m, LANE_Y_M, 0.0), 0.0);
            world
                .apply(&Command::Body(BodyCommand::SetPose {
                    actor,
                    reference_from_actor: world_from_actor,
                }))
                .unwrap();
            let target_speed_mps = Some(8.0);
            let mode = PilotMode::KeepLane;
            world
                .apply(&Command::Vehicle(VehicleCommand::Pilot { actor, mode, target_speed_mps }))
                .unwrap();
        }
        let collisions = run(&mut world, 2_400);
        assert!(collisions.is_empty(), "lap {lap}: {:?}", collisions.first());
        for actor in &world.frame().actors {
            let place_m = actor.world_from_actor.translation.vector;
            assert!(place_m.z.abs() < 0.05, "lap {lap}: {} at {place_m}", actor.id);
        }
    }
    for (&car, stood_m) in parked.iter().zip(&stands_m) {
        let drift_m = (position_m(&world, car) - stood_m).norm();
        assert!(drift_m < 1.0e-3, "{car} drifted {drift_m} m");
    }
    let driven = driving.iter().filter(|&&car| position_m(&world, car).x > -100.0).count();
    assert_eq!(driven, driving.len(), "all still drive");
}

/// `CAUSEWAY_ENDURE_MINUTES=60` takes a minute of computing for an hour of simulated time.
#[test]
fn twenty_vehicles_drive_and_stand_for_minutes() {
    let minutes = std::env::var("CAUSEWAY_ENDURE_MINUTES").ok();
    endure(minutes.and_then(|minutes| minutes.parse().ok()).unwrap_or(4));
}

#[test]
fn a_braked_car_on_a_slope_stays_for_ten_minutes_at_every_step_length() {
    for (dt_secs, ticks) in [(0.002, 300_000), (0.1, 6_000)] {
        let mut world = world_on(slope_of_ten_percent(), dt_secs);
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, 100.2), 0.0);
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
        brake(&mut world, car);
        run(&mut world, (5.0 / dt_secs) as usize);
        let start_m = position_m(&world, car);
        run(&mut world, ticks);
        let drift_m = (position_m(&world, car) - start_m).norm();
        assert!(drift_m < 1.0e-3, "{drift_m} m with {dt_secs} s");
    }
}
