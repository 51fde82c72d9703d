//! Goal: vehicles drive as their parameters say.
//! Method: a long level road and what a driver can do on it.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;
mod pad;

use common::*;
use pad::*;
use schemas::{
    AckermannControl, BodyCommand, Command, Vec3, VehicleCommand, VehicleControl, VehicleFailure,
    VehiclePhysics, level_pose,
};
use world::World;

fn physics(world: &World, actor: schemas::ActorId) -> VehiclePhysics {
    world.vehicle_report(actor).unwrap().physics
}

fn set_physics(world: &mut World, actor: schemas::ActorId, physics: &VehiclePhysics) {
    let physics = Box::new(physics.clone());
    world.apply(&Command::Vehicle(VehicleCommand::Physics { actor, physics })).unwrap();
}

fn changed(id: &str, change: impl Fn(&mut VehiclePhysics)) -> (World, schemas::ActorId) {
    let (mut world, car) = standing(id);
    let mut physics = physics(&world, car);
    change(&mut physics);
    set_physics(&mut world, car, &physics);
    (world, car)
}

/// Metres from 50 km/h to a stand.
fn braking_m(world: &mut World, car: schemas::ActorId) -> f32 {
    let linear_mps = Some(Vec3::new(50.0 / 3.6, 0.0, 0.0));
    world
        .apply(&Command::Body(BodyCommand::SetVelocity {
            actor: car,
            linear_mps,
            angular_radps: None,
        }))
        .unwrap();
    let start_m = position_m(world, car).x;
    brake(world, car);
    for _ in 0..1_200 {
        run(world, 1);
        if speed_mps(world, car) < 0.02 {
            break;
        }
    }
    position_m(world, car).x - start_m
}

/// Metres per second after two seconds of full throttle.
fn start_mps(world: &mut World, car: schemas::ActorId) -> f32 {
    control(world, car, VehicleControl { throttle: 1.0, ..Default::default() });
    run(world, 40);
    speed_mps(world, car)
}

#[test]
fn every_vehicle_starts_steers_and_stops_on_its_wheels() {
    let vehicles = blueprints::all().iter().filter(|one| one.id.starts_with("vehicle."));
    for blueprint in vehicles {
        let (mut world, car) = standing(&blueprint.id);
        control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
        run(&mut world, 100);
        let speed = speed_mps(&world, car);
        assert!(speed > 4.0, "{}: {speed} m/s after 5 s", blueprint.id);
        let turn = VehicleControl { throttle: 0.3, steer: 0.2, ..Default::default() };
        control(&mut world, car, turn);
        run(&mut world, 40);
        let up = state(&world, car).world_from_actor.rotation * Vec3::z();
        assert!(up.z > 0.6, "{}: {up}", blueprint.id);
        assert!(position_m(&world, car).y > LANE_Y_M + 0.5, "{}", blueprint.id);
        brake(&mut world, car);
        run(&mut world, 200);
        let end = state(&world, car);
        assert!(end.linear_velocity_mps.norm() < 0.02, "{}: {end:?}", blueprint.id);
        assert!((end.world_from_actor.rotation * Vec3::z()).z > 0.99, "{}", blueprint.id);
        assert_eq!(end.failure, VehicleFailure::None);
    }
}

#[test]
fn parameters_come_back_as_they_were_set() {
    for id in ["vehicle.mini.cooper_s", "vehicle.carlamotors.european_hgv", "vehicle.bh.crossbike"]
    {
        let (mut world, car) = standing(id);
        let before = physics(&world, car);
        set_physics(&mut world, car, &before);
        assert_eq!(physics(&world, car), before);
        let changed = VehiclePhysics { mass_kg: before.mass_kg * 1.5, ..before };
        set_physics(&mut world, car, &changed);
        assert_eq!(physics(&world, car), changed);
        let bytes = world.snapshot();
        let restored = World::restore(&bytes, world.id(), 1, |_| Some(pad_town())).unwrap();
        assert_eq!(physics(&restored, car), changed);
        assert_eq!(restored.state_hash(), world.state_hash());
    }
}

