//! Walkers whose bones somebody posed.

use nalgebra::Point3;
use schemas::{
    ActorId, ActorKind, ActorState, BonePose, BonesChange, Command, Pose, SemanticLidarPoint,
    SplitMix64, UnitQuaternion, Vec3, WalkerCommand, WalkerPose, level_pose, skeleton,
};
use world::World;

use super::{
    FOV_RAD, NEAR_M, SHARE_MIN, SIDE_PX, assert_within_bounds, camera_at, camera_in, check,
    compare, draw, moving, points_at, renderer, spawn_lidar, world,
};

/// Somebody in the middle of the lane, at rest.
fn standing(blueprint: &str) -> (World, ActorId) {
    let mut world = world();
    let pose = level_pose(Vec3::new(0.0, -3.0, 0.95), 0.6);
    let actor = world.apply(&Command::spawn(blueprint, pose, Vec3::zeros())).unwrap().unwrap();
    (0..10).for_each(|_| world.tick().unwrap());
    (world, actor)
}

/// Arms and a leg where no walk has them, the head turned.
fn strike_a_pose(world: &mut World, actor: ActorId, share: f32) {
    let height_m = 2.0 * world.actor(actor).unwrap().box_half_extent_m.z;
    let posed = |bone: &str, at: [f32; 3], turn_rad: [f32; 3]| BonePose {
        bone: skeleton::number_of(bone).unwrap(),
        parent_from_bone: Pose::new(Vec3::from(at) * height_m, Vec3::from(turn_rad)),
    };
    let bones = vec![
        posed("crl_arm__L", [0.0, 0.095, 0.0], [1.4, 0.0, 0.3]),
        posed("crl_foreArm__L", [0.0, 0.0, -0.165], [1.2, -0.4, 0.0]),
        posed("crl_arm__R", [0.0, -0.095, 0.0], [-2.6, 0.5, 0.0]),
        posed("crl_thigh__R", [0.0, -0.048, -0.03], [-0.6, -1.1, 0.0]),
        posed("crl_leg__R", [0.0, 0.0, -0.25], [0.0, 1.3, 0.0]),
        posed("crl_spine__C", [0.0, 0.0, 0.08], [0.1, 0.35, -0.2]),
        posed("crl_Head__C", [0.0, 0.0, 0.05], [0.0, -0.2, 0.9]),
    ];
    let change = BonesChange { afresh: true, bones, share: Some(share) };
    world.apply(&Command::Walker(WalkerCommand::Bones { actor, change })).unwrap();
}

/// In a copy of the world nobody is posed: the picture there is another one.
#[test]
fn rays_meet_posed_people_where_pictures_show_them() {
    let mut renderer = renderer();
    for (blueprint, share) in [("walker.pedestrian.0001", 1.0), ("walker.pedestrian.0048", 0.6)] {
        let class = blueprints::find(blueprint).unwrap().class;
        let (mut world, actor) = moving(blueprint, class);
        let walking = world.fork(world.id());
        strike_a_pose(&mut world, actor, share);
        world.tick().unwrap();
        println!("{blueprint}: {:?}", check(&mut renderer, blueprint, &world, actor));
        let camera = camera_at(&walking.actor(actor).unwrap(), 3.6, 0.35);
        let [posed, walked] =
            [&world, &walking].map(|world| compare(&mut renderer, world, actor, &camera).at_it);
        assert!(posed > walked, "arms that are out take more of a picture: {posed} {walked}");
    }
}

/// Every bone turned as by chance, and pulled out of its joint; with all that people wear.
#[test]
fn nothing_of_a_posed_walker_is_outside_of_its_bounds() {
    let mut chance = SplitMix64::new(11);
    let mut number = |size: f32| size * ((chance.next_u64() >> 40) as f32 / (1 << 23) as f32 - 1.0);
    for id in 1..200 {
        let id = ActorId::new(id).unwrap();
        let half_m = Vec3::new(0.19, 0.19, 0.5 + 0.5 * number(1.0).abs());
        let state = ActorState {
            box_half_extent_m: half_m,
            ..ActorState::at_rest(id, ActorKind::Walker, 0, Pose::identity())
        };
        let bones = (0..skeleton::BONES as u8).map(|bone| BonePose {
            bone,
            parent_from_bone: Pose::new(
                Vec3::from([0.3; 3].map(&mut number)),
                Vec3::from([3.1; 3].map(&mut number)),
            ),
        });
        let pose = WalkerPose { walker: id, share: 1.0, bones: bones.collect() };
        let limbs = skeleton::limbs(&state, Some(&pose));
        assert_within_bounds(&state, "walker.pedestrian.0001", &limbs);
    }
}

#[test]
fn points_of_lidars_are_on_an_arm_where_pictures_show_it() {
    let (mut world, actor) = standing("walker.pedestrian.0001");
    let posed_m = world.actor(actor).unwrap().world_from_actor;
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.1, std::f32::consts::PI + 0.6);
    let eye_m = posed_m.translation.vector - turn * Vec3::x() * 3.0;
    let pose = Pose::from_parts(eye_m.into(), turn);
    spawn_lidar(&mut world, pose);
    // Out to the side, where no walk has it.
    let is_aside = |point: &&SemanticLidarPoint| {
        let at_m = posed_m.inverse() * pose * Point3::from(point.position_m);
        at_m.y.abs() > 0.35
    };
    let aside = |world: &World| {
        points_at(world, actor).filter(is_aside).cloned().collect::<Vec<SemanticLidarPoint>>()
    };
    let two_ticks = |world: &mut World| (0..2).for_each(|_| world.tick().unwrap());
    two_ticks(&mut world);
    assert!(aside(&world).is_empty(), "the arms hang down");
    strike_a_pose(&mut world, actor, 1.0);
    two_ticks(&mut world);
    let points = aside(&world);
    assert!(points.len() > 20, "only {} points on the arm", points.len());
    let (depth_m, labels) = draw(&mut renderer(), world.frame(), &camera_in(pose));
    let half = (FOV_RAD / 2.0).tan();
    let place_of = |across: f32| ((1.0 - across / half) / 2.0 * SIDE_PX as f32) as usize;
    let is_drawn = |point: &&SemanticLidarPoint| {
        let [x, y, z] = point.position_m;
        let at = place_of(z / x) * SIDE_PX as usize + place_of(y / x);
        labels[at].id == actor.get() && (depth_m[at] - x).abs() <= NEAR_M
    };
    let drawn = points.iter().filter(is_drawn).count();
    assert!(drawn as f32 >= SHARE_MIN * points.len() as f32, "{drawn} of {}", points.len());
}
