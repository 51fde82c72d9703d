//! Parts of the map that are taken away and come back: nothing meets them meanwhile.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use common::*;
use roads::{Map, MapLayer, SceneryKind};
use schemas::{Attachment, AttachmentKind, Measurement, Pose};
use schemas::{
    BodyCommand, Command, ErrorCode, SceneryCommand, SensorCommand, Vec3, WorldId, level_pose,
};
use world::World;

/// Before the wall across the road, whose near side is at 599.5 m.
const BEFORE_WALL: Vec3 = Vec3::new(580.0, -1.75, 1.0);

fn unload(world: &mut World, layers: u16) {
    world.apply(&Command::Scenery(SceneryCommand::Layers { layers, loaded: false })).unwrap();
}

fn load(world: &mut World, layers: u16) {
    world.apply(&Command::Scenery(SceneryCommand::Layers { layers, loaded: true })).unwrap();
}

fn enable(world: &mut World, objects: &[u64], enabled: bool) {
    world
        .apply(&Command::Scenery(SceneryCommand::Objects { objects: objects.to_vec(), enabled }))
        .unwrap();
}

/// Ids of things of a layer.
fn objects(world: &World, layer: MapLayer) -> Vec<u64> {
    let map = Map::parse("straight", world.map_text()).unwrap();
    let objects = map.environment_objects().iter().filter(|object| object.layer == layer);
    objects.map(|object| object.id).collect()
}

/// How far ahead of [`BEFORE_WALL`] a ray meets something.
fn ahead_m(world: &World) -> Option<f32> {
    let hit = world.project_point(BEFORE_WALL, Vec3::x(), 200.0).unwrap();
    hit.map(|hit| hit.position_m.x - BEFORE_WALL.x)
}

/// Where a car that drives at the wall is after two seconds, and whether it touched anything.
fn drive_at_the_wall(world: &mut World) -> (f32, bool) {
    let car = car(world, 585.0, 20.0);
    let touched = !run(world, 40).is_empty();
    let x_m = position_m(world, car).x;
    world.apply(&Command::DestroyActor { actor: car }).unwrap();
    (x_m, touched)
}

#[test]
fn a_car_drives_through_a_wall_that_is_away_and_hits_it_when_it_is_back() {
    let mut world = world();
    for loaded in [true, false, true] {
        let layers = MapLayer::Walls as u16;
        world.apply(&Command::Scenery(SceneryCommand::Layers { layers, loaded })).unwrap();
        let (x_m, touched) = drive_at_the_wall(&mut world);
        assert_eq!(touched, loaded);
        assert_eq!(x_m > 610.0, !loaded, "{x_m}");
        assert_eq!(ahead_m(&world).is_some(), loaded);
    }
}

#[test]
fn a_car_that_leans_on_a_wall_goes_on_when_the_wall_goes() {
    let mut world = world();
    let car = car(&mut world, 590.0, 10.0);
    assert!(!run(&mut world, 100).is_empty());
    let wall = objects(&world, MapLayer::Walls);
    enable(&mut world, &wall, false);
    let copy = World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
    assert_eq!(copy.frame(), world.frame());
    world
        .apply(&Command::Body(BodyCommand::SetVelocity {
            actor: car,
            linear_mps: Some(Vec3::x() * 10.0),
            angular_radps: None,
        }))
        .unwrap();
    assert!(run(&mut world, 40).is_empty());
    assert!(position_m(&world, car).x > 605.0);
}

#[test]
fn the_obstacle_sensor_sees_no_wall_that_is_away() {
    let mut world = world();
    let carrier = car(&mut world, 590.0, 0.0);
    let spawn = Command::SpawnActor {
        blueprint: "sensor.other.obstacle".to_owned(),
        reference_from_actor: Pose::translation(0.0, 0.0, 1.0),
        linear_velocity_mps: Vec3::zeros(),
        attributes: vec![schemas::Attribute { id: "distance".into(), value: "20".into() }],
        attachment: Some(Attachment { parent: carrier, kind: AttachmentKind::Rigid }),
        id: None,
    };
    let sensor = world.apply(&spawn).unwrap().unwrap();
    world.apply(&Command::Sensor(SensorCommand::Listen { sensor, on: true })).unwrap();
    let mut sees = |loaded: bool| {
        world
            .apply(&Command::Scenery(SceneryCommand::Layers { layers: MapLayer::ALL, loaded }))
            .unwrap();
        world.tick().unwrap();
        let data = world.sensors().iter();
        data.filter(|datum| matches!(datum.measurement, Measurement::Obstacle { .. })).count()
    };
    assert_eq!([true, false, true].map(&mut sees), [1, 0, 1]);
}

