//! Traffic of the world's own, and walkers that find their own way.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

use common::*;
use schemas::{
    ActorId, ActorKind, AgentBehaviour, Command, ErrorCode, Pose, Vec3, VehicleControl, WorldId,
};
use world::{Town, World, WorldConfig};

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

/// Drives traffic for a minute: no contact, and everybody gets somewhere.
fn flows(map: Arc<Town>, count: u32) {
    let mut world = world_in(map);
    world.apply(&Command::SpawnTraffic { count, behaviour: None }).unwrap();
    assert_eq!(vehicles(&world).len(), count as usize);
    let mut driven_m: BTreeMap<ActorId, f32> = BTreeMap::new();
    for tick in 0..1_200 {
        let hits = run(&mut world, 1);
        assert!(hits.is_empty(), "tick {tick}: {hits:?}");
        for (id, _, mps) in vehicles(&world) {
            *driven_m.entry(id).or_default() += mps * 0.05;
        }
    }
    let mean_m = driven_m.values().sum::<f32>() / count as f32;
    assert!(mean_m > 100.0, "{mean_m} m in a minute");
}

#[test]
fn traffic_flows_without_contact_in_a_small_town() {
    flows(town(), 40);
}

#[test]
fn traffic_flows_without_contact_in_a_large_town() {
    flows(Arc::new(Town::new(roads("Town03_Opt"))), 60);
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
        world.apply(&Command::SetTraffic { actor: own, behaviour }).unwrap();
        let hits = run(&mut world, 800);
        assert!(hits.is_empty(), "person {person}: {hits:?}");
        let gap_m = -750.0 - position_m(&world, own).x;
        assert!(speed_mps(&world, own) < 0.1, "person {person}");
        assert!((2.5..16.0).contains(&gap_m), "person {person}: {gap_m} m");
    }
}

#[test]
fn a_driver_overtakes_a_slow_car_on_the_lane_beside() {
    let mut world = world();
    let slow = car(&mut world, -840.0, 4.0);
    let own = car(&mut world, -900.0, 10.0);
    let behaviour = AgentBehaviour::Normal;
    world.apply(&Command::SetTraffic { actor: own, behaviour }).unwrap();
    let target_speed_mps = Some(4.0);
    let mode = schemas::PilotMode::KeepLane;
    world.apply(&Command::SetPilot { actor: slow, mode, target_speed_mps }).unwrap();
    let hits = run(&mut world, 800);
    assert!(hits.is_empty(), "{hits:?}");
    let (own_m, slow_m) = (position_m(&world, own), position_m(&world, slow));
    assert!(own_m.x > slow_m.x + 10.0, "{own_m} behind {slow_m}");
}

#[test]
fn too_much_traffic_is_refused_and_nothing_changes() {
    let mut world = world_in(town());
    let before = (world.state_hash(), world.snapshot());
    let refusal = world.apply(&Command::SpawnTraffic { count: 5_000, behaviour: None });
    assert_eq!(refusal.unwrap_err().code, ErrorCode::SpawnBlocked);
    assert_eq!((world.state_hash(), world.snapshot()), before);
}

#[test]
fn another_hand_on_the_wheel_takes_a_vehicle_out_of_traffic() {
    let mut world = world();
    let own = car(&mut world, -900.0, 10.0);
    let before = world.state_hash();
    let behaviour = AgentBehaviour::Cautious;
    world.apply(&Command::SetTraffic { actor: own, behaviour }).unwrap();
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
    world.apply(&Command::SetTraffic { actor: own, behaviour }).unwrap();
    world.apply(&Command::SetHybridTraffic { radius_m: Some(70.0) }).unwrap();
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
                let near = Command::SetPose { actor: witness, world_from_actor };
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

fn walkers(world: &mut World, map: &roads::Map, count: u64) -> Vec<ActorId> {
    let mesh = roads::nav::NavMesh::new(map).unwrap();
    let mut ids = Vec::new();
    let mut draw = 0;
    while ids.len() < count as usize {
        draw += 1;
        let place: nalgebra::Vector3<f64> = mesh.random_point(draw).unwrap().coords;
        let place_m: Vec3 = nalgebra::convert(place);
        let pose: Pose = schemas::level_pose(place_m + Vec3::z(), 0.0);
        let spawn = Command::spawn("walker.pedestrian.0001", pose, Vec3::zeros());
        ids.extend(world.apply(&spawn).ok().flatten());
    }
    ids
}

#[test]
fn walkers_walk_and_a_restored_world_walks_on_bit_for_bit() {
    let map = roads("Town02_Opt");
    let mut world = world_in(town());
    let ids = walkers(&mut world, &map, 20);
    for (index, actor) in ids.iter().enumerate() {
        let crossing_share = if index.is_multiple_of(4) { 0.5 } else { 0.0 };
        let set = Command::SetWalkerAgent {
            actor: *actor,
            goal_m: None,
            speed_mps: None,
            crossing_share,
        };
        let before = world.state_hash();
        world.apply(&set).unwrap();
        assert_ne!(world.state_hash(), before);
    }
    world.apply(&Command::SpawnTraffic { count: 15, behaviour: None }).unwrap();
    let mut way_m: BTreeMap<ActorId, f32> = BTreeMap::new();
    let mut last_m: BTreeMap<ActorId, Vec3> =
        ids.iter().map(|id| (*id, position_m(&world, *id))).collect();
    let mut copies: Vec<World> = Vec::new();
    let other = WorldId::new(9).unwrap();
    for tick in 0..1_200 {
        if tick == 600 {
            copies.push(World::restore(&world.snapshot(), other, 2, |_| Some(town())).unwrap());
            copies.push(world.fork(other));
        }
        let hits = run(&mut world, 1);
        let kinds = |id: Option<ActorId>| id.map(|id| state(&world, id).kind);
        assert!(
            hits.iter().all(|hit| {
                kinds(hit.other) != Some(ActorKind::Vehicle)
                    && kinds(Some(hit.actor)) != Some(ActorKind::Vehicle)
            }),
            "tick {tick}: {hits:?}"
        );
        for copy in &mut copies {
            copy.tick().unwrap();
            assert_eq!(copy.state_hash(), world.state_hash(), "tick {tick}");
        }
        for id in &ids {
            let here_m = position_m(&world, *id);
            let before_m = last_m.insert(*id, here_m).unwrap();
            *way_m.entry(*id).or_default() += (here_m - before_m).xy().norm();
        }
    }
    assert!(copies.iter().all(|copy| copy.snapshot() == world.snapshot()));
    let walked = way_m.values().filter(|way_m| **way_m > 10.0).count();
    assert!(walked > way_m.len() / 2, "{way_m:?} m in a minute");
}
