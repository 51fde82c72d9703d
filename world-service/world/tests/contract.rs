//! What a world promises to the service that owns it.

mod common;

use common::*;
use schemas::{
    ActorId, ActorKind, BodyCommand, Command, ErrorCode, PilotMode, Vec3, VehicleCommand,
    VehicleControl, WorldId, level_pose,
};
use world::{World, WorldConfig};

fn refusal(world: &mut World, command: &Command) -> ErrorCode {
    world.apply(command).expect_err("it must be refused").code
}

#[test]
fn a_world_moves_between_threads() {
    fn moves<T: Send>() {}
    moves::<World>();
}

#[test]
fn a_new_world_is_empty_at_tick_0_and_has_a_frame() {
    let world = world();
    let frame = world.frame();
    assert_eq!((frame.tick.0, frame.actors.len(), frame.seed, frame.epoch), (0, 0, 7, 1));
    assert_eq!(&frame.map, world.map_ref());
    assert_eq!(frame.state_hash, world.state_hash());
}

#[test]
fn a_step_outside_of_the_limits_is_refused() {
    for dt_secs in [0.0, 0.000_9, 0.11, -0.05, f64::NAN] {
        let id = WorldId::new(1).unwrap();
        let config = WorldConfig { id, epoch: 1, seed: 0, dt_secs, map: flat() };
        assert_eq!(World::new(config).err().unwrap().code, ErrorCode::InvalidArgument);
    }
}

#[test]
fn a_frame_lists_actors_by_id_with_their_types() {
    let mut world = world();
    let walker = walker(&mut world, 30.0, 0.0);
    let car = car(&mut world, 0.0, 5.0);
    let frame = world.frame();
    assert_eq!(frame.types, ["walker.pedestrian.0001", "vehicle.lincoln.mkz"]);
    let ids: Vec<ActorId> = frame.actors.iter().map(|actor| actor.id).collect();
    assert_eq!(ids, [walker, car]);
    let car = frame.actor(car).unwrap();
    assert_eq!((car.kind, frame.type_of(car)), (ActorKind::Vehicle, "vehicle.lincoln.mkz"));
    assert!((car.linear_velocity_mps.x - 5.0).abs() < 1.0e-6);
    assert!((car.box_centre_m.z - car.box_half_extent_m.z).abs() < 1.0e-6);
}

#[test]
fn a_vehicle_begins_where_it_is_put_and_falls_onto_its_wheels() {
    for z_m in [0.0, 0.5, 1.0] {
        let mut world = world();
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, z_m), 0.0);
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
        assert_eq!(position_m(&world, car).z, z_m);
        run(&mut world, 60);
        assert!(position_m(&world, car).z.abs() < 0.01, "{}", position_m(&world, car));
    }
}

#[test]
fn a_vehicle_that_begins_under_way_or_in_the_ground_is_put_onto_it() {
    for (z_m, forward_mps) in [(-0.2, 0.0), (-0.2, 5.0), (0.5, 5.0), (1.0, 5.0)] {
        let mut world = world();
        let pose = level_pose(Vec3::new(0.0, LANE_Y_M, z_m), 0.0);
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, forward_mps);
        assert!(position_m(&world, car).z.abs() < 1.0e-3);
    }
}

#[test]
fn commands_for_nobody_or_the_wrong_kind_are_refused() {
    let mut world = world();
    let walker = walker(&mut world, 0.0, 0.0);
    let control = VehicleControl::default();
    let nobody = ActorId::new(77).unwrap();
    let drive = |actor| Command::Vehicle(VehicleCommand::Control { actor, control });
    assert_eq!(refusal(&mut world, &drive(nobody)), ErrorCode::UnknownActor);
    assert_eq!(refusal(&mut world, &drive(walker)), ErrorCode::InvalidArgument);
    let pilot = Command::Vehicle(VehicleCommand::Pilot {
        actor: walker,
        mode: PilotMode::KeepLane,
        target_speed_mps: None,
    });
    assert_eq!(refusal(&mut world, &pilot), ErrorCode::InvalidArgument);
    let pose = level_pose(Vec3::new(9.0, 0.0, 0.0), 0.0);
    let spawn = Command::spawn("vehicle.of.nobody", pose, Vec3::zeros());
    assert_eq!(refusal(&mut world, &spawn), ErrorCode::UnknownBlueprint);
}

