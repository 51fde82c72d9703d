//! What clients do to bodies: hold, push, switch, place, attach, and how long a tick is.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{
    ActorId, ActorKind, Attachment, AttachmentKind, Attribute, BodyCommand, BodySwitch, Command,
    ErrorCode, Pose, PushKind, Vec3, VehicleCommand, VehicleControl, VehicleFailure, level_pose,
    limits,
};
use world::World;

fn switch(world: &mut World, actor: ActorId, switch: BodySwitch, on: bool) {
    world.apply(&Command::Body(BodyCommand::SetSwitch { actor, switch, on })).unwrap();
}

fn push(world: &mut World, actor: ActorId, kind: PushKind, amount: Vec3) {
    world.apply(&Command::Body(BodyCommand::Push { actor, kind, amount })).unwrap();
}

fn prop(world: &mut World, name: &str, at_m: Vec3) -> ActorId {
    spawn_at(world, &format!("static.prop.{name}"), level_pose(at_m, 0.0), 0.0)
}

fn attached(blueprint: &str, pose: Pose, parent: ActorId, kind: AttachmentKind) -> Command {
    Command::SpawnActor {
        blueprint: blueprint.to_owned(),
        reference_from_actor: pose,
        linear_velocity_mps: Vec3::zeros(),
        attributes: Vec::new(),
        attachment: Some(Attachment { parent, kind }),
        id: None,
    }
}

#[test]
fn a_held_velocity_is_held_against_brakes_until_let_go() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let hold =
        |velocity_mps| Command::Body(BodyCommand::SetConstantVelocity { actor: car, velocity_mps });
    world.apply(&hold(Some(Vec3::new(8.0, 0.0, 0.0)))).unwrap();
    brake(&mut world, car);
    run(&mut world, 100);
    assert!((speed_mps(&world, car) - 8.0).abs() < 0.1, "{}", speed_mps(&world, car));
    assert!((position_m(&world, car).x - 40.0).abs() < 0.5);
    world.apply(&hold(None)).unwrap();
    run(&mut world, 60);
    assert!(speed_mps(&world, car) < 0.1, "the brake counts again");
}

#[test]
fn an_impulse_changes_the_speed_by_itself_over_the_mass() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    push(&mut world, car, PushKind::Impulse, Vec3::new(1_800.0 * 3.0, 0.0, 0.0));
    assert!((speed_mps(&world, car) - 3.0).abs() < 1.0e-3);
    push(&mut world, car, PushKind::AngularImpulse, Vec3::new(0.0, 0.0, 500.0));
    assert!(state(&world, car).angular_velocity_radps.z > 0.05);
}

#[test]
fn a_force_lasts_for_one_tick() {
    let mut world = world();
    let crate_id = prop(&mut world, "box01", Vec3::new(0.0, 0.0, 5.0));
    switch(&mut world, crate_id, BodySwitch::Physics, true);
    switch(&mut world, crate_id, BodySwitch::Gravity, false);
    push(&mut world, crate_id, PushKind::Force, Vec3::new(160.0, 0.0, 0.0));
    push(&mut world, crate_id, PushKind::Torque, Vec3::new(0.0, 0.0, 1.0));
    run(&mut world, 1);
    let after = state(&world, crate_id);
    assert!((after.linear_velocity_mps.x - 1.0).abs() < 0.01, "{}", after.linear_velocity_mps);
    assert!(after.angular_velocity_radps.z > 0.1);
    run(&mut world, 10);
    let later = state(&world, crate_id);
    assert!((later.linear_velocity_mps.x - 1.0).abs() < 0.02, "{}", later.linear_velocity_mps);
}

#[test]
fn what_waits_deep_under_the_road_stays_there_until_it_is_put_on_it() {
    let mut world = world();
    let types = [
        ("vehicle.lincoln.mkz", 0.0),
        ("vehicle.diamondback.century", 10.0),
        ("walker.pedestrian.0001", 20.0),
    ];
    let waiting = types.map(|(blueprint, x_m)| {
        let deep = level_pose(Vec3::new(x_m, LANE_Y_M, -500.0), 0.0);
        (spawn_at(&mut world, blueprint, deep, 0.0), deep)
    });
    run(&mut world, 40);
    for (actor, deep) in waiting {
        assert!((position_m(&world, actor) - deep.translation.vector).norm() < 0.01, "{actor}");
    }
    let [(car, _), ..] = waiting;
    let road = level_pose(Vec3::new(0.0, LANE_Y_M, 0.5), 0.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose { actor: car, reference_from_actor: road }))
        .unwrap();
    control(&mut world, car, VehicleControl { throttle: 0.7, ..Default::default() });
    run(&mut world, 60);
    assert!(speed_mps(&world, car) > 3.0);
    assert!(position_m(&world, car).z.abs() < 0.3);
}

