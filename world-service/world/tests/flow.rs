//! Traffic of the world's own, and walkers that find their own way.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::sync::{Arc, LazyLock};

use common::*;
use schemas::{
    ActorId, ActorKind, AgentBehaviour, BodyCommand, Command, ErrorCode, TrafficCommand, Vec3,
    VehicleCommand, VehicleControl, WorldId, level_pose,
};
use world::{Town, World, WorldConfig};

/// Where the straight road ends.
const END_M: f32 = 1_000.0;

fn roads(name: &str) -> Arc<roads::Map> {
    let text = roads::town::build(name).unwrap();
    Arc::new(roads::Map::parse(name, &text).unwrap())
}

fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| Arc::new(Town::new(roads("Town02_Opt"))));
    Arc::clone(&TOWN)
}

fn world_in(map: Arc<Town>) -> World {
    let id = WorldId::new(1).unwrap();
    World::with_traffic(WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map }).unwrap()
}

fn vehicles(world: &World) -> Vec<(ActorId, Vec3, f32)> {
    let frame = world.frame();
    let vehicles = frame.actors.iter().filter(|actor| actor.kind == ActorKind::Vehicle);
    vehicles
        .map(|actor| {
            let place_m = actor.world_from_actor.translation.vector;
            (actor.id, place_m, actor.linear_velocity_mps.norm())
        })
        .collect()
}

/// Mean speed of each of `minutes` minutes of traffic, in which nothing touches anything.
fn mean_speeds(map: &str, count: u32, minutes: u32) -> Vec<f32> {
    let mut world = world_in(Arc::new(Town::new(roads(map))));
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count, behaviour: None })).unwrap();
    assert_eq!(vehicles(&world).len(), count as usize);
    let mut means_mps = Vec::new();
    for minute in 0..minutes {
        let mut sum_mps = 0.0;
        for second in 0..60 {
            let hits = run(&mut world, 20);
            assert!(hits.is_empty(), "{map}, minute {minute}, second {second}: {hits:?}");
            sum_mps += vehicles(&world).iter().map(|(_, _, mps)| mps).sum::<f32>();
        }
        means_mps.push(sum_mps / (60 * count) as f32);
    }
    means_mps
}

/// Later traffic is nearly as fast as early traffic: no queue grows for ever.
fn keeps_flowing(map: &str, least_mps: f32) {
    let means_mps = mean_speeds(map, 60, 10);
    let mean = |minutes: &[f32]| minutes.iter().sum::<f32>() / minutes.len() as f32;
    let (early_mps, late_mps) = (mean(&means_mps[..3]), mean(&means_mps[7..]));
    assert!(late_mps > 0.85 * early_mps, "{map}: {means_mps:?}");
    assert!(late_mps > least_mps, "{map}: {means_mps:?}");
}

#[test]
fn traffic_keeps_flowing_where_every_junction_has_one_lane() {
    keeps_flowing("Town01_Opt", 3.0);
}

#[test]
fn traffic_keeps_flowing_around_a_roundabout() {
    keeps_flowing("Town03_Opt", 4.0);
}

#[test]
fn traffic_keeps_flowing_on_motorways() {
    let means_mps = mean_speeds("Town04_Opt", 60, 3);
    assert!(means_mps.iter().all(|mps| *mps > 10.0), "{means_mps:?}");
}

#[test]
fn traffic_stops_for_a_car_and_a_person_in_its_way() {
    for person in [false, true] {
        let mut world = world();
        let own = car(&mut world, -900.0, 10.0);
        if person {
            walker(&mut world, -750.0, 0.0);
        } else {
            let other = car(&mut world, -750.0, 0.0);
            brake(&mut world, other);
        }
        // No other lane to change to: one more stands on it.
        let beside = Vec3::new(-760.0, -5.25, 0.0);
        let beside =
            spawn_at(&mut world, "vehicle.lincoln.mkz", schemas::level_pose(beside, 0.0), 0.0);
        brake(&mut world, beside);
        let behaviour = AgentBehaviour::Normal;
        world.apply(&Command::Traffic(TrafficCommand::Join { actor: own, behaviour })).unwrap();
        let hits = run(&mut world, 800);
        assert!(hits.is_empty(), "person {person}: {hits:?}");
        let gap_m = -750.0 - position_m(&world, own).x;
        assert!(speed_mps(&world, own) < 0.1, "person {person}");
        assert!((2.5..16.0).contains(&gap_m), "person {person}: {gap_m} m");
    }
}

