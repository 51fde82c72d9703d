//! How people move: where they want, over kerbs, not through walls, and off their feet when hit.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{
    ActorId, BodyCommand, BodySwitch, Command, Proximity, Vec3, WalkerCommand, WalkerControl,
    WalkerStage, WorldId, level_pose,
};
use world::World;

fn walk(world: &mut World, actor: ActorId, direction: Vec3, speed_mps: f32) {
    let control = WalkerControl { direction, speed_mps, jump: false };
    world.apply(&Command::Walker(WalkerCommand::Control { actor, control })).unwrap();
}

fn leans(world: &World, actor: ActorId) -> f32 {
    1.0 - (state(world, actor).world_from_actor.rotation * Vec3::z()).z
}

#[test]
fn a_walker_goes_where_and_as_fast_as_it_is_told_and_turns_that_way() {
    let mut world = world();
    let walker = walker(&mut world, 0.0, 0.0);
    let start_m = position_m(&world, walker);
    walk(&mut world, walker, Vec3::new(0.6, 0.8, 0.0), 1.4);
    run(&mut world, 200);
    let way_m = position_m(&world, walker) - start_m;
    assert!((way_m - Vec3::new(8.4, 11.2, 0.0)).norm() < 0.3, "{way_m}");
    let heading = state(&world, walker).world_from_actor.rotation * Vec3::x();
    assert!((heading - Vec3::new(0.6, 0.8, 0.0)).norm() < 0.02, "{heading}");
    assert!((speed_mps(&world, walker) - 1.4).abs() < 0.02);
    walk(&mut world, walker, Vec3::zeros(), 0.0);
    run(&mut world, 60);
    let rest_m = position_m(&world, walker);
    run(&mut world, 100);
    assert_eq!(position_m(&world, walker), rest_m, "it stands");
}

#[test]
fn the_length_of_a_direction_counts() {
    for (direction, speed_mps, wanted_mps) in [
        (Vec3::new(0.3, 0.4, 0.0), 4.0, 2.0),
        (Vec3::new(2.0, 0.0, 0.0), 1.5, 3.0),
        (Vec3::new(0.0, 1.2, 0.5), 1.0, 1.2),
        (Vec3::new(1.0e6, 0.0, 0.0), 1.0, 12.0),
        (Vec3::new(1.0e19, 0.0, 0.0), 150.0, 12.0),
    ] {
        let mut world = world();
        let walker = walker(&mut world, 0.0, 0.0);
        walk(&mut world, walker, direction, speed_mps);
        run(&mut world, 100);
        let velocity_mps = state(&world, walker).linear_velocity_mps;
        let wanted_mps = direction.xy().cast::<f64>().normalize().cast::<f32>() * wanted_mps;
        let error_mps = (velocity_mps.xy() - wanted_mps).norm();
        assert!(error_mps < 0.05, "{direction} at {speed_mps}: {velocity_mps}");
    }
}

#[test]
fn the_walk_cycle_advances_with_the_way_and_stands_still_with_the_walker() {
    let mut world = world();
    let walker = walker(&mut world, 0.0, 0.0);
    run(&mut world, 10);
    assert_eq!(state(&world, walker).gait_rad, 0.0);
    walk(&mut world, walker, Vec3::x(), 1.4);
    let (mut turns, mut before) = (0, 0.0);
    for _ in 0..200 {
        run(&mut world, 1);
        let phase = state(&world, walker).gait_rad;
        assert!((0.0..std::f32::consts::TAU).contains(&phase));
        turns += u32::from(phase < before);
        before = phase;
    }
    assert!((8..=11).contains(&turns), "strides of about 1.5 m on 14 m: {turns}");
    assert_eq!(state(&world, walker).walker.speed_mps, 1.4);
}

#[test]
fn a_wall_stops_a_walker_on_its_feet() {
    let mut world = world();
    let walker = walker(&mut world, 595.0, 0.0);
    walk(&mut world, walker, Vec3::x(), 2.0);
    run(&mut world, 200);
    let place_m = position_m(&world, walker);
    assert!((598.5..599.4).contains(&place_m.x), "{place_m}");
    assert!(leans(&world, walker) < 1.0e-3);
}

