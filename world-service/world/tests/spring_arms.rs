//! Goal: what hangs on a spring arm follows its parent as in CARLA.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{ActorId, Attachment, AttachmentKind, Command, Pose, Vec3, level_pose};

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
fn a_spring_arm_follows_behind_and_looks_at_its_parent() {
    let mut world = world();
    let car = car(&mut world, 0.0, 10.0);
    let mount = level_pose(Vec3::new(-6.0, 0.0, 3.0), 0.0);
    let camera = attached("sensor.camera.rgb", mount, car, AttachmentKind::SpringArmGhost);
    let camera = world.apply(&camera).unwrap().unwrap();
    run(&mut world, 40);
    let behind_m = position_m(&world, car).x - position_m(&world, camera).x;
    assert!((5.99..6.01).contains(&behind_m), "{behind_m}");
    let (carrier, carried) = (state(&world, car), state(&world, camera));
    let to_car_m = position_m(&world, car) - position_m(&world, camera);
    let looks = carried.world_from_actor.rotation * Vec3::x();
    assert!((looks - to_car_m.normalize()).norm() < 1.0e-3, "{looks}");
    assert!((carried.linear_velocity_mps - carrier.linear_velocity_mps).norm() < 0.1);
}

#[test]
fn a_wall_draws_a_spring_arm_in_but_for_a_ghost() {
    // A wall stands at 600 m.
    for (kind, ahead_m) in
        [(AttachmentKind::SpringArm, 4.2..4.6), (AttachmentKind::SpringArmGhost, 7.9..8.1)]
    {
        let mut world = world();
        let car = car(&mut world, 595.0, 0.0);
        let mount = level_pose(Vec3::new(8.0, 0.0, 1.0), 0.0);
        let camera = world.apply(&attached("sensor.camera.rgb", mount, car, kind));
        let camera = camera.unwrap().unwrap();
        run(&mut world, 10);
        let found_m = position_m(&world, camera).x - position_m(&world, car).x;
        assert!(ahead_m.contains(&found_m), "{kind:?}: {found_m}");
    }
}

#[test]
fn a_spring_arm_keeps_the_room_of_a_ball_to_what_it_passes() {
    let mut world = world();
    let car = car(&mut world, 590.0, 0.0);
    // The arm itself passes 6 cm above the edge of the wall: 9.5 m ahead and 3 m high.
    let mount = level_pose(Vec3::new(12.0, 0.0, 3.486), 0.0);
    let camera = attached("sensor.camera.rgb", mount, car, AttachmentKind::SpringArm);
    let camera = world.apply(&camera).unwrap().unwrap();
    run(&mut world, 20);
    let ahead_m = position_m(&world, camera) - position_m(&world, car);
    assert!((9.3..9.5).contains(&ahead_m.x), "{ahead_m}");
    let to_edge_m = (Vec3::new(9.5, 0.0, 3.0) - ahead_m).xz().norm();
    assert!((to_edge_m - 0.12).abs() < 0.02, "{to_edge_m}");
}