#[test]
fn unusable_parameters_are_refused_and_change_nothing() {
    let (mut world, car) = standing("vehicle.audi.a2");
    let before = physics(&world, car);
    let hash = world.state_hash();
    let bad: [fn(&mut VehiclePhysics); 5] = [
        |physics| physics.mass_kg = 0.0,
        |physics| physics.wheels[0].radius_m = f32::NAN,
        |physics| physics.torque_curve.clear(),
        |physics| physics.torque_curve.reverse(),
        |physics| physics.wheels.truncate(1),
    ];
    for change in bad {
        let mut physics = before.clone();
        change(&mut physics);
        let physics = Box::new(physics);
        assert!(
            world
                .apply(&Command::Vehicle(VehicleCommand::Physics { actor: car, physics }))
                .is_err()
        );
    }
    assert_eq!(world.state_hash(), hash);
}

#[test]
fn twice_the_mass_halves_the_acceleration() {
    let id = "vehicle.audi.a2";
    let (mut light, car) = standing(id);
    let light_mps = start_mps(&mut light, car);
    let (mut heavy, car) = changed(id, |physics| physics.mass_kg *= 2.0);
    let heavy_mps = start_mps(&mut heavy, car);
    assert!((heavy_mps / light_mps - 0.5).abs() < 0.1, "{light_mps} and {heavy_mps} m/s");
}

#[test]
fn slippery_tyres_lengthen_braking_by_as_much() {
    let id = "vehicle.mini.cooper_s";
    let (mut world, car) = standing(id);
    let usual_m = braking_m(&mut world, car);
    let (mut world, car) = changed(id, |physics| {
        physics.wheels.iter_mut().for_each(|wheel| wheel.tyre_friction = 0.1);
    });
    let slippery_m = braking_m(&mut world, car);
    assert!((6.0..12.0).contains(&(slippery_m / usual_m)), "{usual_m} and {slippery_m} m");
}

#[test]
fn stiffer_tyres_start_faster() {
    let vehicles = blueprints::all().iter().filter(|one| one.id.starts_with("vehicle."));
    for blueprint in vehicles {
        let metres = |stiffness: f32| {
            let (mut world, car) = changed(&blueprint.id, |physics| {
                let wheels = physics.wheels.iter_mut();
                wheels.for_each(|wheel| wheel.longitudinal_stiffness = stiffness);
            });
            let start_m = position_m(&world, car).x;
            control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
            run(&mut world, 100);
            position_m(&world, car).x - start_m
        };
        let (soft_m, stiff_m) = (metres(0.25), metres(5.0));
        assert!(stiff_m > 1.05 * soft_m, "{}: {soft_m} and {stiff_m} m", blueprint.id);
    }
}

#[test]
fn a_manual_gear_holds_and_neutral_drives_nowhere() {
    let (mut world, car) = standing("vehicle.ford.mustang");
    let manual =
        |gear| VehicleControl { throttle: 1.0, manual_gear: true, gear, ..Default::default() };
    control(&mut world, car, manual(0));
    run(&mut world, 40);
    let report = world.vehicle_report(car).unwrap();
    assert!(speed_mps(&world, car) < 0.05);
    assert!(report.telemetry.engine_rpm > 5_000.0, "{}", report.telemetry.engine_rpm);
    control(&mut world, car, manual(1));
    run(&mut world, 200);
    let report = world.vehicle_report(car).unwrap();
    assert_eq!((state(&world, car).gear, report.telemetry.gear), (1, 1));
    // The limiter of first gear: 6,250 rpm over 3.38 · 3.55.
    let kmh = speed_mps(&world, car) * 3.6;
    assert!((55.0..72.0).contains(&kmh), "{kmh} km/h");
    brake(&mut world, car);
    run(&mut world, 80);
    control(&mut world, car, manual(-1));
    run(&mut world, 40);
    assert!(state(&world, car).linear_velocity_mps.x < -1.0);
}