#[test]
fn who_is_told_to_jump_jumps_until_told_otherwise() {
    let mut world = world();
    let walker = walker(&mut world, 0.0, 0.0);
    let floor_m = position_m(&world, walker).z;
    let mut heights_m = |jump: bool, ticks: usize| -> Vec<f32> {
        let control = WalkerControl { jump, ..WalkerControl::default() };
        world.apply(&Command::Walker(WalkerCommand::Control { actor: walker, control })).unwrap();
        let height_m = |_| {
            run(&mut world, 1);
            position_m(&world, walker).z - floor_m
        };
        (0..ticks).map(height_m).collect()
    };
    let jumping_m = heights_m(true, 100);
    let highest_m = jumping_m.iter().copied().fold(0.0, f32::max);
    assert!((1.2..1.3).contains(&highest_m), "5 m/s at take-off: {highest_m}");
    let rises = |height_m: &f32| *height_m > 0.6;
    let jumps = jumping_m.windows(2).filter(|pair| !rises(&pair[0]) && rises(&pair[1])).count();
    assert!((4..=5).contains(&jumps), "a second each: {jumps}");
    let standing_m = heights_m(false, 60);
    assert!(standing_m[30..].iter().all(|height_m| height_m.abs() < 0.02), "{standing_m:?}");
}

#[test]
fn a_car_knocks_a_walking_person_over_and_a_touch_does_not() {
    for (car_mps, falls) in [(10.0, true), (0.6, false)] {
        let mut world = world();
        car(&mut world, 0.0, car_mps);
        let walker = walker(&mut world, 3.5, 0.0);
        walk(&mut world, walker, Vec3::y(), 0.2);
        let hits = run(&mut world, 40);
        assert!(hits.iter().any(|hit| hit.other == Some(walker)), "no contact at {car_mps} m/s");
        assert_eq!(leans(&world, walker) > 0.3, falls, "at {car_mps} m/s");
    }
}

#[test]
fn a_walker_steered_from_outside_stands_on_the_ground_where_it_is_put() {
    for physics in [true, false] {
        let mut world = world();
        let walker = walker(&mut world, 0.0, 0.0);
        let off =
            |switch| Command::Body(BodyCommand::SetSwitch { actor: walker, switch, on: false });
        if !physics {
            world.apply(&off(BodySwitch::Physics)).unwrap();
            world.apply(&off(BodySwitch::Collisions)).unwrap();
        }
        for step in 0..40u8 {
            let at_m = Vec3::new(0.07 * f32::from(step), 3.0, 0.0);
            let world_from_actor = level_pose(at_m, 0.0);
            let place = Command::Walker(WalkerCommand::State {
                actor: walker,
                world_from_actor,
                speed_mps: 1.4,
            });
            world.apply(&place).unwrap();
            run(&mut world, 1);
        }
        let end = state(&world, walker);
        let place_m = end.world_from_actor.translation.vector;
        let slack_m = if physics { 0.1 } else { 1.0e-5 };
        assert!((place_m - Vec3::new(2.73, 3.0, 0.875)).norm() < slack_m, "{place_m}");
        assert!((end.linear_velocity_mps - Vec3::x() * 1.4).norm() < 0.05);
        assert!(end.gait_rad > 0.0);
    }
}

#[test]
fn children_are_shorter_than_adults() {
    let mut world = world();
    let pose = |y_m| level_pose(Vec3::new(0.0, y_m, 0.9), 0.0);
    let adult = spawn_at(&mut world, "walker.pedestrian.0001", pose(0.0), 0.0);
    let child = spawn_at(&mut world, "walker.pedestrian.0010", pose(2.0), 0.0);
    let height_m = |actor| 2.0 * state(&world, actor).box_half_extent_m.z;
    assert!(height_m(adult) > 1.6 && height_m(child) < 1.4);
}

/// Three metres over, a second there, and back.
fn over_and_back(world: &mut World, actor: ActorId, trigger: Option<Proximity>) -> Vec3 {
    let begin_m = position_m(world, actor);
    let stages = vec![
        WalkerStage { to_m: begin_m + Vec3::y() * 3.0, speed_mps: 1.5, wait_secs: 1.0 },
        WalkerStage { to_m: begin_m, speed_mps: 1.5, wait_secs: 0.0 },
    ];
    let follow = WalkerCommand::Trajectory { actor, stages, trigger };
    world.apply(&Command::Walker(follow)).unwrap();
    begin_m
}