/// The lane of Town07 that leads to the east through the junction in its north.
const STRAIGHT_Y_M: f32 = 158.5;

/// A car waits straight ahead in a junction of Town07; whoever comes behind it goes straight on or
/// turns off past its corners.
#[test]
fn who_turns_off_behind_a_car_that_waits_in_a_junction_does_not_clip_it() {
    let map = Arc::new(Town::new(roads("Town07_Opt")));
    let at = |x_m: f32| level_pose(Vec3::new(x_m, STRAIGHT_Y_M, 2.0), 0.0);
    let mut turned = 0;
    for waits_m in [-80.0, -79.0, -78.0, -77.0, -76.0, -75.0, -74.0, -73.0] {
        for seed in 1..=6 {
            let id = WorldId::new(1).unwrap();
            let config = WorldConfig { id, epoch: 1, seed, dt_secs: 0.05, map: Arc::clone(&map) };
            let mut world = World::new(config).unwrap();
            spawn_at(&mut world, "vehicle.dodge.charger_2020", at(waits_m), 0.0);
            let actor = spawn_at(&mut world, "vehicle.ford.crown", at(-110.0), 0.0);
            let behaviour = AgentBehaviour::Normal;
            world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour })).unwrap();
            let hits = run(&mut world, 400);
            assert!(hits.is_empty(), "{waits_m} m, seed {seed}: {hits:?}");
            turned += u32::from((position_m(&world, actor).y - STRAIGHT_Y_M).abs() > 10.0);
        }
    }
    assert!(turned > 5, "{turned} of 48 turned off");
}

#[test]
fn a_driver_overtakes_a_slow_car_on_the_lane_beside() {
    let mut world = world();
    let slow = car(&mut world, -840.0, 4.0);
    let own = car(&mut world, -900.0, 10.0);
    let behaviour = AgentBehaviour::Normal;
    world.apply(&Command::Traffic(TrafficCommand::Join { actor: own, behaviour })).unwrap();
    let target_speed_mps = Some(4.0);
    let mode = schemas::PilotMode::KeepLane;
    world
        .apply(&Command::Vehicle(VehicleCommand::Pilot { actor: slow, mode, target_speed_mps }))
        .unwrap();
    let hits = run(&mut world, 800);
    assert!(hits.is_empty(), "{hits:?}");
    let (own_m, slow_m) = (position_m(&world, own), position_m(&world, slow));
    assert!(own_m.x > slow_m.x + 10.0, "{own_m} behind {slow_m}");
}

#[test]
fn too_much_traffic_is_refused_and_nothing_changes() {
    let mut world = world_in(town());
    let before = (world.state_hash(), world.snapshot());
    let refusal =
        world.apply(&Command::Traffic(TrafficCommand::Spawn { count: 5_000, behaviour: None }));
    assert_eq!(refusal.unwrap_err().code, ErrorCode::SpawnBlocked);
    assert_eq!((world.state_hash(), world.snapshot()), before);
}

#[test]
fn another_hand_on_the_wheel_takes_a_vehicle_out_of_traffic() {
    let mut world = world();
    let own = car(&mut world, -900.0, 10.0);
    let before = world.state_hash();
    let behaviour = AgentBehaviour::Cautious;
    world.apply(&Command::Traffic(TrafficCommand::Join { actor: own, behaviour })).unwrap();
    assert_ne!(world.state_hash(), before, "traffic counts in the hash");
    run(&mut world, 20);
    let coast = VehicleControl::default();
    control(&mut world, own, coast);
    run(&mut world, 20);
    assert_eq!(state(&world, own).control, coast);
}