#[test]
fn a_body_put_into_the_ground_comes_up_without_a_leap() {
    for depth_m in [0.3, 0.8, 1.3, 1.8] {
        let mut world = world();
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, -depth_m), 0.0);
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
        let mut highest_m = f32::MIN;
        for _ in 0..100 {
            run(&mut world, 1);
            highest_m = highest_m.max(position_m(&world, car).z);
        }
        assert!(highest_m < 3.0, "{depth_m} m deep: {highest_m}");
    }
}

#[test]
fn without_physics_a_body_stays_where_it_is_put_and_still_stops_others() {
    let mut world = world();
    let parked = car(&mut world, 20.0, 0.0);
    switch(&mut world, parked, BodySwitch::Physics, false);
    let up = level_pose(Vec3::new(20.0, LANE_Y_M, 0.1), 0.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose { actor: parked, reference_from_actor: up }))
        .unwrap();
    let rear = car(&mut world, 0.0, 15.0);
    run(&mut world, 60);
    assert_eq!(state(&world, parked).world_from_actor, up);
    assert!(position_m(&world, rear).x < 16.0);
    switch(&mut world, parked, BodySwitch::Physics, true);
    run(&mut world, 60);
    assert!(position_m(&world, parked).z.abs() < 0.02, "it falls again");
}

#[test]
fn without_collisions_cars_pass_through_each_other_on_the_ground() {
    let mut world = world();
    let ghost = car(&mut world, 20.0, 0.0);
    switch(&mut world, ghost, BodySwitch::Collisions, false);
    let other = car(&mut world, 0.0, 15.0);
    assert!(run(&mut world, 60).is_empty());
    assert!(position_m(&world, other).x > 30.0);
    assert!(position_m(&world, ghost).z.abs() < 0.01);
}

#[test]
fn without_gravity_a_body_does_not_fall() {
    let mut world = world();
    let pose = level_pose(Vec3::new(0.0, LANE_Y_M, 4.0), 0.0);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
    switch(&mut world, car, BodySwitch::Gravity, false);
    run(&mut world, 40);
    assert!((position_m(&world, car).z - 4.0).abs() < 1.0e-3);
}

#[test]
fn a_prop_is_an_obstacle_until_its_physics_is_switched_on() {
    for loose in [false, true] {
        let mut world = world();
        let bin = prop(&mut world, "trashcan01", Vec3::new(15.0, LANE_Y_M, 0.0));
        switch(&mut world, bin, BodySwitch::Physics, loose);
        let car = car(&mut world, 0.0, 12.0);
        let hits = run(&mut world, 60);
        assert!(hits.iter().any(|hit| (hit.actor, hit.other) == (bin, Some(car))));
        assert_eq!(position_m(&world, car).x > 16.0, loose, "{}", position_m(&world, car));
        assert_eq!(position_m(&world, bin).x > 16.0, loose);
    }
}

#[test]
fn a_loose_prop_comes_to_rest_on_the_ground() {
    let mut world = world();
    let cone = prop(&mut world, "constructioncone", Vec3::new(0.0, 0.0, 1.0));
    run(&mut world, 20);
    assert_eq!(position_m(&world, cone).z, 1.0, "as it was put");
    switch(&mut world, cone, BodySwitch::Physics, true);
    run(&mut world, 100);
    assert!(position_m(&world, cone).z.abs() < 0.02, "{}", position_m(&world, cone));
    assert!(speed_mps(&world, cone) < 1.0e-3);
}

#[test]
fn what_is_attached_moves_as_one_with_its_parent_and_stays_when_it_goes() {
    let mut world = world();
    let car = car(&mut world, 0.0, 10.0);
    let mount = level_pose(Vec3::new(1.5, 0.0, 2.4), 0.5);
    let camera = attached("sensor.camera.rgb", mount, car, AttachmentKind::Rigid);
    let camera = world.apply(&camera).unwrap().unwrap();
    run(&mut world, 20);
    let (carrier, carried) = (state(&world, car), state(&world, camera));
    assert_eq!(carried.world_from_actor, carrier.world_from_actor * mount);
    assert_eq!((carried.parent, carried.kind), (Some(car), ActorKind::Sensor));
    assert!((carried.linear_velocity_mps - carrier.linear_velocity_mps).norm() < 0.1);
    world.apply(&Command::DestroyActor { actor: car }).unwrap();
    run(&mut world, 5);
    let left = state(&world, camera);
    assert_eq!((left.parent, left.world_from_actor), (None, carried.world_from_actor));
}

