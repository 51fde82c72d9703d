//! How a vehicle drives: rest, braking, acceleration, grip.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{
    ActorId, BodyCommand, Command, Handling, Vec3, VehicleCommand, VehicleControl, Weather,
};
use world::World;

fn stopping_distance_m(wetness_percent: f32, forward_mps: f32) -> f32 {
    let mut world = world();
    let weather = Weather { wetness_percent, ..Weather::CLEAR_NOON };
    world.apply(&Command::SetWeather { weather }).unwrap();
    let car = car(&mut world, 0.0, forward_mps);
    run(&mut world, 1);
    let start_m = position_m(&world, car).x;
    brake(&mut world, car);
    for _ in 0..400 {
        run(&mut world, 1);
        if speed_mps(&world, car) < 0.01 {
            return position_m(&world, car).x - start_m;
        }
    }
    panic!("still {} m/s after 20 s of braking", speed_mps(&world, car));
}

#[test]
fn a_car_at_rest_stays_where_it_is_for_ten_minutes() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    run(&mut world, 20);
    let start_m = position_m(&world, car);
    run(&mut world, 20 * 600);
    let drift_m = (position_m(&world, car) - start_m).norm();
    assert!(drift_m < 1.0e-3, "{drift_m} m");
}

#[test]
fn a_braked_car_on_a_slope_of_ten_percent_stays_where_it_is() {
    let mut world = world_on(slope_of_ten_percent(), 0.05);
    let pose = schemas::level_pose(Vec3::new(0.0, LANE_Y_M, 100.0), 0.0);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
    brake(&mut world, car);
    run(&mut world, 20);
    let start_m = position_m(&world, car);
    run(&mut world, 20 * 600);
    let drift_m = (position_m(&world, car) - start_m).norm();
    assert!(drift_m < 1.0e-3, "{drift_m} m");
    control(&mut world, car, VehicleControl::default());
    run(&mut world, 20 * 60);
    let drift_m = (position_m(&world, car) - start_m).norm();
    assert!(drift_m < 1.0e-2, "released, it is held: {drift_m} m");
    let linear_mps = Some(Vec3::new(-1.0, 0.0, 0.0));
    world
        .apply(&Command::Body(BodyCommand::SetVelocity {
            actor: car,
            linear_mps,
            angular_radps: None,
        }))
        .unwrap();
    run(&mut world, 40);
    let rolled_m = position_m(&world, car).x - start_m.x;
    assert!(rolled_m < -0.5, "pushed, it rolls back: {rolled_m} m");
}

#[test]
fn every_vehicle_put_on_a_slope_stays_until_it_is_driven() {
    for id in ["vehicle.volkswagen.t2", "vehicle.carlamotors.firetruck", "vehicle.kawasaki.ninja"] {
        let mut world = world_on(slope_of_ten_percent(), 0.05);
        let pose = schemas::level_pose(Vec3::new(0.0, LANE_Y_M, 100.1), 0.0);
        let car = spawn_at(&mut world, id, pose, 0.0);
        run(&mut world, 40);
        let start_m = position_m(&world, car);
        run(&mut world, 20 * 60);
        let drift_m = (position_m(&world, car) - start_m).norm();
        assert!(drift_m < 1.0e-2, "{id}: {drift_m} m");
        control(&mut world, car, VehicleControl { throttle: 0.6, ..Default::default() });
        run(&mut world, 60);
        let driven_m = position_m(&world, car).x - start_m.x;
        assert!(driven_m > 1.0, "{id}: {driven_m} m");
    }
}

#[test]
fn a_car_spawned_at_speed_rolls_on_without_a_bounce() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    run(&mut world, 1);
    let kmh = speed_mps(&world, car) * 3.6;
    assert!((39.8..40.0).contains(&kmh), "{kmh} km/h");
    let mut highest_m: f32 = 0.0;
    for _ in 0..40 {
        run(&mut world, 1);
        highest_m = highest_m.max(position_m(&world, car).z.abs());
    }
    assert!(highest_m < 0.02, "{highest_m} m");
}

