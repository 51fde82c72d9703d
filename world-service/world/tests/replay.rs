//! Snapshots, forks and refusals: a world goes on bit for bit.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::sync::LazyLock;

use common::*;
use proptest::prelude::*;
use schemas::{
    ActorId, Attachment, AttachmentKind, Attribute, BodySwitch, Command, ErrorCode, PilotMode,
    PushKind, Vec3, VehicleControl, WalkerControl, Weather, WorldId, level_pose,
};
use world::World;

fn other_id() -> WorldId {
    WorldId::new(99).unwrap()
}

fn restored(world: &World) -> World {
    World::restore(&world.snapshot(), other_id(), 5, |_| Some(flat())).unwrap()
}

/// Compares everything a frame shows but the world's identity, and all bits of the state.
fn assert_same(a: &World, b: &World) {
    assert_eq!(a.state_hash(), b.state_hash(), "at {}", a.tick_number());
    let (mut left, right) = (a.frame(), b.frame());
    (left.world, left.epoch) = (right.world, right.epoch);
    assert_eq!(left, right);
    assert_eq!(a.snapshot(), b.snapshot(), "hidden state at {}", a.tick_number());
}

/// A car that hits people, another car and a wall within some seconds.
fn crash() -> World {
    let mut world = world();
    let rear = car(&mut world, 540.0, 22.0);
    for beside_m in [-0.8, 0.0, 0.8] {
        walker(&mut world, 555.0, beside_m);
    }
    car(&mut world, 575.0, 3.0);
    control(&mut world, rear, VehicleControl { throttle: 0.8, steer: 0.02, ..Default::default() });
    world
}

#[test]
fn restored_at_every_tick_of_a_crash_a_world_goes_on_bit_for_bit() {
    let mut world = crash();
    let mut copies: Vec<World> = Vec::new();
    for _ in 0..160 {
        copies.push(restored(&world));
        copies.push(world.fork(other_id()));
        world.tick().unwrap();
        for copy in &mut copies {
            copy.tick().unwrap();
        }
        // The oldest copies have run longest; all are compared every few ticks.
        if world.tick_number().0.is_multiple_of(20) {
            for copy in &copies {
                assert_same(&world, copy);
            }
        } else {
            for copy in &copies {
                assert_eq!(copy.state_hash(), world.state_hash(), "at {}", world.tick_number());
            }
        }
    }
}

#[test]
fn equal_seeds_and_commands_give_equal_worlds_and_other_seeds_do_not() {
    let (mut a, mut b) = (crash(), crash());
    for _ in 0..100 {
        a.tick().unwrap();
        b.tick().unwrap();
    }
    assert_same(&a, &b);
}

#[test]
fn a_fork_and_its_parent_do_not_influence_each_other() {
    let mut parent = crash();
    run(&mut parent, 10);
    let mut fork = parent.fork(other_id());
    let mut lone = restored(&parent);
    let first = ActorId::new(1).unwrap();
    brake(&mut fork, first);
    run(&mut fork, 30);
    run(&mut parent, 30);
    run(&mut lone, 30);
    assert_same(&parent, &lone);
    assert_ne!(parent.state_hash(), fork.state_hash());
}

#[test]
fn a_snapshot_of_another_version_or_with_a_flipped_bit_is_refused() {
    let bytes = crash().snapshot();
    for at in [0, 3, 4, 9, 16, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        let refusal = World::restore(&damaged, other_id(), 1, |_| Some(flat())).err().unwrap();
        assert_eq!(refusal.code, ErrorCode::InvalidMessage, "{refusal}");
    }
    let short = World::restore(&bytes[..bytes.len() - 1], other_id(), 1, |_| Some(flat()));
    assert_eq!(short.err().unwrap().code, ErrorCode::InvalidMessage);
}

#[test]
fn a_snapshot_of_a_map_that_is_not_here_is_refused() {
    let bytes = crash().snapshot();
    let missing = World::restore(&bytes, other_id(), 1, |_| None).err().unwrap();
    assert_eq!(missing.code, ErrorCode::UnknownMap);
    let wrong = World::restore(&bytes, other_id(), 1, |_| Some(slope_of_ten_percent()));
    assert_eq!(wrong.err().unwrap().code, ErrorCode::UnknownMap);
}

#[test]
fn ids_start_at_one_and_are_never_reused() {
    let mut world = world();
    let first = car(&mut world, 0.0, 0.0);
    let second = car(&mut world, 20.0, 0.0);
    world.apply(&Command::DestroyActor { actor: second }).unwrap();
    let mut world = restored(&world);
    let third = car(&mut world, 20.0, 0.0);
    assert_eq!([first, second, third].map(ActorId::get), [1, 2, 3]);
    let gone = world.apply(&Command::DestroyActor { actor: second }).unwrap_err();
    assert_eq!(gone.code, ErrorCode::UnknownActor);
}

