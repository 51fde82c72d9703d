//! Values that are no numbers, put where no command can put them.

use std::sync::{Arc, LazyLock};

use schemas::{BodyCommand, BodySwitch, Command, WorldId, level_pose, limits};

use super::*;
use crate::{Town, World, WorldConfig};

const ROAD: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="road" version="1" north="0" south="0" east="0" west="0"/>
  <road name="road" length="400" id="1" junction="-1">
    <planView><geometry s="0" x="-200" y="0" hdg="0" length="400"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="20" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;

fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> =
        LazyLock::new(|| Arc::new(Town::new(Arc::new(roads::Map::parse("road", ROAD).unwrap()))));
    Arc::clone(&TOWN)
}

/// A car under way, a car that touches it from behind, and a pedestrian under way; ids 1 to 3.
fn world() -> (World, [ActorId; 3]) {
    let id = WorldId::new(1).unwrap();
    let mut world =
        World::new(WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: town() }).unwrap();
    let mut spawn = |blueprint: &str, x_m: f32, y_m: f32, mps: f32| {
        let pose = level_pose(Vec3::new(x_m, y_m, 0.0), 0.0);
        let command = Command::spawn(blueprint, pose, Vec3::x() * mps);
        world.apply(&command).unwrap().unwrap()
    };
    let ids = [
        spawn("vehicle.audi.tt", 0.0, -5.0, 8.0),
        spawn("vehicle.tesla.model3", -30.0, -15.0, 12.0),
        spawn("walker.pedestrian.0001", 0.0, -10.0, 1.0),
    ];
    for _ in 0..4 {
        world.tick().unwrap();
    }
    (world, ids)
}

/// Ways to break an actor.
type Poison = fn(&mut State, usize);

fn handle(state: &State, index: usize) -> BodyHandle {
    state.actors[index].rigid().unwrap()
}

const POISONS: [(&str, Poison); 5] = [
    ("velocity", |state, index| {
        let nowhere = Vec3::new(0.0, f32::NAN, 0.0);
        state.physics.set_velocity(handle(state, index), nowhere, Vec3::zeros());
    }),
    ("spin", |state, index| {
        let wild = Vec3::new(f32::INFINITY, 0.0, 0.0);
        state.physics.set_velocity(handle(state, index), Vec3::zeros(), wild);
    }),
    ("speed", |state, index| {
        let wild = Vec3::new(0.0, 0.0, 1.0e20);
        state.physics.set_velocity(handle(state, index), wild, Vec3::zeros());
    }),
    ("force", |state, index| state.actors[index].outside.force_n.x = f32::NAN),
    ("wheels or legs", |state, index| {
        if let Some(vehicle) = state.actors[index].vehicle_mut() {
            vehicle.state.road_wheel_rad = f32::NAN;
        } else if let Some((_, walker)) = state.actors[index].walker_mut() {
            walker.gait_rad = f32::NAN;
        }
    }),
];

fn pose(world: &World, id: ActorId) -> Pose {
    world.frame().actor(id).unwrap().world_from_actor
}

#[test]
fn who_breaks_is_put_to_rest_where_it_was_and_nobody_else_notices() {
    for (what, poison) in POISONS {
        for broken in [0, 2] {
            // Balance gives a walker its spin, the air takes its speed: it is not broken.
            if broken == 2 && ["spin", "speed"].contains(&what) {
                continue;
            }
            let (mut world, ids) = world();
            let mut sound = world.fork(world.id());
            let last = pose(&world, ids[broken]);
            poison(&mut world.state, broken);
            for tick in 0..20 {
                world.tick().unwrap();
                sound.tick().unwrap();
                let frame = world.frame();
                let [halt] = frame.halted[..] else {
                    panic!("{what}, {broken}: {:?}", frame.halted)
                };
                assert_eq!((halt.actor, halt.tick), (ids[broken], Tick(5)), "{what}");
                for other in ids.iter().filter(|id| **id != ids[broken]) {
                    assert_eq!(frame.actor(*other), sound.frame().actor(*other), "{what} {tick}");
                }
            }
            assert!(
                (pose(&world, ids[broken]).translation.vector - last.translation.vector).norm()
                    < 0.5,
                "{what}"
            );
            let frame = world.frame();
            let restored = World::restore(&world.snapshot(), world.id(), 1, |_| Some(town()));
            assert_eq!(restored.unwrap().frame(), frame, "{what}");
        }
    }
}