#[test]
fn far_traffic_moves_without_dynamics_and_gets_them_back_when_somebody_is_near() {
    let mut world = world();
    let witness = car(&mut world, -950.0, 0.0);
    brake(&mut world, witness);
    let own = car(&mut world, -700.0, 0.0);
    let behaviour = AgentBehaviour::Normal;
    world.apply(&Command::Traffic(TrafficCommand::Join { actor: own, behaviour })).unwrap();
    world.apply(&Command::Traffic(TrafficCommand::SetHybrid { radius_m: Some(70.0) })).unwrap();
    let other = WorldId::new(9).unwrap();
    let mut copy: Option<World> = None;
    let mut last_m = position_m(&world, own);
    for tick in 0..260 {
        match tick {
            60 => {
                let bytes = world.snapshot();
                copy = Some(World::restore(&bytes, other, 2, |_| Some(flat())).unwrap());
            }
            100 => {
                let beside = last_m + Vec3::new(0.0, 7.0, 0.3);
                let world_from_actor = schemas::level_pose(beside, 0.0);
                let near = Command::Body(BodyCommand::SetPose {
                    actor: witness,
                    reference_from_actor: world_from_actor,
                });
                world.apply(&near).unwrap();
                copy.as_mut().unwrap().apply(&near).unwrap();
            }
            _ => {}
        }
        run(&mut world, 1);
        if let Some(copy) = &mut copy {
            copy.tick().unwrap();
            assert_eq!(copy.state_hash(), world.state_hash(), "tick {tick}");
        }
        let state = state(&world, own);
        let here_m = state.world_from_actor.translation.vector;
        let step_m = (here_m - last_m).norm();
        let told_m = state.linear_velocity_mps.norm() * 0.05;
        assert!((step_m - told_m).abs() < 0.1, "tick {tick}: {step_m} m, told {told_m} m");
        last_m = here_m;
        if tick == 99 {
            assert_eq!(state.control, VehicleControl::default(), "nobody presses a pedal");
            assert!(state.linear_velocity_mps.x > 5.0, "{}", state.linear_velocity_mps);
        }
        if tick == 110 {
            assert!(state.control.throttle > 0.0, "{:?}", state.control);
        }
    }
    // Out of everybody's sight, a command for the pedals still brings the dynamics back.
    run(&mut world, 400);
    brake(&mut world, own);
    run(&mut world, 120);
    assert!(speed_mps(&world, own) < 0.05);
}

#[test]
fn traffic_that_comes_to_the_end_of_a_road_begins_anew_where_one_begins() {
    let mut world = world();
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count: 6, behaviour: None })).unwrap();
    let joined = car(&mut world, 900.0, 10.0);
    let behaviour = AgentBehaviour::Normal;
    world.apply(&Command::Traffic(TrafficCommand::Join { actor: joined, behaviour })).unwrap();
    let mut places_m: Vec<Vec3> = Vec::new();
    let mut begun_anew = 0;
    for _ in 0..180 {
        run(&mut world, 20);
        let now_m: Vec<Vec3> = vehicles(&world).iter().map(|(_, place_m, _)| *place_m).collect();
        assert_eq!(now_m.len(), 7);
        assert!(now_m.iter().all(|at| at.x.abs() < 1_000.0), "{now_m:?}");
        let jumps = places_m.iter().zip(&now_m).filter(|(then, now)| (*then - *now).norm() > 60.0);
        begun_anew += jumps.count();
        places_m = now_m;
    }
    // Most come to the wall across the road first, and stand there.
    assert!(begun_anew >= 2, "{begun_anew}: {places_m:?}");
    let last_m = position_m(&world, joined).x;
    assert!((985.0..999.0).contains(&last_m), "who was handed over stays: {last_m}");
}

#[test]
fn who_comes_to_the_end_of_a_road_on_two_wheels_stands_there() {
    for blueprint in ["vehicle.gazelle.omafiets", "vehicle.kawasaki.ninja"] {
        let mut world = world();
        let pose = level_pose(Vec3::new(END_M - 60.0, LANE_Y_M, 0.0), 0.0);
        let actor = spawn_at(&mut world, blueprint, pose, 5.0);
        let behaviour = AgentBehaviour::Normal;
        world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour })).unwrap();
        run(&mut world, 60 * 20);
        let stopped_m = position_m(&world, actor).x;
        assert!((END_M - 8.0..END_M).contains(&stopped_m), "{blueprint}: {stopped_m} m");
        run(&mut world, 120 * 20);
        let rolled_m = position_m(&world, actor).x - stopped_m;
        assert!(rolled_m.abs() < 0.02, "{blueprint}: {rolled_m} m");
    }
}

