//! Goal: grip is what weather, zones and clients say, and the length of a step does not show.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{
    ActorId, Attribute, Command, ErrorCode, Pose, Vec3, VehicleCommand, VehicleControl, Weather,
    level_pose,
};
use world::World;

fn spawn_with(world: &mut World, blueprint: &str, pose: Pose, given: &[(&str, &str)]) -> ActorId {
    let attributes = given
        .iter()
        .map(|(id, value)| Attribute { id: (*id).to_owned(), value: (*value).to_owned() });
    let command = Command::SpawnActor {
        blueprint: blueprint.to_owned(),
        reference_from_actor: pose,
        linear_velocity_mps: Vec3::zeros(),
        attributes: attributes.collect(),
        attachment: None,
        id: None,
    };
    world.apply(&command).unwrap().unwrap()
}

/// A zone of 20 m by 8 m by 4 m around the left lane.
fn zone(world: &mut World, x_m: f32, friction: &str) -> ActorId {
    let pose = level_pose(Vec3::new(x_m, LANE_Y_M, 0.0), 0.0);
    let half_cm = [("extent_x", "1000"), ("extent_y", "400"), ("extent_z", "200")];
    let given = [&half_cm[..], &[("friction", friction)]].concat();
    spawn_with(world, "static.trigger.friction", pose, &given)
}

fn tyre_friction(world: &World, car: ActorId) -> f32 {
    world.vehicle_report(car).unwrap().physics.wheels[0].tyre_friction
}

/// Metres from 50 km/h to a stand.
fn braking_m(world: &mut World) -> f32 {
    let car = car(world, 0.0, 50.0 / 3.6);
    brake(world, car);
    run(world, 400);
    assert!(speed_mps(world, car) < 0.02);
    position_m(world, car).x
}

#[test]
fn a_zone_has_its_friction_from_edge_to_edge() {
    let mut world = world();
    zone(&mut world, 30.0, "0.25");
    let car = car(&mut world, 0.0, 10.0);
    let own = tyre_friction(&world, car);
    for _ in 0..120 {
        run(&mut world, 1);
        let x_m = position_m(&world, car).x;
        // Half the car's length and a tick's way on either side.
        let distance_m = (x_m - 30.0).abs();
        if distance_m < 12.0 {
            assert_eq!(tyre_friction(&world, car), 0.25, "at {x_m}");
        } else if distance_m > 13.0 {
            assert_eq!(tyre_friction(&world, car), own, "at {x_m}");
        }
    }
    assert!(position_m(&world, car).x > 50.0);
}

#[test]
fn braking_in_a_zone_of_ice_takes_as_much_longer() {
    let usual_m = braking_m(&mut world());
    let mut icy = world();
    for x_m in [0.0, 20.0, 40.0, 60.0, 80.0, 100.0] {
        zone(&mut icy, x_m, "0.2");
    }
    let icy_m = braking_m(&mut icy);
    assert!((4.0..6.0).contains(&(icy_m / usual_m)), "{usual_m} and {icy_m} m");
}

#[test]
fn a_zone_acts_on_who_stands_in_it_and_ends_with_its_actor() {
    let mut world = world_on(slope_of_ten_percent(), 0.05);
    let pose = level_pose(Vec3::new(0.0, LANE_Y_M, 100.0), 0.0);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
    brake(&mut world, car);
    run(&mut world, 100);
    let start_m = position_m(&world, car).x;
    let place = Pose::translation(0.0, LANE_Y_M, 100.0);
    let given = [("extent_x", "3000"), ("extent_y", "400"), ("extent_z", "900")];
    let ice = spawn_with(
        &mut world,
        "static.trigger.friction",
        place,
        &[&given[..], &[("friction", "0.02")]].concat(),
    );
    run(&mut world, 40);
    assert!(position_m(&world, car).x < start_m - 0.5, "it slides down");
    world.apply(&Command::DestroyActor { actor: ice }).unwrap();
    run(&mut world, 100);
    let stopped_m = position_m(&world, car).x;
    run(&mut world, 40);
    assert!((position_m(&world, car).x - stopped_m).abs() < 1.0e-3);
}

#[test]
fn parameters_that_were_read_and_written_in_a_zone_end_with_it() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let own = tyre_friction(&world, car);
    let ice = zone(&mut world, 0.0, "0.1");
    run(&mut world, 1);
    let physics = Box::new(world.vehicle_report(car).unwrap().physics);
    assert_eq!(physics.wheels[0].tyre_friction, 0.1);
    world.apply(&Command::Vehicle(VehicleCommand::Physics { actor: car, physics })).unwrap();
    let copy = World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
    assert_eq!((copy.state_hash(), tyre_friction(&copy, car)), (world.state_hash(), 0.1));
    world.apply(&Command::DestroyActor { actor: ice }).unwrap();
    run(&mut world, 1);
    assert_eq!(tyre_friction(&world, car), own);
}

#[test]
fn a_zone_with_unusable_attributes_is_refused() {
    let mut world = world();
    for (id, value) in [("friction", "-1"), ("friction", "ice"), ("extent_x", "-5")] {
        let attributes = vec![Attribute { id: id.to_owned(), value: value.to_owned() }];
        let command = Command::SpawnActor {
            blueprint: "static.trigger.friction".to_owned(),
            reference_from_actor: Pose::identity(),
            linear_velocity_mps: Vec3::zeros(),
            attributes,
            attachment: None,
            id: None,
        };
        assert_eq!(world.apply(&command).unwrap_err().code, ErrorCode::InvalidArgument);
    }
}