#[test]
fn telemetry_tells_what_the_wheels_do() {
    let (mut world, car) = standing("vehicle.lincoln.mkz");
    run(&mut world, 40);
    let report = world.vehicle_report(car).unwrap();
    let loads_n: f32 = report.telemetry.wheels.iter().map(|wheel| wheel.load_n).sum();
    assert!((loads_n / (1_800.0 * 9.81) - 1.0).abs() < 0.01, "{loads_n} N");
    control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
    run(&mut world, 40);
    let telemetry = world.vehicle_report(car).unwrap().telemetry;
    let [front, _, rear, _] = telemetry.wheels[..] else { panic!("it has four wheels") };
    assert!(front.torque_nm > 100.0 && rear.torque_nm.abs() < 1.0, "{telemetry:?}");
    assert!(front.longitudinal_slip > rear.longitudinal_slip, "{telemetry:?}");
    assert!(front.load_share < 1.0 && rear.load_share > 1.0, "it squats: {telemetry:?}");
    assert!(telemetry.engine_rpm > 1_500.0 && telemetry.drag_n > 1.0, "{telemetry:?}");
    control(&mut world, car, VehicleControl { steer: 0.3, ..Default::default() });
    run(&mut world, 20);
    let telemetry = world.vehicle_report(car).unwrap().telemetry;
    assert!(telemetry.wheels[0].lateral_force_n > 500.0, "{telemetry:?}");
    assert!(telemetry.wheels[0].lateral_slip < 0.0, "it slides right: {telemetry:?}");
}

#[test]
fn a_motorcycle_leans_into_the_curve_and_stands_by_itself() {
    let (mut world, bike) = standing("vehicle.kawasaki.ninja");
    run(&mut world, 200);
    let upright = state(&world, bike).world_from_actor.rotation * Vec3::z();
    assert!(upright.z > 0.9999, "{upright}");
    let linear_mps = Some(Vec3::new(15.0, 0.0, 0.0));
    world
        .apply(&Command::Body(BodyCommand::SetVelocity {
            actor: bike,
            linear_mps,
            angular_radps: None,
        }))
        .unwrap();
    control(&mut world, bike, VehicleControl { throttle: 0.15, steer: 0.5, ..Default::default() });
    run(&mut world, 60);
    let riding = state(&world, bike);
    let left = riding.world_from_actor.rotation * Vec3::y();
    let curve_mps2 = riding.angular_velocity_radps.z * riding.linear_velocity_mps.norm();
    assert!(curve_mps2 > 2.0, "{curve_mps2} m/s²");
    let lean_rad = (-left.z).asin();
    let wanted_rad = (curve_mps2 / 9.81).atan();
    assert!((lean_rad - wanted_rad).abs() < 0.12, "{lean_rad} rad for {wanted_rad} rad");
}

#[test]
fn full_lock_draws_the_published_turning_circle() {
    for (id, circle_m) in [
        ("vehicle.mini.cooper_s", 10.7),
        ("vehicle.lincoln.mkz", 11.3),
        ("vehicle.carlamotors.firetruck", 17.0),
    ] {
        let (mut world, car) = standing(id);
        control(
            &mut world,
            car,
            VehicleControl { throttle: 0.2, steer: 1.0, ..Default::default() },
        );
        run(&mut world, 30);
        control(&mut world, car, VehicleControl { steer: 1.0, ..Default::default() });
        let (mut low_m, mut high_m) = (f32::MAX, f32::MIN);
        for _ in 0..600 {
            let slow = speed_mps(&world, car) < 2.0;
            let throttle = if slow { 0.25 } else { 0.0 };
            control(&mut world, car, VehicleControl { throttle, steer: 1.0, ..Default::default() });
            run(&mut world, 1);
            let y_m = position_m(&world, car).y;
            (low_m, high_m) = (low_m.min(y_m), high_m.max(y_m));
        }
        // The box centre runs inside of the outer front wheel.
        let centre_m = high_m - low_m;
        assert!(centre_m < circle_m && centre_m > 0.6 * circle_m, "{id}: {centre_m} m");
    }
}

