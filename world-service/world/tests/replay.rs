//! Snapshots, forks and refusals: a world goes on bit for bit.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod any_command;
mod common;

use std::sync::LazyLock;

use any_command::command;
use common::*;
use proptest::prelude::*;
use schemas::{ActorId, Command, ErrorCode, VehicleControl, WorldId};
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
