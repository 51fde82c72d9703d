//! Walkers that find their own way.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock};

use common::*;
use roads::nav::{Area, NavMesh};
use schemas::{
    ActorId, ActorKind, Command, Pose, TrafficCommand, TrafficLightColour, TrafficLightCommand,
    Vec3, WalkerCommand, WorldId,
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

fn world_in_town() -> World {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: town() };
    World::with_traffic(config).unwrap()
}

fn send(world: &mut World, actor: ActorId, goal_m: Option<Vec3>, crossing_share: f32) {
    let set =
        Command::Walker(WalkerCommand::Agent { actor, goal_m, speed_mps: None, crossing_share });
    let before = world.state_hash();
    world.apply(&set).unwrap();
    assert_ne!(world.state_hash(), before);
}

fn walkers(world: &mut World, mesh: &NavMesh, count: u64) -> Vec<ActorId> {
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
    let mesh = NavMesh::new(&roads("Town02_Opt")).unwrap();
    let mut world = world_in_town();
    let ids = walkers(&mut world, &mesh, 20);
    for (index, actor) in ids.iter().enumerate() {
        let crossing_share = if index.is_multiple_of(4) { 0.5 } else { 0.0 };
        send(&mut world, *actor, None, crossing_share);
    }
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count: 15, behaviour: None })).unwrap();
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
    assert!(way_m.values().all(|way_m| *way_m > 10.0), "{way_m:?} m in a minute");
}

/// A walker on the lane of a light, where its vehicles drive on, between the line and the far edge
/// of the crossing.
fn is_on_crossing(lines: &[(Vec3, Vec3)], at_m: Vec3) -> bool {
    lines.iter().any(|(line_m, along)| {
        let away_m = at_m - line_m;
        let ahead_m = away_m.dot(along);
        (0.0..8.0).contains(&ahead_m) && (away_m - along * ahead_m).xy().norm() < 1.2
    })
}

/// How many of some walkers who walk anywhere cross the road before a light in 150 s, with
/// all lights of the town showing this.
fn crossed_at(colour: TrafficLightColour) -> usize {
    let roads = roads("Town05_Opt");
    let lines: Vec<(Vec3, Vec3)> = roads
        .traffic_lights()
        .lights
        .iter()
        .flat_map(|light| &light.boxes)
        .map(|trigger| {
            let pose: Pose = nalgebra::convert(roads.pose(&trigger.front));
            (pose.translation.vector, pose.rotation * Vec3::x())
        })
        .collect();
    let mesh = NavMesh::new(&roads).unwrap();
    let id = WorldId::new(1).unwrap();
    let map = Arc::new(Town::new(roads));
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map };
    let mut world = World::with_traffic(config).unwrap();
    for actor in world.frame().traffic_lights.iter().map(|light| light.actor) {
        let (green_secs, yellow_secs, red_secs) = (None, None, None);
        let colour = Some(colour);
        let show = TrafficLightCommand::Set { actor, colour, green_secs, yellow_secs, red_secs };
        world.apply(&Command::TrafficLight(show)).unwrap();
    }
    let freeze = TrafficLightCommand::Freeze { frozen: true };
    world.apply(&Command::TrafficLight(freeze)).unwrap();
    let mut ids = walkers(&mut world, &mesh, 24);
    // Who is on the road at the start goes on.
    ids.retain(|id| {
        let foot_m = position_m(&world, *id) - Vec3::z();
        let (polygon, _) = mesh.nearest(nalgebra::convert(nalgebra::Point3::from(foot_m))).unwrap();
        mesh.polygons()[polygon as usize].area == Area::Sidewalk
    });
    assert!(ids.len() > 12, "{}", ids.len());
    for actor in &ids {
        send(&mut world, *actor, None, 0.0);
    }
    let mut crossed = BTreeSet::new();
    for _ in 0..300 {
        run(&mut world, 10);
        let there = |id: &&ActorId| is_on_crossing(&lines, position_m(&world, **id));
        crossed.extend(ids.iter().filter(there).copied());
    }
    crossed.len()
}

#[test]
fn people_cross_before_a_light_while_it_holds_the_vehicles_there() {
    let (red, green) = (crossed_at(TrafficLightColour::Red), crossed_at(TrafficLightColour::Green));
    assert!(red > 5, "{red}");
    assert_eq!(green, 0, "and {red} at red");
}

/// How far from a goal a walker may stop: it arrives within a step.
const ARRIVED_M: f32 = 1.0;

#[test]
fn every_walker_reaches_its_goal() {
    let mesh = NavMesh::new(&roads("Town02_Opt")).unwrap();
    let mut world = world_in_town();
    let ids = walkers(&mut world, &mesh, 20);
    let mut goals: BTreeMap<ActorId, Vec3> = BTreeMap::new();
    let mut draw = 1_000;
    for actor in &ids {
        let from: nalgebra::Vector3<f64> = nalgebra::convert(position_m(&world, *actor));
        loop {
            draw += 1;
            let to = mesh.random_point(draw).unwrap();
            let corners = mesh.path(from.into(), to, false);
            let way_m: f64 = corners.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
            if (30.0..150.0).contains(&way_m) {
                let goal_m = nalgebra::convert(to.coords);
                send(&mut world, *actor, Some(goal_m), 0.0);
                goals.insert(*actor, goal_m);
                break;
            }
        }
    }
    world.apply(&Command::Traffic(TrafficCommand::Spawn { count: 15, behaviour: None })).unwrap();
    run(&mut world, 4_800);
    let left_m: BTreeMap<ActorId, f32> = goals
        .iter()
        .map(|(id, goal_m)| (*id, (goal_m - position_m(&world, *id)).xy().norm()))
        .filter(|(_, left_m)| *left_m > ARRIVED_M)
        .collect();
    assert!(left_m.is_empty(), "{left_m:?} m left after four minutes");
}
