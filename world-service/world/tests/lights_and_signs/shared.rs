//! A line that several lights have, each for another way through the junction.

use std::sync::Arc;

use roads::Map;
use schemas::{
    BodyCommand, Command, TrafficLightColour as Colour, TrafficLightCommand, Vec3, level_pose,
};
use world::{Town, World, WorldConfig};

use crate::support::{config, run, set_colour};

const FORK: &str = include_str!("../../../../roads/tests/maps/fork.xodr");

/// A road that leads straight on and to the left; a light holds each way, 1 and 2. The map names
/// one of the ways first.
fn fork(left_first: bool) -> Arc<Map> {
    let at = |text: &str| FORK.find(text).unwrap();
    let (straight, left) = (at("<road id=\"11\""), at("<road id=\"12\""));
    let (before, after) = (&FORK[..straight], &FORK[at("<controller")..]);
    let (straight, left) = (&FORK[straight..left], &FORK[left..at("<controller")]);
    let ways = if left_first { [left, straight] } else { [straight, left] };
    let text = [before, ways[0], ways[1], after].concat();
    Arc::new(Map::parse("fork", &text).unwrap())
}

/// How many red lights a car runs that drives straight on while the lights show these colours: that
/// of its way, and that of the way to the left.
fn run_by_who_drives_on(map: &Arc<Map>, colours: [Colour; 2]) -> u32 {
    let map = Arc::new(Town::new(Arc::clone(map)));
    let mut world = World::with_traffic(WorldConfig { map, ..config() }).unwrap();
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    let lights: Vec<_> = world.frame().traffic_lights.iter().map(|light| light.actor).collect();
    let lights = world.describe(&lights);
    for (signal, colour) in ["1", "2"].into_iter().zip(colours) {
        let is_it = |light: &&schemas::ActorDescription| light.signal.as_deref() == Some(signal);
        let light = lights.iter().find(is_it).unwrap();
        world.apply(&set_colour(light.id, colour)).unwrap();
    }
    let start = level_pose(Vec3::new(-50.0, 0.0, 0.3), 0.0);
    let speed = Vec3::new(8.0, 0.0, 0.0);
    let actor = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    let push = BodyCommand::SetConstantVelocity { actor, velocity_mps: Some(speed) };
    world.apply(&Command::Body(push)).unwrap();
    run(&mut world, 240);
    assert!(world.frame().actor(actor).unwrap().world_from_actor.translation.x > 30.0);
    world.rules_broken().map(|(_, broken)| broken.red_lights).sum()
}

#[test]
fn of_several_lights_at_one_line_that_of_the_own_way_is_run() {
    for left_first in [false, true] {
        let map = fork(left_first);
        let lights = map.traffic_lights().lights;
        let lines: Vec<_> = lights.iter().map(|light| light.boxes[0].front).collect();
        assert!(lines.len() == 2 && lines[0] == lines[1], "{lines:?}");
        for (colours, wanted) in [
            ([Colour::Green, Colour::Red], 0),
            ([Colour::Red, Colour::Green], 1),
            ([Colour::Red, Colour::Red], 1),
            ([Colour::Green, Colour::Green], 0),
        ] {
            let found = run_by_who_drives_on(&map, colours);
            assert_eq!(
                found, wanted,
                "{colours:?}, that of the way to the left first: {left_first}"
            );
        }
    }
}
