//! A town with lights and signs, and what they show.

use std::sync::{Arc, LazyLock};

use roads::Map;
use schemas::{
    ActorId, Command, Pose, TrafficLightColour as Colour, TrafficLightCommand, TrafficLightState,
    WorldId,
};
use world::{Town, World, WorldConfig};

pub(crate) const DT_SECS: f64 = 0.05;

pub(crate) fn roads() -> &'static Arc<Map> {
    static MAP: LazyLock<Arc<Map>> = LazyLock::new(|| {
        let text = roads::town::build("Town02_Opt").unwrap();
        Arc::new(Map::parse("Town02_Opt", &text).unwrap())
    });
    &MAP
}

pub(crate) fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| Arc::new(Town::new(Arc::clone(roads()))));
    Arc::clone(&TOWN)
}

pub(crate) fn config() -> WorldConfig {
    let id = WorldId::new(1).unwrap();
    WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map: town() }
}

pub(crate) fn world() -> World {
    World::with_traffic(config()).unwrap()
}

pub(crate) fn run(world: &mut World, ticks: usize) {
    for _ in 0..ticks {
        world.tick().unwrap();
    }
}

pub(crate) fn light(world: &World, actor: ActorId) -> TrafficLightState {
    let frame = world.frame();
    *frame.traffic_lights.iter().find(|light| light.actor == actor).unwrap()
}

pub(crate) fn colour(world: &World, actor: ActorId) -> Colour {
    light(world, actor).colour
}

/// Lights of the first group: those that begin, and those whose turn is next.
pub(crate) fn first_group(world: &World) -> [Vec<ActorId>; 2] {
    let frame = world.frame();
    let of = |colour| {
        let lights = frame.traffic_lights.iter().filter(|l| l.group == 0 && l.colour == colour);
        lights.map(|light| light.actor).collect::<Vec<_>>()
    };
    let lights = [of(Colour::Green), of(Colour::Red)];
    assert!(lights.iter().all(|lights| !lights.is_empty()), "{lights:?}");
    lights
}

pub(crate) fn set_colour(actor: ActorId, colour: Colour) -> Command {
    let colour = Some(colour);
    Command::TrafficLight(TrafficLightCommand::Set {
        actor,
        colour,
        green_secs: None,
        yellow_secs: None,
        red_secs: None,
    })
}

/// A place on a lane that leads to a light, this far before the place to stop at.
pub(crate) fn before_light(ahead_m: f64) -> (ActorId, Pose) {
    let lights = roads().traffic_lights();
    let (index, start) = lights
        .lights
        .iter()
        .enumerate()
        .find_map(|(index, light)| {
            let place = *roads().previous(&light.boxes.first()?.front, ahead_m).first()?;
            Some((index, place))
        })
        .unwrap();
    let mut pose: Pose = nalgebra::convert(roads().pose(&start));
    pose.translation.vector.z += 0.3;
    (ActorId::new(index as u32 + 1).unwrap(), pose)
}