#[test]
fn a_control_that_does_not_stick_holds_for_one_tick() {
    let run_with = |sticky: &str, reset: bool| {
        let mut world = world();
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, 0.2), 0.0);
        let given = [("sticky_control", sticky)];
        let car = spawn_with(&mut world, "vehicle.audi.tt", pose, &given);
        run(&mut world, 10);
        control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
        run(&mut world, 1);
        assert_eq!(state(&world, car).control.throttle, 1.0);
        for _ in 0..60 {
            if reset {
                control(&mut world, car, VehicleControl::default());
            }
            run(&mut world, 1);
        }
        (position_m(&world, car), state(&world, car).control.throttle)
    };
    assert_eq!(run_with("false", false), run_with("true", true));
    let (there_m, throttle) = run_with("true", false);
    assert_eq!(throttle, 1.0);
    assert!(there_m.x > 5.0, "{there_m}");
}

#[test]
fn wet_roads_lengthen_braking_by_as_much_as_they_take_grip() {
    let on_road_with = |wetness_percent: f32, precipitation_deposits_percent: f32| {
        let mut world = world();
        let weather =
            Weather { wetness_percent, precipitation_deposits_percent, ..Weather::CLEAR_NOON };
        world.apply(&Command::SetWeather { weather }).unwrap();
        braking_m(&mut world)
    };
    let dry_m = on_road_with(0.0, 0.0);
    for wet_m in [on_road_with(100.0, 0.0), on_road_with(0.0, 100.0)] {
        // 1 / 0.65 of the braking itself; the delay of the brakes stays.
        assert!((1.35..1.6).contains(&(wet_m / dry_m)), "{dry_m} and {wet_m} m");
    }
    let damp_m = on_road_with(50.0, 0.0);
    assert!(dry_m < damp_m && damp_m < on_road_with(100.0, 0.0));
}

/// Starts, curves and stops; where it ends, and its fastest upward speed.
fn course(dt_secs: f64, substep_secs_max: f64, substeps_max: u32) -> (Vec3, f32) {
    let mut world = world();
    let step = Command::SetTimeStep {
        dt_secs,
        substep_secs_max: Some(substep_secs_max),
        substeps_max: Some(substeps_max),
    };
    world.apply(&step).unwrap();
    let car = car(&mut world, 0.0, 0.0);
    let mut bounce_mps = 0.0f32;
    for (secs, throttle, steer, brake) in
        [(3.0, 0.8, 0.0, 0.0), (1.0, 0.2, 0.15, 0.0), (1.0, 0.2, -0.15, 0.0), (4.0, 0.0, 0.0, 0.8)]
    {
        let wanted = VehicleControl { throttle, steer, brake, ..Default::default() };
        control(&mut world, car, wanted);
        for _ in 0..(secs / dt_secs).round() as usize {
            run(&mut world, 1);
            bounce_mps = bounce_mps.max(state(&world, car).linear_velocity_mps.z.abs());
        }
    }
    assert!(speed_mps(&world, car) < 0.02, "it stands after {dt_secs} s steps");
    (position_m(&world, car), bounce_mps)
}

#[test]
fn a_course_ends_at_the_same_place_with_every_step_length() {
    let (finest_m, _) = course(0.001, 0.001, 1);
    for (dt_secs, substep_secs_max, substeps_max) in
        [(0.002, 0.01, 10), (0.01, 0.01, 10), (0.02, 0.005, 16), (0.05, 0.01, 10), (0.1, 0.1, 1)]
    {
        let (end_m, bounce_mps) = course(dt_secs, substep_secs_max, substeps_max);
        let apart_m = (end_m - finest_m).norm();
        assert!(apart_m < 0.02 * finest_m.norm(), "{dt_secs} s: {end_m} for {finest_m}");
        assert!(bounce_mps < 0.3, "{dt_secs} s: {bounce_mps} m/s");
    }
}

#[test]
fn ticks_of_changing_length_drive_as_far_as_equal_ones() {
    let drive = |lengths_secs: &[f64]| {
        let mut world = world();
        let car = car(&mut world, 0.0, 0.0);
        control(&mut world, car, VehicleControl { throttle: 0.6, ..Default::default() });
        let mut lengths = lengths_secs.iter().cycle();
        while world.frame().sim_secs < 4.0 - 1.0e-9 {
            let left_secs = 4.0 - world.frame().sim_secs;
            world.tick_by(lengths.next().unwrap().min(left_secs).max(0.001)).unwrap();
        }
        (position_m(&world, car).x, world.frame().sim_secs)
    };
    let (even_m, even_secs) = drive(&[0.05]);
    // What an asynchronous world does whose machine is busy at times.
    let (uneven_m, uneven_secs) = drive(&[0.033, 0.034, 0.1, 0.016, 0.071, 0.003]);
    assert!((even_secs - 4.0).abs() < 2.0e-3 && (uneven_secs - 4.0).abs() < 2.0e-3);
    assert!((uneven_m / even_m - 1.0).abs() < 0.01, "{even_m} and {uneven_m} m");
}

#[test]
fn vehicles_left_alone_stay_for_ten_minutes() {
    for id in ["vehicle.lincoln.mkz", "vehicle.carlamotors.firetruck", "vehicle.kawasaki.ninja"] {
        for hand_brake in [false, true] {
            let mut world = world();
            let pose = level_pose(Vec3::new(0.0, LANE_Y_M, 0.1), 0.4);
            let actor = spawn_at(&mut world, id, pose, 0.0);
            control(&mut world, actor, VehicleControl { hand_brake, ..Default::default() });
            run(&mut world, 100);
            let start = state(&world, actor).world_from_actor;
            run(&mut world, 12_000);
            let end = state(&world, actor).world_from_actor;
            let drift_m = (end.translation.vector - start.translation.vector).norm();
            assert!(drift_m < 1.0e-3, "{id}: {drift_m} m");
            assert!(start.rotation.angle_to(&end.rotation) < 1.0e-3, "{id}");
        }
    }
}
