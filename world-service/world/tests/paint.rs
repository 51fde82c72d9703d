//! Textures on things of the map are part of the world's state.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::sync::Arc;

use common::*;
use roads::{Map, MapLayer};
use schemas::{
    Coat, Command, Error, ErrorCode, MaterialParameter, SceneryCommand, Texture, WorldId,
};
use world::World;

fn texture(colour: u8) -> Arc<Texture> {
    Arc::new(Texture::new([2, 2], 1.0, &[colour; 12]).unwrap())
}

fn paint(
    world: &mut World,
    objects: &[u64],
    parameter: MaterialParameter,
    texture: &Arc<Texture>,
) -> Result<(), Error> {
    let (objects, texture) = (objects.to_vec(), Arc::clone(texture));
    let command = SceneryCommand::Paint { objects, parameter, texture };
    world.apply(&Command::Scenery(command)).map(|_| ())
}

/// Id and place in the scenery of the first thing of a layer that has one.
fn thing(world: &World, layer: MapLayer) -> (u64, u32) {
    let map = Map::parse("straight", world.map_text()).unwrap();
    let objects = map.environment_objects().iter().filter(|object| object.layer == layer);
    objects.filter_map(|object| Some((object.id, object.scenery?))).next().unwrap()
}

#[test]
fn frames_tell_what_is_painted_and_copies_have_it_too() {
    let mut world = world();
    let (house, place) = thing(&world, MapLayer::Buildings);
    let [red, blue] = [texture(1), texture(2)];
    let bare = world.state_hash();
    paint(&mut world, &[house], MaterialParameter::Diffuse, &red).unwrap();
    let one = world.state_hash();
    assert_ne!(one, bare);
    paint(&mut world, &[house], MaterialParameter::Emissive, &blue).unwrap();
    assert_ne!(world.state_hash(), one);
    let frame = world.frame();
    assert_eq!(frame.paint.textures, [red.digest(), blue.digest()]);
    assert_eq!(frame.paint.coats, [Coat { place, diffuse: Some(0), emissive: Some(1) }]);
    let mut restored = World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
    assert_eq!(restored.frame(), frame);
    let mut forked = world.fork(WorldId::new(9).unwrap());
    assert_eq!(forked.frame().paint, frame.paint);
    for copy in [&mut world, &mut restored, &mut forked] {
        copy.tick().unwrap();
    }
    assert_eq!(restored.frame(), world.frame());
    assert_eq!(forked.state_hash(), world.state_hash());
    let found = world::texture(red.digest()).unwrap();
    assert_eq!(found, red);
}

#[test]
fn paint_changes_nothing_but_itself() {
    let (mut world, mut plain) = (world(), world());
    let (wall, _) = thing(&world, MapLayer::Walls);
    for it in [&mut world, &mut plain] {
        car(it, 590.0, 10.0);
    }
    paint(&mut world, &[wall], MaterialParameter::Diffuse, &texture(3)).unwrap();
    assert_eq!(run(&mut world, 60), run(&mut plain, 60));
    assert_eq!(world.frame().actors, plain.frame().actors);
}

#[test]
fn a_layer_that_comes_back_has_no_paint() {
    let mut world = world();
    let (house, _) = thing(&world, MapLayer::Buildings);
    let (wall, place) = thing(&world, MapLayer::Walls);
    for object in [house, wall] {
        paint(&mut world, &[object], MaterialParameter::Diffuse, &texture(4)).unwrap();
    }
    for loaded in [false, true] {
        let layers = MapLayer::Buildings as u16;
        world.apply(&Command::Scenery(SceneryCommand::Layers { layers, loaded })).unwrap();
    }
    assert_eq!(world.frame().paint.coats, [Coat { place, diffuse: Some(0), emissive: None }]);
}

#[test]
fn what_cannot_be_painted_changes_nothing() {
    let mut world = world();
    let (house, _) = thing(&world, MapLayer::Buildings);
    let map = Map::parse("straight", world.map_text()).unwrap();
    let road = map.environment_objects().iter().find(|object| object.scenery.is_none()).unwrap();
    let before = world.frame();
    let unknown = paint(&mut world, &[house, 77], MaterialParameter::Diffuse, &texture(5));
    assert_eq!(unknown.unwrap_err().code, ErrorCode::InvalidArgument);
    paint(&mut world, &[road.id], MaterialParameter::Diffuse, &texture(5)).unwrap();
    assert_eq!(world.frame(), before);
}