fn any_actor() -> impl Strategy<Value = ActorId> + Clone {
    (1u32..8).prop_map(|id| ActorId::new(id).unwrap())
}

/// A vector that is mostly within `size`, and sometimes not one.
fn any_vector(size: f32) -> impl Strategy<Value = Vec3> + Clone {
    let part = prop_oneof![12 => -1.0f32..1.0, 4 => Just(0.0), 1 => Just(f32::NAN)];
    [part.clone(), part.clone(), part].prop_map(move |parts| Vec3::from(parts) * size)
}

/// Sensors and props, alone or on another actor, with good and bad attributes.
fn any_thing() -> impl Strategy<Value = Command> {
    let blueprint = prop_oneof![
        Just("sensor.other.imu"),
        Just("static.prop.constructioncone"),
        Just("spectator"),
        Just("vehicle.audi.tt"),
    ];
    let kind = prop_oneof![
        Just(AttachmentKind::Rigid),
        Just(AttachmentKind::SpringArm),
        Just(AttachmentKind::SpringArmGhost)
    ];
    let attachment = prop::option::of((any_actor(), kind));
    let colour = prop::option::of(prop_oneof![Just("1,2,3"), Just("blue")]);
    (blueprint, attachment, colour, 0.0f32..30.0, -6.0f32..6.0).prop_map(
        |(blueprint, attachment, colour, x_m, y_m)| Command::SpawnActor {
            blueprint: blueprint.to_owned(),
            world_from_actor: level_pose(Vec3::new(x_m, y_m, 0.4), 0.3),
            linear_velocity_mps: Vec3::zeros(),
            attributes: colour
                .map(|value| Attribute { id: "color".to_owned(), value: value.to_owned() })
                .into_iter()
                .collect(),
            attachment: attachment.map(|(parent, kind)| Attachment { parent, kind }),
        },
    )
}

/// What is done to bodies and walkers from outside.
fn any_handling() -> impl Strategy<Value = Command> {
    let kind = prop_oneof![
        Just(PushKind::Impulse),
        Just(PushKind::Force),
        Just(PushKind::AngularImpulse),
        Just(PushKind::Torque)
    ];
    let switch = prop_oneof![
        Just(BodySwitch::Physics),
        Just(BodySwitch::Gravity),
        Just(BodySwitch::Collisions)
    ];
    let walk = (any_actor(), any_vector(1.0), 0.0f32..4.0, any::<bool>()).prop_map(
        |(actor, direction, speed_mps, jump)| Command::SetWalkerControl {
            actor,
            control: WalkerControl { direction, speed_mps, jump },
        },
    );
    let place = (any_actor(), 0.0f32..30.0, -6.0f32..6.0, -1.0f32..3.0).prop_map(
        |(actor, x_m, y_m, speed_mps)| Command::SetWalkerState {
            actor,
            world_from_actor: level_pose(Vec3::new(x_m, y_m, 0.9), 2.0),
            speed_mps,
        },
    );
    prop_oneof![
        3 => walk,
        1 => place,
        2 => (any_actor(), prop::option::of(any_vector(12.0)))
            .prop_map(|(actor, velocity_mps)| Command::SetConstantVelocity { actor, velocity_mps }),
        2 => (any_actor(), kind, any_vector(9_000.0))
            .prop_map(|(actor, kind, amount)| Command::Push { actor, kind, amount }),
        3 => (any_actor(), switch, any::<bool>())
            .prop_map(|(actor, switch, on)| Command::SetSwitch { actor, switch, on }),
        1 => (any_actor(), any::<u8>(), any::<bool>())
            .prop_map(|(actor, doors, open)| Command::SetDoors { actor, doors, open }),
        1 => (any_actor(), any::<u32>())
            .prop_map(|(actor, lights)| Command::SetVehicleLights { actor, lights }),
        1 => (0.0005f64..0.12, prop::option::of(0.0f64..0.05), prop::option::of(0u32..40)).prop_map(
            |(dt_secs, substep_secs_max, substeps_max)| Command::SetTimeStep {
                dt_secs,
                substep_secs_max,
                substeps_max,
            },
        ),
    ]
}

fn any_pilot() -> impl Strategy<Value = Command> {
    let mode = prop_oneof![
        Just(PilotMode::KeepLane),
        Just(PilotMode::ChangeLaneLeft),
        Just(PilotMode::ChangeLaneRight)
    ];
    (any_actor(), mode, prop::option::of(-2.0f32..20.0)).prop_map(
        |(actor, mode, target_speed_mps)| Command::SetPilot { actor, mode, target_speed_mps },
    )
}