#[test]
fn a_parked_car_pulls_out_when_nobody_comes() {
    let mut world = world();
    let parked = level_pose(Vec3::new(-880.0, -8.2, 0.0), 0.0);
    let parked = spawn_at(&mut world, "vehicle.lincoln.mkz", parked, 0.0);
    let other = level_pose(Vec3::new(-900.0, -5.25, 0.0), 0.0);
    let other = spawn_at(&mut world, "vehicle.audi.tt", other, 12.0);
    let mode = schemas::PilotMode::KeepLane;
    let pilot = VehicleCommand::Pilot { actor: other, mode, target_speed_mps: Some(12.0) };
    world.apply(&Command::Vehicle(pilot)).unwrap();
    let behaviour = AgentBehaviour::Normal;
    world.apply(&Command::Traffic(TrafficCommand::Join { actor: parked, behaviour })).unwrap();
    let mut waited = 0;
    for _ in 0..500 {
        let hits = run(&mut world, 1);
        assert!(hits.is_empty(), "{hits:?}");
        if position_m(&world, other).x < position_m(&world, parked).x {
            let moved_m = position_m(&world, parked).x + 880.0;
            assert!(moved_m < 0.5, "it let the other one pass: {moved_m} m");
            waited += 1;
        }
    }
    assert!(waited > 20, "{waited}");
    let at_m = position_m(&world, parked);
    let is_in_lane = [-5.25, -1.75].iter().any(|lane_m| (at_m.y - lane_m).abs() < 0.5);
    assert!(is_in_lane && speed_mps(&world, parked) > 5.0, "{at_m}");
}

/// One car stands half on the right lane, another behind it on that lane: both would wait for ever
/// if each waited for the other.
#[test]
fn who_stands_beside_a_lane_does_not_wait_for_whoever_waits_behind_it() {
    let mut world = world();
    let cars = [(-880.0, -7.1), (-886.5, -5.25)].map(|(x_m, y_m)| {
        let pose = level_pose(Vec3::new(x_m, y_m, 0.0), 0.0);
        spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0)
    });
    run(&mut world, 40);
    for actor in cars {
        let behaviour = AgentBehaviour::Normal;
        world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour })).unwrap();
    }
    let hits = run(&mut world, 400);
    assert!(hits.is_empty(), "{hits:?}");
    for actor in cars {
        assert!(position_m(&world, actor).x > -850.0, "{}", position_m(&world, actor));
    }
}

#[test]
fn nobody_drives_into_an_open_door() {
    for open in [false, true] {
        let mut world = world();
        let own = car(&mut world, -900.0, 10.0);
        let beside = level_pose(Vec3::new(-800.0, -4.3, 0.0), 0.0);
        let beside = spawn_at(&mut world, "vehicle.lincoln.mkz", beside, 0.0);
        brake(&mut world, beside);
        let doors = VehicleCommand::Doors { actor: beside, doors: 0b0001, open };
        world.apply(&Command::Vehicle(doors)).unwrap();
        let behaviour = AgentBehaviour::Normal;
        world.apply(&Command::Traffic(TrafficCommand::Join { actor: own, behaviour })).unwrap();
        run(&mut world, 600);
        let passed = position_m(&world, own).x > -800.0;
        assert_eq!(passed, !open, "{}", position_m(&world, own));
    }
}

#[test]
fn restored_traffic_knows_the_same_limits_though_nobody_remembers_where_it_looked() {
    let mut world = world_in(town());
    let spawn = TrafficCommand::Spawn { count: 30, behaviour: None };
    world.apply(&Command::Traffic(spawn)).unwrap();
    run(&mut world, 60);
    for round in 0..20 {
        let mut restored =
            World::restore(&world.snapshot(), world.id(), 1, |_| Some(town())).unwrap();
        for tick in 0..10 {
            run(&mut world, 1);
            run(&mut restored, 1);
            assert_eq!(restored.state_hash(), world.state_hash(), "{round}, {tick}");
        }
    }
}
