//! Inputs that are accepted and meant to break the physics: an actor may be put to rest for them,
//! its world and its neighbours go on.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use proptest::prelude::*;
use schemas::{
    ActorId, Attachment, AttachmentKind, BodyCommand, BodySwitch, Command, PushKind, Vec3,
    VehicleCommand, VehicleControl, VehiclePhysics, level_pose, limits,
};
use world::World;

/// Cars, a lorry, a motorcycle, people and a cone, near enough to be thrown at each other.
const CAST: [(&str, f32, f32); 8] = [
    ("vehicle.mini.cooper_s", 0.0, 0.0),
    ("vehicle.carlamotors.firetruck", 12.0, 0.0),
    ("vehicle.kawasaki.ninja", -8.0, 1.0),
    ("vehicle.audi.tt", 0.0, 4.0),
    ("walker.pedestrian.0001", 6.0, 2.5),
    ("walker.pedestrian.0002", -4.0, 3.0),
    ("static.prop.constructioncone", 5.0, -3.0),
    ("vehicle.bh.crossbike", -8.0, -2.5),
];

fn cast(world: &mut World) -> Vec<ActorId> {
    let spawn = |&(blueprint, x_m, y_m): &(&str, f32, f32)| {
        spawn_at(world, blueprint, level_pose(Vec3::new(x_m, y_m, 1.0), 0.0), 0.0)
    };
    CAST.iter().map(spawn).collect()
}

fn one_of(values: &'static [f32]) -> impl Strategy<Value = f32> + Clone {
    prop::sample::select(values)
}

/// Vectors of every size up to the largest number.
fn any_size() -> impl Strategy<Value = Vec3> + Clone {
    let size = one_of(&[0.0, 1.0e-30, 1.0, 1.0e3, 1.0e5, 1.0e7, 2.0e7, 1.0e12, 1.0e37]);
    let way = [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0];
    (size, way).prop_map(|(size, way)| Vec3::from(way) * size)
}

/// The parameters of a vehicle with some of them at the limits of what is accepted.
fn distort(physics: &mut VehiclePhysics, which: u32, at: f32) {
    let between = |low: f32, high: f32| low + (high - low) * at;
    let pick = |bit: u32| which & (1 << bit) != 0;
    if pick(0) {
        physics.mass_kg = between(10.0, 200_000.0);
    }
    if pick(1) {
        physics.centre_of_mass_m = Vec3::new(between(-19.0, 19.0), 0.0, between(0.0, 6.0));
    }
    if pick(2) {
        physics.engine_inertia_kgm2 = between(1.0e-3, 1.0e3);
        physics.engine_rpm_max = between(1.0, 1.0e5);
    }
    if pick(3) {
        physics.torque_curve = vec![(0.0, 1.0e6), (1.0e5, 1.0e6)];
        physics.final_ratio = between(1.0e-3, 1.0e3);
    }
    if pick(4) {
        physics.drag_coefficient = between(0.0, 100.0);
    }
    if pick(5) {
        physics.steering_curve = vec![(0.0, 0.0), (0.0, 1.0), (150.0, 0.0)];
    }
    for wheel in &mut physics.wheels {
        if pick(6) {
            wheel.radius_m = between(0.05, 3.0);
        }
        if pick(7) {
            wheel.tyre_friction = between(0.0, 100.0);
        }
        if pick(8) {
            wheel.lateral_stiffness = between(1.0e-2, 1.0e5);
            wheel.longitudinal_stiffness = between(1.0e5, 1.0e-2);
        }
        if pick(9) {
            wheel.brake_nm_max = 1.0e7;
            wheel.damping_rate = between(0.0, 1.0e3);
        }
        if pick(10) {
            wheel.steer_rad_max = between(0.0, 1.57);
            wheel.position_m *= between(0.0, 4.0);
        }
        if pick(11) {
            wheel.lateral_stiffness_load_max = between(1.0e-2, 1.0e3);
        }
    }
}

/// What a client does; not every one of these is accepted.
#[derive(Clone, Debug)]
enum Deed {
    Command(Command),
    Distort { actor: ActorId, which: u32, at: f32 },
    Tick { dt_secs: f64 },
}

fn any_actor() -> impl Strategy<Value = ActorId> + Clone {
    (1..=CAST.len() as u32).prop_map(|id| ActorId::new(id).unwrap())
}