/// Any command, good or bad.
fn command() -> impl Strategy<Value = Command> {
    let actor = any_actor();
    let number = prop_oneof![8 => -1.2f32..1.2, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)];
    let blueprint = prop_oneof![
        3 => Just("vehicle.lincoln.mkz"),
        1 => Just("vehicle.audi.tt"),
        3 => Just("walker.pedestrian.0007"),
        1 => Just("vehicle.unknown"),
    ];
    let spawn = (blueprint, 0.0f32..40.0, -9.0f32..6.0, -3.2f32..3.2, -5.0f32..25.0).prop_map(
        |(blueprint, x_m, y_m, yaw_rad, forward_mps)| {
            let pose = level_pose(Vec3::new(x_m, y_m, 0.5), yaw_rad);
            Command::spawn(blueprint, pose, pose.rotation * Vec3::new(forward_mps, 0.0, 0.0))
        },
    );
    let drive = (actor.clone(), number.clone(), number.clone(), any::<bool>(), any::<bool>())
        .prop_map(|(actor, steer, pedal, hand_brake, reverse)| Command::SetControl {
            actor,
            control: VehicleControl {
                throttle: pedal.max(0.0),
                steer,
                brake: (-pedal).max(0.0),
                hand_brake,
                reverse,
                ..VehicleControl::default()
            },
        });
    let velocity = (actor.clone(), number.clone(), number).prop_map(|(actor, x, z)| {
        let linear_mps = Vec3::new(20.0 * x, 0.0, 3.0 * z);
        Command::SetVelocity {
            actor,
            linear_mps: Some(linear_mps),
            angular_radps: Some(Vec3::zeros()),
        }
    });
    let pose = (actor.clone(), 0.0f32..40.0, -9.0f32..6.0, 0.0f32..3.0).prop_map(
        |(actor, x_m, y_m, z_m)| Command::SetPose {
            actor,
            world_from_actor: level_pose(Vec3::new(x_m, y_m, z_m), 1.0),
        },
    );
    let weather = (-10.0f32..110.0).prop_map(|wetness_percent| Command::SetWeather {
        weather: Weather { wetness_percent, ..Weather::CLEAR_NOON },
    });
    prop_oneof![
        4 => spawn,
        2 => any_thing(),
        6 => any_handling(),
        4 => drive,
        2 => any_pilot(),
        1 => velocity,
        1 => pose,
        1 => weather,
        1 => actor.prop_map(|actor| Command::DestroyActor { actor }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn through_any_commands_restored_and_forked_worlds_go_on_bit_for_bit(
        before in prop::collection::vec((command(), 0usize..6), 1..24),
        after in prop::collection::vec((command(), 0usize..6), 1..12),
    ) {
        let mut world = world();
        for (command, ticks) in &before {
            let _ = world.apply(command);
            run(&mut world, *ticks);
        }
        let mut copies = [restored(&world), world.fork(other_id())];
        for (command, ticks) in &after {
            let reply = world.apply(command);
            run(&mut world, *ticks);
            for copy in &mut copies {
                prop_assert_eq!(&copy.apply(command), &reply);
                run(copy, *ticks);
                assert_same(&world, copy);
            }
        }
    }

    #[test]
    fn a_refused_command_changes_nothing(
        commands in prop::collection::vec((command(), 0usize..3), 1..24),
    ) {
        let mut world = world();
        for (command, ticks) in &commands {
            let (hash, bytes) = (world.state_hash(), world.snapshot());
            if world.apply(command).is_err() {
                prop_assert_eq!(world.state_hash(), hash);
                prop_assert_eq!(world.snapshot(), bytes);
            }
            run(&mut world, *ticks);
        }
    }

    #[test]
    fn damage_with_a_fitting_checksum_is_never_a_panic(
        at in any::<prop::sample::Index>(),
        bytes in prop::collection::vec(any::<u8>(), 1..16),
    ) {
        static CRASH: LazyLock<Vec<u8>> = LazyLock::new(|| {
            let mut world = crash();
            run(&mut world, 20);
            world.snapshot()
        });
        let mut damaged = CRASH.clone();
        let at = 16 + at.index(damaged.len() - 16);
        for (slot, byte) in damaged[at..].iter_mut().zip(&bytes) {
            *slot = *byte;
        }
        let checksum = xxhash_rust::xxh3::xxh3_64(&damaged[16..]);
        damaged[8..16].copy_from_slice(&checksum.to_le_bytes());
        let _ = World::restore(&damaged, other_id(), 1, |_| Some(flat()));
    }

    #[test]
    fn random_bytes_are_never_a_world_and_never_a_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        cut in any::<prop::sample::Index>(),
    ) {
        prop_assert!(World::restore(&bytes, other_id(), 1, |_| Some(flat())).is_err());
        let mut headed = crash().snapshot();
        let at = cut.index(headed.len());
        headed.truncate(at);
        headed.extend_from_slice(&bytes);
        prop_assert!(World::restore(&headed, other_id(), 1, |_| Some(flat())).is_err());
    }
}
