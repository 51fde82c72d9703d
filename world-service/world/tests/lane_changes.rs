//! How navigation agents change lanes among others.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, AgentStatus, Command, PilotMode, Vec3,
    VehicleCommand, level_pose,
};
use world::World;

/// Middle of the right one of the two lanes towards +x.
const RIGHT_Y_M: f32 = -5.25;

fn on_lane(world: &mut World, x_m: f32, y_m: f32, forward_mps: f32) -> ActorId {
    let pose = level_pose(Vec3::new(x_m, y_m, 0.0), 0.0);
    spawn_at(world, "vehicle.lincoln.mkz", pose, forward_mps)
}

/// Gives a car an agent on its way to a place.
fn drive(world: &mut World, actor: ActorId, options: AgentOptions, goal_m: Vec3) {
    world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route: false })).unwrap();
    world.apply(&Command::Agent(AgentCommand::SetRoute { actor, places_m: vec![goal_m] })).unwrap();
    world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
}

/// A car that keeps its lane and speed whatever is ahead of it.
fn reckless(world: &mut World, x_m: f32, y_m: f32, mps: f32) -> ActorId {
    let actor = on_lane(world, x_m, y_m, mps);
    let mode = PilotMode::KeepLane;
    world
        .apply(&Command::Vehicle(VehicleCommand::Pilot {
            actor,
            mode,
            target_speed_mps: Some(mps),
        }))
        .unwrap();
    actor
}

fn at(mps: f32) -> AgentOptions {
    AgentOptions { target_speed_mps: Some(mps), ..AgentOptions::default() }
}

fn status(world: &World, actor: ActorId) -> AgentStatus {
    world.frame().agents.iter().find(|agent| agent.actor == actor).unwrap().status
}

#[test]
fn a_change_waits_for_whoever_is_abreast_behind_or_ahead() {
    // Where somebody drives on the right lane, seen from the agent at 10 m/s, and how fast.
    for (from_m, mps) in [(0.0, 10.0), (3.0, 10.0), (-4.0, 10.5), (-25.0, 20.0), (12.0, 4.0)] {
        for (own_y_m, goal_y_m) in [(LANE_Y_M, RIGHT_Y_M), (RIGHT_Y_M, LANE_Y_M)] {
            let mut world = world();
            let own = on_lane(&mut world, -900.0, own_y_m, 10.0);
            let other = reckless(&mut world, -900.0 + from_m, goal_y_m, mps);
            drive(&mut world, own, at(10.0), Vec3::new(-400.0, goal_y_m, 0.0));
            let hits = run(&mut world, 60);
            assert!(hits.is_empty(), "{from_m} m, {mps} m/s: {hits:?}");
            let aside_m = (position_m(&world, own).y - own_y_m).abs();
            let gap_m = (position_m(&world, own).x - position_m(&world, other).x).abs();
            assert!(aside_m < 0.3 || gap_m > 10.0, "{from_m} m, {mps} m/s: {aside_m}, {gap_m} m");
            let hits = run(&mut world, 1_400);
            assert!(hits.is_empty(), "{from_m} m, {mps} m/s: {hits:?}");
            assert_eq!(status(&world, own), AgentStatus::Arrived, "{from_m} m, {mps} m/s");
        }
    }
}

#[test]
fn whoever_stays_abreast_up_to_the_goal_is_let_past() {
    let mut world = world();
    let own = on_lane(&mut world, -900.0, LANE_Y_M, 10.0);
    reckless(&mut world, -900.0, RIGHT_Y_M, 10.0);
    drive(&mut world, own, at(10.0), Vec3::new(-800.0, RIGHT_Y_M, 0.0));
    let hits = run(&mut world, 600);
    assert!(hits.is_empty(), "{hits:?}");
    assert_eq!(status(&world, own), AgentStatus::Arrived);
}

#[test]
fn a_change_that_nobody_hinders_begins_at_once() {
    let mut world = world();
    let own = on_lane(&mut world, -900.0, LANE_Y_M, 10.0);
    reckless(&mut world, -870.0, RIGHT_Y_M, 12.0);
    reckless(&mut world, -940.0, RIGHT_Y_M, 9.0);
    drive(&mut world, own, at(10.0), Vec3::new(-400.0, RIGHT_Y_M, 0.0));
    run(&mut world, 100);
    assert!((position_m(&world, own).y - RIGHT_Y_M).abs() < 0.3);
}

#[test]
fn along_a_row_of_standing_cars_it_waits_for_the_end_of_the_row_or_before_its_goal() {
    for (cars, arrives) in [(6u8, true), (14, false)] {
        let mut world = world();
        for index in 0..cars {
            let car = on_lane(&mut world, -890.0 + 7.5 * f32::from(index), RIGHT_Y_M, 0.0);
            brake(&mut world, car);
        }
        let own = on_lane(&mut world, -900.0, LANE_Y_M, 8.0);
        drive(&mut world, own, at(8.0), Vec3::new(-790.0, RIGHT_Y_M, 0.0));
        let hits = run(&mut world, 1_200);
        assert!(hits.is_empty(), "{cars} cars: {hits:?}");
        assert_eq!(status(&world, own) == AgentStatus::Arrived, arrives, "{cars} cars");
        let place_m = position_m(&world, own);
        if !arrives {
            assert!((place_m.y - LANE_Y_M).abs() < 0.3 && place_m.x < -790.0, "{place_m}");
            assert!(speed_mps(&world, own) < 0.05);
        }
    }
}

#[test]
fn who_is_pressed_by_somebody_faster_lets_him_pass_and_comes_back() {
    for (behaviour, passes) in [
        (AgentBehaviour::Cautious, true),
        (AgentBehaviour::Normal, true),
        (AgentBehaviour::Aggressive, false),
        (AgentBehaviour::Basic, false),
    ] {
        let mut world = world();
        let own = on_lane(&mut world, -900.0, LANE_Y_M, 8.0);
        let faster = reckless(&mut world, -918.0, LANE_Y_M, 9.5);
        let options = AgentOptions { behaviour, ..at(8.0) };
        drive(&mut world, own, options, Vec3::new(-400.0, LANE_Y_M, 0.0));
        let mut aside = false;
        let mut hits = Vec::new();
        for _ in 0..500 {
            hits.extend(run(&mut world, 1));
            aside |= (position_m(&world, own).y - RIGHT_Y_M).abs() < 0.5;
        }
        assert_eq!((aside, hits.is_empty()), (passes, passes), "{behaviour:?}: {hits:?}");
        if passes {
            assert!(position_m(&world, faster).x > position_m(&world, own).x);
            assert!((position_m(&world, own).y - LANE_Y_M).abs() < 0.3, "{behaviour:?}");
            run(&mut world, 1_200);
            assert_eq!(status(&world, own), AgentStatus::Arrived, "{behaviour:?}");
        }
    }
}

#[test]
fn nobody_makes_way_where_the_lane_beside_is_taken() {
    let mut world = world();
    let own = on_lane(&mut world, -900.0, LANE_Y_M, 8.0);
    reckless(&mut world, -901.0, RIGHT_Y_M, 8.0);
    reckless(&mut world, -925.0, LANE_Y_M, 8.2);
    let options = AgentOptions { behaviour: AgentBehaviour::Normal, ..at(8.0) };
    drive(&mut world, own, options, Vec3::new(-400.0, LANE_Y_M, 0.0));
    for _ in 0..600 {
        run(&mut world, 1);
        let aside_m = (position_m(&world, own).y - LANE_Y_M).abs();
        assert!(aside_m < 0.3, "{aside_m} m");
    }
}