/// Pushes, places and speeds.
fn any_motion() -> impl Strategy<Value = Command> {
    let kind = prop::sample::select(vec![
        PushKind::Impulse,
        PushKind::Force,
        PushKind::AngularImpulse,
        PushKind::Torque,
    ]);
    let push = (any_actor(), kind, any_size())
        .prop_map(|(actor, kind, amount)| Command::Body(BodyCommand::Push { actor, kind, amount }));
    let far = one_of(&[0.0, 3.0, 99_990.0]);
    let pose = (any_actor(), far, -6.0f32..6.0, -0.5f32..4.0, -3.2f32..3.2).prop_map(
        |(actor, x_m, y_m, z_m, yaw_rad)| {
            Command::Body(BodyCommand::SetPose {
                actor,
                reference_from_actor: level_pose(Vec3::new(x_m, y_m, z_m), yaw_rad),
            })
        },
    );
    let velocity = (any_actor(), any_size(), any_size()).prop_map(|(actor, linear, angular)| {
        let linear_mps = Some(linear.cap_magnitude(limits::SPEED_MPS_MAX * 0.99));
        let angular_radps = Some(angular.cap_magnitude(59.0));
        Command::Body(BodyCommand::SetVelocity { actor, linear_mps, angular_radps })
    });
    let held = (any_actor(), prop::option::of(any_size())).prop_map(|(actor, held)| {
        let velocity_mps = held.map(|held| held.cap_magnitude(limits::SPEED_MPS_MAX * 0.99));
        Command::Body(BodyCommand::SetConstantVelocity { actor, velocity_mps })
    });
    prop_oneof![push, pose, velocity, held]
}

/// Switches, pedals, and things on long arms.
fn any_handling() -> impl Strategy<Value = Command> {
    let switch = prop::sample::select(vec![
        BodySwitch::Physics,
        BodySwitch::Gravity,
        BodySwitch::Collisions,
    ]);
    let switch = (any_actor(), switch, any::<bool>()).prop_map(|(actor, switch, on)| {
        Command::Body(BodyCommand::SetSwitch { actor, switch, on })
    });
    let drive = (any_actor(), -1.0f32..1.0, any::<bool>(), any::<bool>()).prop_map(
        |(actor, steer, reverse, hand_brake)| {
            let control = VehicleControl::default();
            let control = VehicleControl { throttle: 1.0, steer, reverse, hand_brake, ..control };
            Command::Vehicle(VehicleCommand::Control { actor, control })
        },
    );
    let hang = (any_actor(), one_of(&[0.5, 30.0, 99_999.0])).prop_map(|(parent, arm_m)| {
        Command::SpawnActor {
            blueprint: "static.prop.constructioncone".to_owned(),
            reference_from_actor: level_pose(Vec3::new(arm_m, 0.0, 0.0), 0.0),
            linear_velocity_mps: Vec3::zeros(),
            attributes: Vec::new(),
            attachment: Some(Attachment { parent, kind: AttachmentKind::Rigid }),
            id: None,
        }
    });
    prop_oneof![switch, drive, hang]
}

fn any_deed() -> impl Strategy<Value = Deed> {
    let at = prop_oneof![Just(0.0f32), Just(1.0), 0.0f32..1.0];
    let distort = (any_actor(), 0u32..1 << 12, at).prop_map(|(actor, which, at)| Deed::Distort {
        actor,
        which,
        at,
    });
    let tick = prop::sample::select(vec![0.001, 0.05, 0.1]);
    let tick = tick.prop_map(|dt_secs| Deed::Tick { dt_secs });
    let motion = any_motion().prop_map(Deed::Command);
    prop_oneof![
        2 => motion,
        2 => any_handling().prop_map(Deed::Command),
        2 => distort,
        5 => tick,
    ]
}

fn carry_out(world: &mut World, deed: &Deed) {
    match deed {
        Deed::Command(command) => {
            let _refused = world.apply(command);
        }
        Deed::Distort { actor, which, at } => {
            let Ok(report) = world.vehicle_report(*actor) else { return };
            let mut physics = report.physics;
            distort(&mut physics, *which, *at);
            let _refused = world.apply(&Command::Vehicle(VehicleCommand::Physics {
                actor: *actor,
                physics: Box::new(physics),
            }));
        }
        Deed::Tick { dt_secs } => world.tick_by(*dt_secs).unwrap(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The bystander stands a kilometre away: nothing thrown comes so far, so it must not move.
    #[test]
    fn no_accepted_input_ends_a_world_or_moves_a_bystander(
        deeds in prop::collection::vec(any_deed(), 1..60),
    ) {
        let mut world = world();
        cast(&mut world);
        let bystander = spawn_at(
            &mut world,
            "vehicle.tesla.model3",
            level_pose(Vec3::new(-950.0, LANE_Y_M, 0.0), 0.0),
            0.0,
        );
        run(&mut world, 40);
        let stood_m = position_m(&world, bystander);
        for deed in &deeds {
            carry_out(&mut world, deed);
        }
        run(&mut world, 20);
        prop_assert!((position_m(&world, bystander) - stood_m).norm() < 1.0e-3);

        let frame = world.frame();
        let again = schemas::wire::decode_frame(&schemas::wire::encode_frame(&frame).0).unwrap();
        prop_assert_eq!(&frame, &again, "every value of the frame can be sent");
        let town = |_: &_| Some(flat());
        let mut copy = World::restore(&world.snapshot(), world.id(), 1, town).unwrap();
        prop_assert_eq!(copy.frame(), frame);
        run(&mut copy, 5);
        run(&mut world, 5);
        prop_assert_eq!(copy.state_hash(), world.state_hash());
    }
}