#[test]
fn where_a_house_was_there_is_room() {
    let mut world = world();
    let inside = level_pose(Vec3::new(20.0, -20.0, 0.1), 0.0);
    let spawn = Command::spawn("vehicle.audi.tt", inside, Vec3::zeros());
    assert_eq!(world.apply(&spawn).unwrap_err().code, ErrorCode::SpawnBlocked);
    unload(&mut world, MapLayer::Buildings as u16);
    world.apply(&spawn).unwrap();
}

#[test]
fn layers_and_single_things_go_and_come_back_as_in_carla() {
    let mut world = world();
    let untouched = world.state_hash();
    let wall = objects(&world, MapLayer::Walls);
    enable(&mut world, &wall, false);
    assert_eq!(ahead_m(&world), None);
    assert_ne!(world.state_hash(), untouched);
    // The layer is loaded: to load it changes nothing.
    load(&mut world, MapLayer::Walls as u16);
    assert_eq!(ahead_m(&world), None);
    // A layer that comes back is whole, and things of one that is away cannot be shown.
    unload(&mut world, u16::MAX);
    assert_eq!(world.frame().hidden.layers, MapLayer::ALL);
    enable(&mut world, &wall, true);
    assert_eq!(ahead_m(&world), None);
    load(&mut world, MapLayer::Walls as u16);
    assert!((ahead_m(&world).unwrap() - 19.5).abs() < 0.01);
    load(&mut world, MapLayer::ALL);
    assert_eq!(world.state_hash(), untouched);
}

#[test]
fn roads_stay_and_unknown_things_are_refused() {
    let mut world = world();
    let roads = objects(&world, MapLayer::Ground);
    assert!(!roads.is_empty());
    let untouched = world.state_hash();
    enable(&mut world, &roads, false);
    assert_eq!(world.state_hash(), untouched);
    let mut ids = objects(&world, MapLayer::Walls);
    ids.push(12);
    let command = Command::Scenery(SceneryCommand::Objects { objects: ids, enabled: false });
    let refused = world.apply(&command).unwrap_err();
    assert_eq!((refused.code, refused.found.as_str()), (ErrorCode::InvalidArgument, "12"));
    assert_eq!(world.state_hash(), untouched);
}

#[test]
fn a_town_forked_and_restored_hides_the_same() {
    let text = roads::town::build("Town02_Opt").unwrap();
    let map = std::sync::Arc::new(Map::parse("Town02_Opt", &text).unwrap());
    let town = std::sync::Arc::new(world::Town::new(std::sync::Arc::clone(&map)));
    let mut world = world_on(std::sync::Arc::clone(&town), 0.05);
    unload(&mut world, MapLayer::Buildings as u16 | MapLayer::StreetLights as u16);
    let trees = objects(&world, MapLayer::Foliage);
    enable(&mut world, &trees[..trees.len() / 2], false);
    let id = WorldId::new(2).unwrap();
    let hidden = world.frame().hidden;
    let of_kind = |kind: SceneryKind| {
        let things = (0..).zip(map.scenery()).filter(move |(_, thing)| thing.kind == kind);
        things.map(|(place, _)| hidden.contains(place)).collect::<Vec<bool>>()
    };
    assert!(of_kind(SceneryKind::Building).into_iter().all(|hidden| hidden));
    let tree_count = of_kind(SceneryKind::Tree).iter().filter(|hidden| **hidden).count();
    assert_eq!(tree_count, trees.len() / 2);
    let restored = World::restore(&world.snapshot(), id, 1, |_| Some(town)).unwrap();
    for mut copy in [world.fork(id), restored] {
        assert_eq!(copy.frame().hidden, world.frame().hidden);
        load(&mut copy, MapLayer::ALL);
        assert!(!copy.frame().hidden.is_none(), "single trees stay hidden");
        assert_eq!(copy.frame().hidden.layers, 0);
    }
}
