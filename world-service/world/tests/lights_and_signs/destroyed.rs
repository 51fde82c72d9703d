//! Lights and signs that clients take away.

use schemas::{
    ActorId, Command, ErrorCode, TrafficLightColour as Colour, Vec3, VehicleCommand, WorldId,
};
use world::World;

use crate::support::{before_light, colour, first_group, run, set_colour, town, world};

fn destroy(world: &mut World, actor: ActorId) {
    assert_eq!(world.apply(&Command::DestroyActor { actor }), Ok(None));
}

#[test]
fn a_light_or_sign_that_is_destroyed_is_an_actor_no_more() {
    let mut world = world();
    let before = world.frame();
    let lights = before.traffic_lights.len();
    let (light, sign) = (before.actors[1].id, before.actors[lights + 2].id);
    for signal in [light, sign] {
        let hash = world.state_hash();
        destroy(&mut world, signal);
        assert_ne!(world.state_hash(), hash);
        for command in [Command::DestroyActor { actor: signal }, set_colour(signal, Colour::Red)] {
            assert_eq!(world.apply(&command).unwrap_err().code, ErrorCode::UnknownActor);
        }
    }
    let stays = |id: &ActorId| ![light, sign].contains(id);
    let after = world.frame();
    let ids = |frame: &schemas::Frame| -> Vec<ActorId> {
        frame.actors.iter().map(|actor| actor.id).collect()
    };
    let wanted: Vec<ActorId> = ids(&before).into_iter().filter(stays).collect();
    assert_eq!(ids(&after), wanted);
    let described = world.describe(&[]);
    assert_eq!(described.iter().map(|one| one.id).collect::<Vec<_>>(), wanted);
    for (one, actor) in described.iter().zip(&after.actors) {
        assert_eq!(one.blueprint, after.type_of(actor));
    }
    assert_eq!(world.actor_count(), wanted.len());
    // Places in the list of lights stay what they were.
    assert_eq!(after.traffic_lights.len(), lights);
    let unknown = after.traffic_lights.iter().filter(|light| light.colour == Colour::Unknown);
    assert_eq!(unknown.map(|light| light.actor).collect::<Vec<_>>(), [light]);
}

#[test]
fn snapshots_and_forks_lack_what_was_destroyed() {
    let mut world = world();
    let light = world.frame().actors[0].id;
    destroy(&mut world, light);
    let id = WorldId::new(9).unwrap();
    let restored = World::restore(&world.snapshot(), id, 1, |_| Some(town())).unwrap();
    for mut other in [restored, world.fork(id)] {
        let mut one = world.fork(id);
        run(&mut one, 40);
        run(&mut other, 40);
        assert_eq!(one.state_hash(), other.state_hash());
        assert!(other.frame().actor(light).is_none());
    }
}

#[test]
fn the_others_of_a_group_take_their_turns() {
    let mut world = world();
    let [begin, next] = first_group(&world);
    begin.iter().for_each(|light| destroy(&mut world, *light));
    run(&mut world, (15.5 / 0.05) as usize);
    assert_eq!(colour(&world, next[0]), Colour::Green);
    assert_eq!(colour(&world, begin[0]), Colour::Unknown);
}

#[test]
fn a_light_that_is_destroyed_holds_nobody_and_counts_for_nothing() {
    let mut world = world();
    let (light, start) = before_light(3.0);
    let freeze = schemas::TrafficLightCommand::Freeze { frozen: true };
    world.apply(&Command::TrafficLight(freeze)).unwrap();
    world.apply(&set_colour(light, Colour::Red)).unwrap();
    let car = Command::spawn("vehicle.lincoln.mkz", start, Vec3::zeros());
    let car = world.apply(&car).unwrap().unwrap();
    let drive = |world: &mut World, throttle, brake| {
        let control = schemas::VehicleControl { throttle, brake, ..Default::default() };
        let control = VehicleCommand::Control { actor: car, control };
        world.apply(&Command::Vehicle(control)).unwrap();
    };
    drive(&mut world, 0.0, 1.0);
    run(&mut world, 60);
    assert_eq!(world.frame().actor(car).unwrap().traffic_light, Some(light));
    destroy(&mut world, light);
    assert_eq!(world.frame().actor(car).unwrap().traffic_light, None);
    drive(&mut world, 1.0, 0.0);
    for _ in 0..100 {
        world.tick().unwrap();
        assert_eq!(world.frame().actor(car).unwrap().traffic_light, None);
    }
    let went = world.frame().actor(car).unwrap().world_from_actor.translation.vector;
    assert!((went - start.translation.vector).norm() > 10.0, "it drove past the light");
    assert!(world.frame().rules_broken.is_empty());
}