#[test]
fn what_a_tumbling_walker_holds_on_a_long_arm_may_be_faster_than_any_body() {
    let mut world = world();
    let person = walker(&mut world, 0.0, 0.0);
    let arm = level_pose(Vec3::new(50.0, 0.0, 0.0), 0.0);
    let cone = attached("static.prop.constructioncone", arm, person, AttachmentKind::Rigid);
    let cone = world.apply(&cone).unwrap().unwrap();
    car(&mut world, -8.0, 30.0);
    let speeds_mps = (0..40).map(|_| {
        run(&mut world, 1);
        speed_mps(&world, cone)
    });
    assert!(speeds_mps.fold(0.0, f32::max) > 2.0 * limits::SPEED_MPS_MAX);
}

#[test]
fn what_cannot_be_attached_is_refused() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let nobody = ActorId::new(99).unwrap();
    let pose = level_pose(Vec3::zeros(), 0.0);
    let refusal = |world: &mut World, blueprint, parent| {
        let command = attached(blueprint, pose, parent, AttachmentKind::Rigid);
        world.apply(&command).unwrap_err().code
    };
    assert_eq!(refusal(&mut world, "sensor.other.imu", nobody), ErrorCode::UnknownActor);
    assert_eq!(refusal(&mut world, "vehicle.audi.tt", car), ErrorCode::InvalidArgument);
}

#[test]
fn attributes_given_at_the_spawn_are_described_and_a_bad_one_is_refused() {
    let mut world = world();
    let attribute = |id: &str, value: &str| Attribute { id: id.into(), value: value.into() };
    let spawn = |attributes: Vec<Attribute>| Command::SpawnActor {
        blueprint: "vehicle.audi.tt".to_owned(),
        reference_from_actor: level_pose(Vec3::new(0.0, LANE_Y_M, 0.0), 0.0),
        linear_velocity_mps: Vec3::zeros(),
        attributes,
        attachment: None,
        id: None,
    };
    let bad = world.apply(&spawn(vec![attribute("color", "red")])).unwrap_err();
    assert_eq!((bad.code, bad.found.as_str()), (ErrorCode::InvalidArgument, "red"));
    let given = vec![attribute("role_name", "hero"), attribute("color", "1,2,255")];
    let car = world.apply(&spawn(given.clone())).unwrap().unwrap();
    assert_eq!(state(&world, car).colour_rgb, 0x0001_02FF);
    let described = world.describe(&[car]);
    assert_eq!(described.len(), 1);
    assert!(given.iter().all(|one| described[0].attributes.contains(one)));
    assert_eq!(described[0].tag, 14);
}

#[test]
fn lights_and_doors_are_kept() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    world.apply(&Command::Vehicle(VehicleCommand::Lights { actor: car, lights: 0b101 })).unwrap();
    let doors = |doors, open| Command::Vehicle(VehicleCommand::Doors { actor: car, doors, open });
    world.apply(&doors(0b1111, true)).unwrap();
    world.apply(&doors(0b0010, false)).unwrap();
    assert_eq!((state(&world, car).lights, state(&world, car).doors), (0b101, 0b1101));
    assert!(world.apply(&doors(0b100_0000, true)).is_err());
}

#[test]
fn the_time_step_can_change_and_seconds_add_up() {
    let mut world = world();
    run(&mut world, 4);
    world.tick_by(0.1).unwrap();
    assert!((world.frame().sim_secs - 0.3).abs() < 1.0e-12);
    assert_eq!(world.frame().dt_secs, 0.1);
    let step =
        Command::SetTimeStep { dt_secs: 0.02, substep_secs_max: None, substeps_max: Some(16) };
    world.apply(&step).unwrap();
    run(&mut world, 10);
    assert!((world.frame().sim_secs - 0.5).abs() < 1.0e-12);
    let refused = world.tick_by(0.5).unwrap_err();
    assert_eq!(refused.code, ErrorCode::InvalidArgument);
    assert_eq!(world.tick_number().0, 15);
}

#[test]
fn a_car_on_its_roof_has_failed_after_a_second() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let roll = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::x_axis(), 3.0);
    let world_from_actor = Pose::from_parts(Vec3::new(0.0, LANE_Y_M, 1.6).into(), roll);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor: car,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
    run(&mut world, 10);
    assert_eq!(state(&world, car).failure, VehicleFailure::None);
    run(&mut world, 40);
    assert_eq!(state(&world, car).failure, VehicleFailure::Rollover);
}