#[test]
fn an_ackermann_target_is_reached_and_held() {
    for speed_mps_wanted in [8.0, -3.0] {
        let (mut world, car) = standing("vehicle.tesla.model3");
        let target = AckermannControl { speed_mps: speed_mps_wanted, ..Default::default() };
        world
            .apply(&Command::Vehicle(VehicleCommand::Ackermann { actor: car, control: target }))
            .unwrap();
        run(&mut world, 300);
        let along_mps = state(&world, car).linear_velocity_mps.x;
        assert!((along_mps - speed_mps_wanted).abs() < 0.5, "{along_mps} m/s");
        let stop = AckermannControl::default();
        world
            .apply(&Command::Vehicle(VehicleCommand::Ackermann { actor: car, control: stop }))
            .unwrap();
        run(&mut world, 300);
        assert!(speed_mps(&world, car) < 0.05, "{}", speed_mps(&world, car));
    }
}

#[test]
fn an_ackermann_target_the_other_way_is_driven_to_after_a_stop() {
    let (mut world, car) = standing("vehicle.tesla.model3");
    let mut drive = |speed_mps: f32, ticks: usize| -> Vec<(f32, VehicleControl)> {
        let control = AckermannControl { speed_mps, ..Default::default() };
        world.apply(&Command::Vehicle(VehicleCommand::Ackermann { actor: car, control })).unwrap();
        let tick = |_| {
            run(&mut world, 1);
            let told = state(&world, car);
            (told.linear_velocity_mps.x, told.control)
        };
        (0..ticks).map(tick).collect()
    };
    drive(6.0, 100);
    for (goal_mps, sign) in [(-3.0, 1.0), (6.0, -1.0), (-3.0, 1.0), (0.0, -1.0)] {
        let told = drive(goal_mps, 200);
        let against = told.iter().take_while(|(mps, _)| sign * mps > 0.2);
        for (mps, control) in against {
            assert_eq!(control.reverse, sign < 0.0, "to {goal_mps} at {mps} m/s");
        }
        let stopped = told.iter().position(|(mps, _)| sign * mps < 0.2);
        assert!(stopped.is_some_and(|ticks| ticks < 80), "to {goal_mps}: {stopped:?}");
        let (last_mps, _) = told[199];
        assert!((last_mps - goal_mps).abs() < 0.4, "{last_mps} of {goal_mps}");
    }
}

#[test]
fn an_ackermann_angle_is_turned_to_at_its_rate() {
    let (mut world, car) = standing("vehicle.tesla.model3");
    let control = AckermannControl { steer_rad: 0.3, steer_radps: 0.1, ..Default::default() };
    world.apply(&Command::Vehicle(VehicleCommand::Ackermann { actor: car, control })).unwrap();
    run(&mut world, 20);
    let half = state(&world, car).road_wheel_rad;
    assert!((half - 0.1).abs() < 0.02, "{half} rad after a second");
    run(&mut world, 60);
    let whole = state(&world, car).road_wheel_rad;
    assert!((whole - 0.3).abs() < 0.02, "{whole} rad");
}

#[test]
fn the_service_brake_holds_every_vehicle_on_a_hill() {
    for id in ["vehicle.mini.cooper_s", "vehicle.carlamotors.firetruck", "vehicle.kawasaki.ninja"] {
        let mut world = world_on(slope_of_ten_percent(), 0.05);
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, 100.0), 0.0);
        let car = spawn_at(&mut world, id, pose, 0.0);
        brake(&mut world, car);
        run(&mut world, 40);
        let start_m = position_m(&world, car);
        run(&mut world, 20 * 120);
        let drift_m = (position_m(&world, car) - start_m).norm();
        assert!(drift_m < 1.0e-3, "{id}: {drift_m} m");
    }
}