#[test]
fn full_braking_on_dry_asphalt_takes_the_distance_of_a_modern_car() {
    let from_40_m = stopping_distance_m(0.0, KMH_40);
    assert!((7.0..8.5).contains(&from_40_m), "{from_40_m} m from 40 km/h");
    let from_75_m = stopping_distance_m(0.0, 75.0 / 3.6);
    assert!((23.0..26.5).contains(&from_75_m), "{from_75_m} m from 75 km/h");
}

#[test]
fn a_wet_road_needs_a_longer_way_to_stop() {
    let (dry_m, wet_m) = (stopping_distance_m(0.0, KMH_40), stopping_distance_m(100.0, KMH_40));
    assert!(wet_m > 1.3 * dry_m, "dry {dry_m} m, wet {wet_m} m");
}

#[test]
fn one_tick_of_full_braking_lowers_the_speed() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    run(&mut world, 1);
    let before_mps = speed_mps(&world, car);
    brake(&mut world, car);
    run(&mut world, 1);
    assert!(speed_mps(&world, car) < before_mps - 0.05);
}

#[test]
fn full_throttle_reaches_100_kmh_like_a_saloon() {
    let mut world = world();
    let car = car(&mut world, -900.0, 0.0);
    control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
    let mut ticks = 0;
    while speed_mps(&world, car) < 100.0 / 3.6 {
        run(&mut world, 1);
        ticks += 1;
        assert!(ticks < 400, "{} m/s after 20 s", speed_mps(&world, car));
    }
    let secs = f64::from(ticks) * 0.05;
    assert!((8.0..9.5).contains(&secs), "{secs} s");
}

#[test]
fn a_gentle_throttle_accelerates_gently_and_reverse_goes_back() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    control(&mut world, car, VehicleControl { throttle: 0.3, ..Default::default() });
    run(&mut world, 40);
    let forward_mps = state(&world, car).linear_velocity_mps.x;
    assert!((1.0..5.0).contains(&forward_mps), "{forward_mps} m/s after 2 s");
    brake(&mut world, car);
    run(&mut world, 60);
    let reverse = VehicleControl { throttle: 0.3, reverse: true, ..Default::default() };
    control(&mut world, car, reverse);
    run(&mut world, 40);
    let state = state(&world, car);
    assert!(state.linear_velocity_mps.x < -0.5, "{}", state.linear_velocity_mps);
    assert_eq!(state.gear, -1);
}

#[test]
fn reverse_brakes_a_car_that_rolls_forward_and_then_drives_it_back() {
    for (start_mps, reverse) in [(6.0, true), (-6.0, false)] {
        let mut world = world();
        let car = car(&mut world, 0.0, start_mps);
        control(&mut world, car, VehicleControl { throttle: 0.6, reverse, ..Default::default() });
        run(&mut world, 10);
        let slowed_mps = state(&world, car).linear_velocity_mps.x.abs();
        assert!(slowed_mps < start_mps.abs() - 0.5, "{slowed_mps} m/s after 0.5 s");
        assert_eq!(state(&world, car).gear < 0, reverse);
        run(&mut world, 90);
        let turned_mps = -state(&world, car).linear_velocity_mps.x * start_mps.signum();
        assert!(turned_mps > 1.0, "{turned_mps} m/s the other way after 5 s");
    }
}

#[test]
fn positive_steer_turns_left_within_the_grip_of_the_road() {
    let mut world = world();
    let car = car(&mut world, -500.0, 20.0);
    // Stability control would keep it a little below what the tyres can do.
    let mut physics = Box::new(world.vehicle_report(car).unwrap().physics);
    physics.stability_control = false;
    world.apply(&Command::Vehicle(VehicleCommand::Physics { actor: car, physics })).unwrap();
    control(&mut world, car, VehicleControl { steer: 0.5, throttle: 0.3, ..Default::default() });
    let mut peak_mps2: f32 = 0.0;
    for _ in 0..30 {
        run(&mut world, 1);
        let state = state(&world, car);
        let left = state.world_from_actor.rotation * Vec3::y();
        peak_mps2 = peak_mps2.max(state.linear_acceleration_mps2.dot(&left));
    }
    assert!(position_m(&world, car).y > LANE_Y_M + 2.0);
    assert!((8.0..10.5).contains(&peak_mps2), "{peak_mps2} m/s²");
    let up = state(&world, car).world_from_actor.rotation * Vec3::z();
    assert!(up.z > 0.95, "it does not roll over: {up}");
}