#[test]
fn a_trajectory_is_walked_within_ticks_and_goes_on_bit_for_bit_in_a_restored_world() {
    let mut world = world();
    let walker = walker(&mut world, 0.0, 0.0);
    run(&mut world, 10);
    let standing = world.state_hash();
    let begin_m = over_and_back(&mut world, walker, None);
    assert_ne!(world.state_hash(), standing);
    let way_m = |world: &World| (position_m(world, walker) - begin_m).y;
    run(&mut world, 46);
    let other = WorldId::new(2).unwrap();
    let mut restored = World::restore(&world.snapshot(), other, 2, |_| Some(flat())).unwrap();
    let (mut most_m, mut stood) = (0.0_f32, 0);
    for _ in 0..100 {
        run(&mut world, 1);
        run(&mut restored, 1);
        assert_eq!(world.state_hash(), restored.state_hash());
        most_m = most_m.max(way_m(&world));
        stood += u32::from(way_m(&world) > 2.5 && speed_mps(&world, walker) < 0.01);
    }
    assert!((2.8..3.1).contains(&most_m) && (15..30).contains(&stood), "{most_m}, {stood}");
    assert!(way_m(&world).abs() < 0.2, "{}", way_m(&world));
}

#[test]
fn who_runs_slows_down_before_its_places_and_stops_there() {
    let mut world = world();
    let walker = walker(&mut world, 0.0, 0.0);
    let begin_m = position_m(&world, walker);
    let stage = |beside_m: f32, wait_secs: f32| WalkerStage {
        to_m: begin_m + Vec3::y() * beside_m,
        speed_mps: 5.0,
        wait_secs,
    };
    let (stages, trigger) = (vec![stage(12.0, 1.0), stage(0.0, 0.0)], None);
    let follow = WalkerCommand::Trajectory { actor: walker, stages, trigger };
    world.apply(&Command::Walker(follow)).unwrap();
    let mut ways_m = Vec::new();
    for _ in 0..180 {
        run(&mut world, 1);
        ways_m.push((position_m(&world, walker) - begin_m).y);
    }
    let fastest_mps = ways_m.windows(2).map(|way| (way[1] - way[0]) / 0.05).fold(0.0_f32, f32::max);
    let most_m = ways_m.iter().copied().fold(0.0, f32::max);
    let least_m = ways_m.iter().copied().fold(0.0, f32::min);
    assert!((4.9..5.1).contains(&fastest_mps), "{fastest_mps}");
    assert!((11.85..12.1).contains(&most_m) && least_m > -0.1, "{least_m}, {most_m}");
    let stood = ways_m.windows(2).filter(|way| way[0] > 11.85 && way[0] == way[1]).count();
    assert!((15..30).contains(&stood), "{stood} ticks of 0.05 s at its place");
    assert!(ways_m[179].abs() < 0.15 && ways_m[179] == ways_m[170], "{}", ways_m[179]);
}

#[test]
fn a_trajectory_begins_when_its_vehicle_is_near_and_another_control_ends_it() {
    let mut world = world();
    let (walker, car) = (walker(&mut world, 0.0, 3.0), car(&mut world, -40.0, 10.0));
    let begin_m = over_and_back(&mut world, walker, Some(Proximity { actor: car, within_m: 20.0 }));
    let way_m = |world: &World| (position_m(world, walker) - begin_m).y;
    let away_m = |world: &World| (position_m(world, walker) - position_m(world, car)).xy().norm();
    while away_m(&world) > 20.0 {
        assert!(way_m(&world).abs() < 0.01, "too early");
        run(&mut world, 1);
    }
    run(&mut world, 20);
    assert!(way_m(&world) > 0.7, "{}", way_m(&world));
    walk(&mut world, walker, Vec3::zeros(), 0.0);
    run(&mut world, 20);
    let rest_m = position_m(&world, walker);
    run(&mut world, 60);
    assert_eq!(position_m(&world, walker), rest_m, "it stands");
}

#[test]
fn trajectories_that_cannot_be_are_refused() {
    let mut world = world();
    let (walker, car) = (walker(&mut world, 0.0, 3.0), car(&mut world, -40.0, 0.0));
    let before = world.state_hash();
    let stage = WalkerStage { to_m: Vec3::y(), speed_mps: 1.0, wait_secs: 0.0 };
    let near = |actor| Some(Proximity { actor, within_m: 5.0 });
    for (actor, stages, trigger, words) in [
        (walker, Vec::new(), None, "number of stages"),
        (walker, vec![WalkerStage { speed_mps: f32::NAN, ..stage }], None, "speed"),
        (walker, vec![WalkerStage { wait_secs: -1.0, ..stage }], None, "wait"),
        (walker, vec![stage], near(ActorId::new(99).unwrap()), "no such actor"),
        (car, vec![stage], near(walker), "cannot walk"),
    ] {
        let follow = Command::Walker(WalkerCommand::Trajectory { actor, stages, trigger });
        let error = world.apply(&follow).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(world.state_hash(), before);
    }
}