#[test]
fn nothing_tunnels_at_70_metres_per_second() {
    let mut world = world();
    let car_at_wall = car(&mut world, 550.0, 70.0);
    let pose = level_pose(Vec3::new(596.0, -5.0, 0.9), 0.0);
    let flying = spawn_at(&mut world, "walker.pedestrian.0001", pose, 70.0);
    run(&mut world, 40);
    assert!(position_m(&world, car_at_wall).x < 600.0, "{}", position_m(&world, car_at_wall));
    assert!(position_m(&world, flying).x < 600.0, "{}", position_m(&world, flying));

    let mut world = common::world();
    let fast = car(&mut world, 0.0, 70.0);
    let parked = car(&mut world, 40.0, 0.0);
    control(&mut world, parked, VehicleControl { hand_brake: true, ..Default::default() });
    run(&mut world, 40);
    assert!(position_m(&world, fast).x < position_m(&world, parked).x);
}

#[test]
fn a_small_fast_thing_does_not_pass_through_a_thin_one() {
    for start in 0..7u8 {
        let mut world = world();
        let across = level_pose(Vec3::new(20.0, 0.0, 0.0), std::f32::consts::FRAC_PI_2);
        spawn_at(&mut world, "static.prop.streetsign", across, 0.0);
        let cone =
            prop(&mut world, "constructioncone", Vec3::new(0.1 * f32::from(start), 0.0, 1.0));
        switch(&mut world, cone, BodySwitch::Physics, true);
        let linear_mps = Some(Vec3::new(70.0, 0.0, 0.0));
        let throw = Command::Body(BodyCommand::SetVelocity {
            actor: cone,
            linear_mps,
            angular_radps: None,
        });
        world.apply(&throw).unwrap();
        run(&mut world, 20);
        assert!(position_m(&world, cone).x < 20.0, "{}", position_m(&world, cone));
    }
}

fn given(world: &mut World, blueprint: &str, at_m: Vec3, attributes: &[(&str, &str)]) -> ActorId {
    let attribute =
        |&(id, value): &(&str, &str)| Attribute { id: id.to_owned(), value: value.to_owned() };
    let command = Command::SpawnActor {
        blueprint: blueprint.to_owned(),
        reference_from_actor: level_pose(at_m, 0.0),
        linear_velocity_mps: Vec3::zeros(),
        attributes: attributes.iter().map(attribute).collect(),
        attachment: None,
        id: None,
    };
    world.apply(&command).unwrap().unwrap()
}

fn friction(world: &World, car: ActorId) -> f32 {
    world.vehicle_report(car).unwrap().physics.wheels[0].tyre_friction
}

#[test]
fn tyres_have_the_friction_of_the_trigger_they_are_in() {
    let mut world = world();
    let extents =
        [("friction", "0.25"), ("extent_x", "500"), ("extent_y", "2000"), ("extent_z", "300")];
    let trigger = given(&mut world, "static.trigger.friction", Vec3::new(30.0, 0.0, 0.0), &extents);
    let car = car(&mut world, 0.0, 10.0);
    let own = friction(&world, car);
    run(&mut world, 20);
    assert_eq!(friction(&world, car), own, "not yet there");
    run(&mut world, 40);
    assert_eq!(friction(&world, car), 0.25);
    world.apply(&Command::DestroyActor { actor: trigger }).unwrap();
    run(&mut world, 1);
    assert_eq!(friction(&world, car), own, "the trigger is gone");
}

#[test]
fn a_trigger_needs_numbers() {
    let mut world = world();
    let wrong = Attribute { id: "friction".to_owned(), value: "slippery".to_owned() };
    let command = Command::SpawnActor {
        blueprint: "static.trigger.friction".to_owned(),
        reference_from_actor: Pose::identity(),
        linear_velocity_mps: Vec3::zeros(),
        attributes: vec![wrong],
        attachment: None,
        id: None,
    };
    assert_eq!(world.apply(&command).unwrap_err().code, ErrorCode::InvalidArgument);
}

#[test]
fn a_control_that_does_not_stick_holds_for_one_tick() {
    let mut world = world();
    let fleeting = [("sticky_control", "false")];
    let car = given(&mut world, "vehicle.lincoln.mkz", Vec3::new(0.0, LANE_Y_M, 0.0), &fleeting);
    let sent = VehicleControl { throttle: 1.0, ..Default::default() };
    for _ in 0..2 {
        control(&mut world, car, sent);
        run(&mut world, 1);
        assert_eq!(state(&world, car).control, sent);
        run(&mut world, 1);
        assert_eq!(state(&world, car).control, VehicleControl::default());
    }
}