#[test]
fn the_hand_brake_locks_the_rear_and_stops_the_car() {
    let mut world = world();
    let car = car(&mut world, 0.0, KMH_40);
    control(&mut world, car, VehicleControl { hand_brake: true, ..Default::default() });
    run(&mut world, 100);
    assert!(speed_mps(&world, car) < 0.01);
    assert!(position_m(&world, car).x > 10.0, "weaker than the pedal");
}

#[test]
fn every_step_length_within_the_limits_is_stable() {
    for dt_secs in [0.001, 0.01, 0.033, 0.05, 0.1] {
        let mut world = world_on(flat(), dt_secs);
        let car = car(&mut world, -500.0, 15.0);
        control(
            &mut world,
            car,
            VehicleControl { throttle: 0.5, steer: 0.05, ..Default::default() },
        );
        run(&mut world, (2.0 / dt_secs) as usize);
        brake(&mut world, car);
        run(&mut world, (5.0 / dt_secs) as usize);
        let end = state(&world, car);
        assert!(end.linear_velocity_mps.norm() < 0.01, "{dt_secs}: {}", end.linear_velocity_mps);
        assert!(end.world_from_actor.translation.z.abs() < 0.05, "{dt_secs}");
    }
}

#[test]
fn a_car_dropped_from_a_height_comes_to_rest_on_its_wheels() {
    let mut world = world();
    let pose = schemas::level_pose(Vec3::new(0.0, LANE_Y_M, 3.0), 0.3);
    let car = spawn_at(&mut world, "vehicle.tesla.model3", pose, 0.0);
    run(&mut world, 100);
    let state = state(&world, car);
    assert!(state.linear_velocity_mps.norm() < 0.01, "{}", state.linear_velocity_mps);
    assert!(state.world_from_actor.translation.z.abs() < 0.03, "{}", state.world_from_actor);
}

#[test]
fn every_vehicle_drives_off_and_stops() {
    let mut count = 0;
    for blueprint in vehicles() {
        let mut world = world();
        let pose = schemas::level_pose(Vec3::new(0.0, LANE_Y_M, 0.2), 0.0);
        let car = spawn_at(&mut world, blueprint, pose, 0.0);
        control(&mut world, car, VehicleControl { throttle: 0.6, ..Default::default() });
        run(&mut world, 60);
        assert!(speed_mps(&world, car) > 2.0, "{blueprint}: {}", speed_mps(&world, car));
        brake(&mut world, car);
        run(&mut world, 80);
        assert!(speed_mps(&world, car) < 0.01, "{blueprint}");
        count += 1;
    }
    assert!(count >= 41, "CARLA has 41 vehicles: {count}");
}

fn handle_as(world: &mut World, car: ActorId, handling: Handling) {
    let mut physics = Box::new(world.vehicle_report(car).unwrap().physics);
    physics.handling = handling;
    for wheel in physics.wheels.iter_mut().filter(|wheel| wheel.steer_rad_max > 0.0) {
        wheel.steer_rad_max = 70.0_f32.to_radians();
    }
    world.apply(&Command::Vehicle(VehicleCommand::Physics { actor: car, physics })).unwrap();
}

#[test]
fn a_box_that_changes_gears_slowly_drives_on_after_a_change() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let mut physics = Box::new(world.vehicle_report(car).unwrap().physics);
    physics.gear_switch_secs = 1.0;
    world.apply(&Command::Vehicle(VehicleCommand::Physics { actor: car, physics })).unwrap();
    control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
    run(&mut world, 300);
    assert!(state(&world, car).gear > 1);
    assert!(speed_mps(&world, car) > 20.0, "{}", speed_mps(&world, car));
}