#[test]
fn who_touches_the_broken_one_is_not_broken() {
    let (mut world, [first, second, _]) = world();
    let world_from_actor = level_pose(Vec3::new(-3.0, -5.0, 0.0), 0.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor: second,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
    let touching = |world: &World| {
        world.collisions().iter().any(|hit| (hit.actor, hit.other) == (first, Some(second)))
    };
    for _ in 0..40 {
        world.tick().unwrap();
        if touching(&world) {
            break;
        }
    }
    assert!(touching(&world));
    world.state.actors[0].outside.force_n = Vec3::new(f32::NAN, 1.0e30, 0.0);
    world.tick().unwrap();
    let frame = world.frame();
    let halted: Vec<ActorId> = frame.halted.iter().map(|halt| halt.actor).collect();
    assert_eq!(halted, [first]);
    assert!(frame.actor(second).unwrap().linear_velocity_mps.norm() < 15.0);
}

#[test]
fn who_was_put_to_rest_drives_on_when_a_client_wants_it() {
    let (mut world, [car, ..]) = world();
    world.state.actors[0].outside.force_n.x = f32::NAN;
    world.tick().unwrap();
    assert_eq!(world.frame().halted.len(), 1);
    let switch = BodySwitch::Physics;
    world.apply(&Command::Body(BodyCommand::SetSwitch { actor: car, switch, on: true })).unwrap();
    assert!(world.frame().halted.is_empty());
    let linear_mps = Some(Vec3::x() * 5.0);
    world
        .apply(&Command::Body(BodyCommand::SetVelocity {
            actor: car,
            linear_mps,
            angular_radps: None,
        }))
        .unwrap();
    let before = pose(&world, car);
    for _ in 0..20 {
        world.tick().unwrap();
    }
    let way_m = (pose(&world, car).translation.vector - before.translation.vector).norm();
    assert!(world.frame().halted.is_empty() && way_m > 3.0, "{way_m}");
}

#[test]
fn who_was_never_anywhere_is_removed() {
    let (mut world, [car, other, walker]) = world();
    let nowhere = Pose::translation(f32::NAN, 0.0, 0.0);
    world.state.physics.set_pose(handle(&world.state, 0), &nowhere);
    world.tick().unwrap();
    let frame = world.frame();
    assert!(frame.actor(car).is_none() && frame.halted.is_empty());
    assert!(frame.actor(other).is_some() && frame.actor(walker).is_some());
}

#[test]
fn whoever_leaves_the_coordinates_stops_at_their_edge() {
    let (mut world, [car, other, _]) = world();
    let edge_m = limits::COORDINATE_M_MAX;
    let world_from_actor = level_pose(Vec3::new(edge_m - 2.0, 0.0, 0.0), 0.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor: car,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
    let linear_mps = Some(Vec3::x() * 100.0);
    world
        .apply(&Command::Body(BodyCommand::SetVelocity {
            actor: car,
            linear_mps,
            angular_radps: None,
        }))
        .unwrap();
    for _ in 0..10 {
        world.tick().unwrap();
    }
    let frame = world.frame();
    assert_eq!(frame.halted[0].reason, HaltReason::TooFar);
    assert!(frame.actor(car).unwrap().world_from_actor.translation.x <= edge_m);
    assert!(frame.actor(other).unwrap().linear_velocity_mps.x > 5.0);
}
