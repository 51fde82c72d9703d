//! Rules that vehicles break.

use std::sync::Arc;

use roads::{Map, SignKind};
use schemas::{
    ActorId, AgentCommand, AgentOptions, BodyCommand, Command, Pose, TrafficLightColour as Colour,
    TrafficLightCommand, Vec3, VehicleCommand,
};
use world::{Town, World, WorldConfig};

use crate::support::{before_light, config, run, set_colour, world};

/// A car that is kept at 8 m/s past a light of this colour.
fn past_a_light(colour: Colour) -> World {
    let mut world = world();
    let (light, start) = before_light(25.0);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    world.apply(&set_colour(light, colour)).unwrap();
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    let velocity_mps = Some(Vec3::new(8.0, 0.0, 0.0));
    let push = BodyCommand::SetConstantVelocity { actor: car, velocity_mps };
    world.apply(&Command::Body(push)).unwrap();
    run(&mut world, 100);
    world
}

#[test]
fn a_light_that_is_run_is_counted_once_and_a_green_one_is_not() {
    for (colour, wanted) in [(Colour::Red, 1), (Colour::Yellow, 0), (Colour::Green, 0)] {
        let world = past_a_light(colour);
        let broken: Vec<u32> = world.rules_broken().map(|(_, broken)| broken.red_lights).collect();
        assert_eq!(broken, [wanted], "{colour:?}");
    }
}

#[test]
fn a_stop_sign_is_run_by_whoever_does_not_stand_at_it() {
    let text = roads::town::build("Town04_Opt").unwrap();
    let map = Arc::new(Map::parse("Town04_Opt", &text).unwrap());
    let sign = map.traffic_signs().into_iter().find(|sign| sign.kind == SignKind::Stop).unwrap();
    let start = *map.previous(&sign.boxes[0].front, 25.0).first().unwrap();
    let mut pose: Pose = nalgebra::convert(map.pose(&start));
    pose.translation.vector.z += 0.3;
    let town = Arc::new(Town::new(map));
    for stops in [false, true] {
        let mut world =
            World::with_traffic(WorldConfig { map: Arc::clone(&town), ..config() }).unwrap();
        let car = Command::spawn("vehicle.lincoln.mkz", pose, Vec3::zeros());
        let actor = world.apply(&car).unwrap().unwrap();
        if stops {
            let behaviour = schemas::AgentBehaviour::Normal;
            let join = schemas::TrafficCommand::Join { actor, behaviour };
            world.apply(&Command::Traffic(join)).unwrap();
        } else {
            let velocity_mps = Some(Vec3::new(6.0, 0.0, 0.0));
            let push = BodyCommand::SetConstantVelocity { actor, velocity_mps };
            world.apply(&Command::Body(push)).unwrap();
        }
        run(&mut world, 600);
        let broken: Vec<u32> = world.rules_broken().map(|(_, broken)| broken.stop_signs).collect();
        assert_eq!(broken, [u32::from(!stops)], "stops {stops}");
    }
}

#[test]
fn blue_lights_pass_a_red_light_and_others_do_not() {
    for (blue, by_agent) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut world = world();
        let (_, start) = before_light(30.0);
        world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
        let lights: Vec<ActorId> =
            world.frame().traffic_lights.iter().map(|light| light.actor).collect();
        for light in lights {
            world.apply(&set_colour(light, Colour::Red)).unwrap();
        }
        let ambulance = Command::spawn("vehicle.ford.ambulance", start, Vec3::zeros());
        let actor = world.apply(&ambulance).unwrap().unwrap();
        let lights = if blue { 0x200 } else { 0 };
        world.apply(&Command::Vehicle(VehicleCommand::Lights { actor, lights })).unwrap();
        let behaviour = schemas::AgentBehaviour::Normal;
        if by_agent {
            let options = AgentOptions { behaviour, ..AgentOptions::default() };
            let keep_route = false;
            let set = AgentCommand::Set { actor, options, keep_route };
            world.apply(&Command::Agent(set)).unwrap();
            world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
        } else {
            let join = schemas::TrafficCommand::Join { actor, behaviour };
            world.apply(&Command::Traffic(join)).unwrap();
        }
        run(&mut world, 400);
        let frame = world.frame();
        let place_m = frame.actor(actor).unwrap().world_from_actor.translation.vector;
        let driven_m = (place_m - start.translation.vector).norm();
        assert_eq!(driven_m > 35.0, blue, "{driven_m} m, by an agent: {by_agent}");
    }
}

#[test]
fn who_is_put_elsewhere_before_a_red_light_or_stop_sign_has_run_neither() {
    let mut world = world();
    let (light, start) = before_light(1.0);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    world.apply(&set_colour(light, Colour::Red)).unwrap();
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    let actor = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    run(&mut world, 2);
    assert_eq!(world.frame().actor(actor).unwrap().traffic_light, Some(light));
    let (_, world_from_actor) = before_light(30.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
    run(&mut world, 1);
    assert_eq!(world.frame().actor(actor).unwrap().traffic_light, None);
    let red_lights =
        |world: &World| -> u32 { world.rules_broken().map(|(_, broken)| broken.red_lights).sum() };
    assert_eq!(red_lights(&world), 0);
    // From there it comes to the light again, and runs it.
    let velocity_mps = Some(Vec3::new(8.0, 0.0, 0.0));
    let push = BodyCommand::SetConstantVelocity { actor, velocity_mps };
    world.apply(&Command::Body(push)).unwrap();
    run(&mut world, 120);
    assert_eq!(red_lights(&world), 1);
}