#[test]
fn an_engine_as_carlas_brakes_down_to_a_crawl_and_a_real_one_lets_the_car_roll() {
    let speed_after_mps = |handling| {
        let mut world = world();
        let car = car(&mut world, 0.0, 10.0);
        handle_as(&mut world, car, handling);
        let mut physics = Box::new(world.vehicle_report(car).unwrap().physics);
        if handling == Handling::Carla {
            physics.damping_closed_throttle_clutch_engaged = 2.0;
            physics.clutch_strength = 10.0;
        }
        world.apply(&Command::Vehicle(VehicleCommand::Physics { actor: car, physics })).unwrap();
        run(&mut world, 30);
        speed_mps(&world, car)
    };
    let [real_mps, carla_mps] = [Handling::Real, Handling::Carla].map(speed_after_mps);
    assert!(real_mps > 8.5, "{real_mps}");
    assert!((0.5..6.0).contains(&carla_mps), "{carla_mps}");
}

/// Headings of a car beside its lane, in radians, and the farthest that it is beside its middle, in
/// metres: at 36 km/h, steered towards a point ahead as CARLA's agents do it.
fn headings_in_a_lane(handling: Handling) -> (Vec<f32>, f32) {
    let mut world = world();
    let car = car(&mut world, 0.0, 10.0);
    handle_as(&mut world, car, handling);
    let (mut headings, mut beside_m) = (Vec::new(), 0.0_f32);
    for _ in 0..400 {
        let place = position_m(&world, car);
        let heading_rad = state(&world, car).world_from_actor.rotation.euler_angles().2;
        headings.push(heading_rad);
        beside_m = beside_m.max((place.y - LANE_Y_M).abs());
        let to_the_point_rad = (LANE_Y_M - place.y) / 5.0 - heading_rad;
        let throttle = if speed_mps(&world, car) < 10.0 { 0.5 } else { 0.0 };
        let steer = (1.95 * to_the_point_rad).clamp(-0.8, 0.8);
        control(&mut world, car, VehicleControl { throttle, steer, ..VehicleControl::default() });
        run(&mut world, 1);
    }
    (headings, beside_m)
}

/// CARLA's agents take nothing for ahead whose direction differs by less than 0.26 mrad.
#[test]
fn a_car_that_handles_as_carlas_is_never_straight_for_long_and_keeps_its_lane() {
    let (headings, beside_m) = headings_in_a_lane(Handling::Carla);
    let straight = headings.iter().filter(|heading_rad| heading_rad.abs() < 2.6e-4).count();
    eprintln!("straight in {straight} of {} ticks, {beside_m} m beside", headings.len());
    assert!(straight * 2 < headings.len(), "straight in {straight} of {} ticks", headings.len());
    assert!((0.001..0.15).contains(&beside_m), "{beside_m} m");
    let (headings, _) = headings_in_a_lane(Handling::Real);
    assert!(headings.iter().all(|heading_rad| heading_rad.abs() < 2.6e-4));
}

/// Seen from 20 m behind, 5.2 mm are what an agent of CARLA's needs to see who stands there.
#[test]
fn a_car_that_handles_as_carlas_lands_some_millimetres_aside_and_any_other_where_it_was_put() {
    let beside_m = |handling, x_m: f32, height_m: f32| {
        let mut world = world();
        let pose = schemas::level_pose(Vec3::new(x_m, LANE_Y_M, height_m), 0.0);
        let car = spawn_at(&mut world, "vehicle.tesla.model3", pose, 0.0);
        handle_as(&mut world, car, handling);
        run(&mut world, 1);
        let at_first_m = (position_m(&world, car).y - LANE_Y_M).abs();
        assert!(at_first_m < 0.005, "{at_first_m} m in the first tick");
        run(&mut world, 40);
        (position_m(&world, car).y - LANE_Y_M).abs()
    };
    for x_m in [0.0, 3.0, 7.0, 12.0] {
        for height_m in [0.05, 0.1, 0.3, 0.5] {
            let aside_m = beside_m(Handling::Carla, x_m, height_m);
            assert!((0.006..0.02).contains(&aside_m), "{aside_m} m from {height_m} m up");
            assert_eq!(aside_m, beside_m(Handling::Carla, x_m, height_m));
            assert!(beside_m(Handling::Real, x_m, height_m) < 0.001);
        }
    }
}