#[test]
fn numbers_outside_of_their_domain_are_refused() {
    let mut world = world();
    let actor = car(&mut world, 0.0, 0.0);
    let controls = [
        VehicleControl { throttle: f32::NAN, ..Default::default() },
        VehicleControl { throttle: -0.1, ..Default::default() },
        VehicleControl { steer: 1.1, ..Default::default() },
        VehicleControl { brake: f32::INFINITY, ..Default::default() },
    ];
    let mut commands: Vec<Command> = controls
        .into_iter()
        .map(|control| Command::Vehicle(VehicleCommand::Control { actor, control }))
        .collect();
    for x_m in [f32::NAN, 2.0e5] {
        let world_from_actor = level_pose(Vec3::new(x_m, 0.0, 0.0), 0.0);
        commands.push(Command::Body(BodyCommand::SetPose {
            actor,
            reference_from_actor: world_from_actor,
        }));
        let linear_mps = Some(Vec3::new(x_m, 0.0, 0.0));
        commands.push(Command::Body(BodyCommand::SetVelocity {
            actor,
            linear_mps,
            angular_radps: None,
        }));
    }
    for command in commands {
        assert_eq!(refusal(&mut world, &command), ErrorCode::InvalidArgument, "{command:?}");
    }
}

#[test]
fn an_actor_that_leaves_the_coordinates_is_put_to_rest_alone() {
    let mut world = world();
    let pose = level_pose(Vec3::new(99_995.0, 0.0, 0.0), 0.0);
    let lost = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 100.0);
    let other = car(&mut world, 0.0, 20.0);
    run(&mut world, 20);
    let halted: Vec<ActorId> = world.frame().halted.iter().map(|halt| halt.actor).collect();
    assert_eq!(halted, [lost]);
    assert_eq!(speed_mps(&world, lost), 0.0);
    assert!(position_m(&world, lost).x <= 100_000.0);
    assert!(position_m(&world, other).x > 18.0, "others drive on");
}

#[test]
fn velocities_and_poses_can_be_set() {
    let mut world = world();
    let actor = car(&mut world, 0.0, 0.0);
    run(&mut world, 60);
    let linear_mps = Vec3::new(10.0, 0.0, 0.0);
    let linear_mps = Some(linear_mps);
    world
        .apply(&Command::Body(BodyCommand::SetVelocity { actor, linear_mps, angular_radps: None }))
        .unwrap();
    run(&mut world, 20);
    assert!((speed_mps(&world, actor) - 10.0).abs() < 0.6, "the wheels roll along");
    let world_from_actor = level_pose(Vec3::new(100.0, -5.25, 0.4), 0.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
    assert_eq!(state(&world, actor).world_from_actor, world_from_actor, "exactly there");
    run(&mut world, 1);
    let place = position_m(&world, actor);
    assert!((place - Vec3::new(100.5, -5.25, 0.39)).norm() < 0.1, "it moves on: {place}");
    let sunk = level_pose(Vec3::new(100.0, -5.25, -0.6), 0.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose { actor, reference_from_actor: sunk }))
        .unwrap();
    assert!(position_m(&world, actor).z.abs() < 1.0e-3, "out of the ground");
}

#[test]
fn the_trajectory_of_a_fixed_drive_is_the_golden_one() {
    let mut world = world();
    let car = car(&mut world, 0.0, 15.0);
    walker(&mut world, 20.0, 0.5);
    control(&mut world, car, VehicleControl { throttle: 0.4, steer: 0.05, ..Default::default() });
    run(&mut world, 30);
    brake(&mut world, car);
    run(&mut world, 70);
    // A change here is a change of the simulation: say why in the commit.
    assert_eq!(world.state_hash(), GOLDEN_HASH, "{:#018x}", world.state_hash());
}

/// The same on every machine.
const GOLDEN_HASH: u64 = 0x60ec_bb83_2c03_97f8;
