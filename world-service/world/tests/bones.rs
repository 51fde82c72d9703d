//! Walkers whose bones somebody posed: what rays meet, and what a world keeps and refuses.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::f32::consts::FRAC_PI_2;

use common::*;
use schemas::{
    ActorId, BodyCommand, BonePose, BonesChange, Command, Error, ErrorCode, Pose, RayHit,
    UnitQuaternion, Vec3, WalkerCommand, WorldId, level_pose, limits, skeleton,
};
use world::World;

fn change(world: &mut World, actor: ActorId, change: BonesChange) -> Result<(), Error> {
    world.apply(&Command::Walker(WalkerCommand::Bones { actor, change })).map(drop)
}

/// The right arm straight out to the side.
fn arm_aside() -> BonePose {
    let turn = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -FRAC_PI_2);
    BonePose {
        bone: skeleton::number_of("crl_arm__R").unwrap(),
        parent_from_bone: Pose::from_parts(Vec3::new(0.0, -0.16, 0.0).into(), turn),
    }
}

fn raised(share: f32) -> BonesChange {
    BonesChange { afresh: false, bones: vec![arm_aside()], share: Some(share) }
}

/// A world with somebody who raises an arm.
fn waving() -> (World, ActorId) {
    let mut world = world();
    let walker = walker(&mut world, 20.0, 0.0);
    run(&mut world, 5);
    change(&mut world, walker, raised(1.0)).unwrap();
    (world, walker)
}

/// What a ray meets that goes to where the right hand is when the arm is out.
fn hit_at_hand(world: &World, walker: ActorId) -> Option<RayHit> {
    let place = state(world, walker).world_from_actor;
    let hand_m = place.transform_point(&Vec3::new(0.0, -0.65, 0.55).into()).coords;
    let from_m = hand_m + place.rotation * Vec3::x() * 3.0;
    let hit = world.project_point(from_m, hand_m - from_m, 4.0).unwrap();
    hit.filter(|hit| hit.actor == Some(walker))
}

#[test]
fn rays_meet_an_arm_where_it_is_as_far_as_its_pose_shows() {
    let mut world = world();
    let walker = walker(&mut world, 20.0, 0.0);
    run(&mut world, 5);
    let share = |share| BonesChange { share: Some(share), ..BonesChange::default() };
    change(&mut world, walker, raised(0.0)).unwrap();
    assert_eq!(hit_at_hand(&world, walker), None, "nothing of the pose shows");
    change(&mut world, walker, share(1.0)).unwrap();
    let hit = hit_at_hand(&world, walker).expect("the arm is out");
    assert_eq!(hit.tag, 12, "a pedestrian");
    change(&mut world, walker, share(0.5)).unwrap();
    assert_eq!(hit_at_hand(&world, walker), None, "the arm is half way");
    change(&mut world, walker, share(1.0)).unwrap();
    run(&mut world, 3);
    assert!(hit_at_hand(&world, walker).is_some(), "it stays out");
    change(&mut world, walker, BonesChange::none()).unwrap();
    assert_eq!(hit_at_hand(&world, walker), None, "the arm hangs again");
}

#[test]
fn a_pose_is_in_frames_snapshots_forks_and_hashes() {
    let (mut world, walker) = waving();
    let poses = world.frame().walker_poses;
    assert_eq!((poses.len(), poses[0].walker, poses[0].share), (1, walker, 1.0));
    assert_eq!(poses[0].bones, [arm_aside()]);
    let id = WorldId::new(2).unwrap();
    let fork = world.fork(id);
    let restored = World::restore(&world.snapshot(), id, 1, |_| Some(flat())).unwrap();
    for mut copy in [fork, restored] {
        assert_eq!(copy.state_hash(), world.state_hash());
        assert_eq!(copy.frame().walker_poses, poses);
        assert!(hit_at_hand(&copy, walker).is_some());
        run(&mut copy, 3);
        assert_eq!(copy.frame().walker_poses, poses);
    }
    let mut other = world.fork(id);
    change(&mut other, walker, raised(0.99)).unwrap();
    assert_ne!(other.state_hash(), world.state_hash());
    let before = {
        change(&mut other, walker, BonesChange::none()).unwrap();
        other.state_hash()
    };
    change(&mut world, walker, BonesChange::none()).unwrap();
    assert_eq!((world.state_hash(), world.frame().walker_poses), (before, Vec::new()));
}

#[test]
fn a_pose_goes_with_its_walker() {
    let (mut world, walker) = waving();
    world.apply(&Command::DestroyActor { actor: walker }).unwrap();
    assert!(world.frame().walker_poses.is_empty());
    World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
}

#[test]
fn a_pose_stays_with_a_walker_that_is_put_elsewhere() {
    let (mut world, walker) = waving();
    let reference_from_actor = level_pose(Vec3::new(-30.0, LANE_Y_M, 0.9), 0.3);
    let put = BodyCommand::SetPose { actor: walker, reference_from_actor };
    world.apply(&Command::Body(put)).unwrap();
    run(&mut world, 1);
    assert!(hit_at_hand(&world, walker).is_some());
}

#[test]
fn poses_that_nothing_can_have_are_refused_and_change_nothing() {
    let (mut world, walker) = waving();
    let car = car(&mut world, 0.0, 0.0);
    let (before, arm) = (world.state_hash(), arm_aside());
    let with = |spoil: &dyn Fn(&mut BonePose)| {
        let mut bone = arm;
        spoil(&mut bone);
        BonesChange { bones: vec![arm, bone], ..raised(0.5) }
    };
    let mut bad = vec![
        with(&|bone| bone.bone = skeleton::BONES as u8),
        BonesChange { bones: vec![arm; skeleton::BONES + 1], ..raised(0.5) },
    ];
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0e9] {
        bad.push(with(&|bone| bone.parent_from_bone.translation.y = number));
        bad.push(with(&|bone| {
            let mut turn = bone.parent_from_bone.rotation.into_inner();
            turn.coords.x = number;
            bone.parent_from_bone.rotation = UnitQuaternion::new_unchecked(turn);
        }));
        bad.push(raised(number));
    }
    bad.extend([raised(-0.01), raised(1.01)]);
    for bad in bad {
        let error = change(&mut world, walker, bad.clone()).unwrap_err();
        assert_eq!(error.code, ErrorCode::InvalidArgument, "{bad:?}: {error}");
    }
    let error = change(&mut world, car, raised(1.0)).unwrap_err();
    assert_eq!(error.code, ErrorCode::InvalidArgument);
    let error = change(&mut world, ActorId::new(99).unwrap(), raised(1.0)).unwrap_err();
    assert_eq!(error.code, ErrorCode::UnknownActor);
    assert_eq!(world.state_hash(), before);
}

#[test]
fn so_many_walkers_of_a_world_are_posed_and_no_more() {
    let mut world = world();
    let walkers: Vec<ActorId> = (0..=limits::POSED_WALKERS_MAX)
        .map(|at| walker(&mut world, -800.0 + 1.5 * at as f32 / 2.0, 1.5 * (at % 2) as f32))
        .collect();
    let (last, first) = walkers.split_last().unwrap();
    for walker in first {
        change(&mut world, *walker, raised(1.0)).unwrap();
    }
    let error = change(&mut world, *last, raised(1.0)).unwrap_err();
    assert_eq!(error.code, ErrorCode::Capacity);
    change(&mut world, first[7], BonesChange::none()).unwrap();
    change(&mut world, *last, raised(1.0)).unwrap();
    assert_eq!(world.frame().walker_poses.len(), limits::POSED_WALKERS_MAX);
    World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
}
