//! What of lights and signs is state, and what is refused.

use schemas::{
    ActorId, Command, ErrorCode, Frame, TrafficLightColour as Colour, TrafficLightCommand, Vec3,
    WorldId,
};
use world::World;

use crate::support::{before_light, config, first_group, run, set_colour, town, world};

#[test]
fn a_restored_and_a_forked_world_show_the_same_ever_after() {
    let mut world = world();
    let (light, start) = before_light(25.0);
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap();
    world.apply(&set_colour(light, Colour::Yellow)).unwrap();
    run(&mut world, 57);
    let id = WorldId::new(1).unwrap();
    let mut restored = World::restore(&world.snapshot(), id, 1, |_| Some(town())).unwrap();
    let mut forked = world.fork(id);
    for _ in 0..300 {
        let frames: Vec<Frame> = [&mut world, &mut restored, &mut forked]
            .into_iter()
            .map(|world| {
                world.tick().unwrap();
                world.frame()
            })
            .collect();
        assert_eq!(frames[0], frames[1]);
        assert_eq!(frames[0], frames[2]);
    }
}

#[test]
fn what_lights_show_is_part_of_the_state_hash() {
    let [mut one, mut other] = [world(), world()];
    let [first, _] = first_group(&one);
    assert_eq!(one.state_hash(), other.state_hash());
    one.apply(&set_colour(first[0], Colour::Red)).unwrap();
    assert_ne!(one.state_hash(), other.state_hash());
    other.apply(&set_colour(first[0], Colour::Red)).unwrap();
    assert_eq!(one.state_hash(), other.state_hash());
    one.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    assert_ne!(one.state_hash(), other.state_hash());
}

#[test]
fn signs_cannot_be_set_and_nothing_changes() {
    let mut world = world();
    let before = world.state_hash();
    let lights = world.frame().traffic_lights.len() as u32;
    let (light, sign) = (ActorId::new(1).unwrap(), ActorId::new(lights + 1).unwrap());
    let unknown = ActorId::new(99_999).unwrap();
    let code = |world: &mut World, command: Command| world.apply(&command).unwrap_err().code;
    let reset = |actor| Command::TrafficLight(TrafficLightCommand::Reset { actor: Some(actor) });
    for (command, expected) in [
        (set_colour(sign, Colour::Red), ErrorCode::InvalidArgument),
        (set_colour(unknown, Colour::Red), ErrorCode::UnknownActor),
        (reset(sign), ErrorCode::InvalidArgument),
    ] {
        assert_eq!(code(&mut world, command), expected);
    }
    for secs in [-1.0, f32::NAN, f32::INFINITY] {
        let command = Command::TrafficLight(TrafficLightCommand::Set {
            actor: light,
            colour: Some(Colour::Off),
            green_secs: Some(secs),
            yellow_secs: None,
            red_secs: None,
        });
        assert_eq!(code(&mut world, command), ErrorCode::InvalidArgument);
    }
    assert_eq!(world.state_hash(), before);
    let mut without = World::new(config()).unwrap();
    assert_eq!(code(&mut without, set_colour(light, Colour::Red)), ErrorCode::UnknownActor);
}
