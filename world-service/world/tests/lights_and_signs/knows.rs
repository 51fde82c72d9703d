//! What vehicles know of lights, signs and limits.

use std::sync::Arc;

use nalgebra::Vector3;
use roads::{LaneTypes, Map, SignKind};
use schemas::{
    ActorId, ActorKind, BodyCommand, Command, Pose, TrafficLightColour as Colour, Vec3,
    VehicleCommand,
};
use world::{Town, World, WorldConfig};

use crate::support::{before_light, config, roads, run, set_colour, world};

#[test]
fn a_vehicle_knows_its_light_from_when_its_front_enters_the_box_until_it_has_left() {
    let mut world = world();
    let (light, start) = before_light(25.0);
    world.apply(&set_colour(light, Colour::Red)).unwrap();
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    let mut at_light_m = Vec::new();
    for _ in 0..120 {
        world.tick().unwrap();
        let frame = world.frame();
        let state = frame.actor(car).unwrap();
        assert!(state.speed_limit_mps > 5.0, "{state:?}");
        let travelled_m = state.world_from_actor.translation.vector - start.translation.vector;
        if let Some(seen) = state.traffic_light {
            assert_eq!(seen, light);
            at_light_m.push(travelled_m.norm());
        }
        // A coasting car must come through to show when it forgets the light.
        if state.linear_velocity_mps.norm() < 7.0 {
            let linear_mps = Some(state.world_from_actor.rotation * Vec3::new(8.0, 0.0, 0.0));
            let push = Command::Body(BodyCommand::SetVelocity {
                actor: car,
                linear_mps,
                angular_radps: None,
            });
            world.apply(&push).unwrap();
        }
    }
    let (first, last) = (at_light_m[0], at_light_m[at_light_m.len() - 1]);
    // The box is 3 m long and its front 25 m ahead; the car is 4.9 m long.
    assert!((19.0..20.0).contains(&first), "{at_light_m:?}");
    assert!((26.8..27.9).contains(&last), "{at_light_m:?}");
}

#[test]
fn a_stop_sign_holds_a_vehicle_for_two_seconds_even_when_it_sleeps() {
    let text = roads::town::build("Town04_Opt").unwrap();
    let map = Arc::new(Map::parse("Town04_Opt", &text).unwrap());
    let signs = map.traffic_signs();
    let (index, place) = signs
        .iter()
        .enumerate()
        .find_map(|(index, sign)| {
            (sign.kind == SignKind::Stop).then(|| (index, sign.boxes.first().unwrap().middle))
        })
        .unwrap();
    let sign = ActorId::new((map.traffic_lights().lights.len() + index) as u32 + 1).unwrap();
    let mut pose: Pose = nalgebra::convert(map.pose(&place));
    pose.translation.vector.z += 0.3;
    let mut world =
        World::with_traffic(WorldConfig { map: Arc::new(Town::new(map)), ..config() }).unwrap();
    let car = Command::spawn("vehicle.lincoln.mkz", pose, Vec3::zeros());
    let car = world.apply(&car).unwrap().unwrap();
    let control = schemas::VehicleControl { brake: 1.0, ..Default::default() };
    world.apply(&Command::Vehicle(VehicleCommand::Control { actor: car, control })).unwrap();
    let mut held = Vec::new();
    for _ in 0..80 {
        world.tick().unwrap();
        held.push(world.frame().actor(car).unwrap().traffic_light);
    }
    let ticks = held.iter().filter(|holder| **holder == Some(sign)).count();
    assert!((39..=41).contains(&ticks), "{ticks}");
    assert!(held[ticks..].iter().all(Option::is_none));
}

#[test]
fn the_limit_a_vehicle_knows_is_that_of_its_lane() {
    let mut world = world();
    let (_, start) = before_light(30.0);
    let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, Vec3::zeros()));
    let car = car.unwrap().unwrap();
    run(&mut world, 1);
    let at: Vector3<f64> = nalgebra::convert(start.translation.vector);
    let place = roads().nearest(at.into(), LaneTypes::DRIVING).unwrap();
    let limit_mps = roads().speed_limit_mps(&place).unwrap() as f32;
    assert_eq!(world.frame().actor(car).unwrap().speed_limit_mps, limit_mps);
}

/// Two roads that cross in a junction; a sign of this type stands on the way to the east.
fn signed_crossing(sign: &str) -> Arc<Map> {
    let road =
        |id: u32, junction: i32, [x, y, hdg, length]: [f64; 4], link: &str, signals: &str| {
            format!(
                "<road id=\"{id}\" length=\"{length}\" junction=\"{junction}\"><link>{link}</link>\
             <planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\">\
             <line/></geometry></planView><lanes><laneSection s=\"0\">\
             <center><lane id=\"0\" type=\"none\"/></center><right>\
             <lane id=\"-1\" type=\"driving\">\
             <link><predecessor id=\"-1\"/><successor id=\"-1\"/></link>\
             <width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/></lane></right>\
             </laneSection></lanes><signals>{signals}</signals></road>"
            )
        };
    let north = std::f64::consts::FRAC_PI_2;
    let to = |way: &str, kind: &str, id: u32, end: &str| {
        format!("<{way} elementType=\"{kind}\" elementId=\"{id}\" contactPoint=\"{end}\"/>")
    };
    let into = to("successor", "junction", 9, "start");
    let through = |from: u32, on: u32| {
        to("predecessor", "road", from, "end") + &to("successor", "road", on, "start")
    };
    let sign = format!(
        "<signal id=\"77\" s=\"3\" t=\"-5\" type=\"{sign}\" subtype=\"-1\" country=\"OpenDRIVE\" \
         dynamic=\"no\" orientation=\"-\" zOffset=\"2\" value=\"-1\" name=\"\"/>"
    );
    let connection = |id: u32, from: u32, way: u32| {
        format!(
            "<connection id=\"{id}\" incomingRoad=\"{from}\" connectingRoad=\"{way}\" \
             contactPoint=\"start\"><laneLink from=\"-1\" to=\"-1\"/></connection>"
        )
    };
    let text = [
        "<OpenDRIVE><header/>".to_owned(),
        road(1, -1, [-70.0, 2.0, 0.0, 60.0], &into, ""),
        road(2, -1, [10.0, 2.0, 0.0, 60.0], &to("predecessor", "junction", 9, "end"), ""),
        road(3, -1, [-2.0, -70.0, north, 60.0], &into, ""),
        road(4, -1, [-2.0, 10.0, north, 60.0], &to("predecessor", "junction", 9, "end"), ""),
        road(10, 9, [-10.0, 2.0, 0.0, 20.0], &through(1, 2), &sign),
        road(11, 9, [-2.0, -10.0, north, 20.0], &through(3, 4), ""),
        format!("<junction id=\"9\">{}{}</junction>", connection(0, 1, 10), connection(1, 3, 11)),
        "</OpenDRIVE>".to_owned(),
    ];
    Arc::new(Map::parse("signed crossing", &text.concat()).unwrap())
}

#[test]
fn a_sign_on_a_way_through_a_junction_holds_a_vehicle_while_others_cross() {
    for (sign, holds_at_first) in [("205", false), ("206", true)] {
        let map = Arc::new(Town::new(signed_crossing(sign)));
        let mut world = World::with_traffic(WorldConfig { map, ..config() }).unwrap();
        let spawn = |world: &mut World, x: f32, y: f32, yaw_rad: f32| {
            let pose = schemas::level_pose(Vec3::new(x, y, 0.3), yaw_rad);
            let car = Command::spawn("vehicle.lincoln.mkz", pose, Vec3::zeros());
            let actor = world.apply(&car).unwrap().unwrap();
            let control = schemas::VehicleControl { brake: 1.0, ..Default::default() };
            world.apply(&Command::Vehicle(VehicleCommand::Control { actor, control })).unwrap();
            actor
        };
        let frame = world.frame();
        let sign = frame.actors.iter().find(|actor| actor.kind == ActorKind::TrafficSign);
        let sign = sign.unwrap().id;
        let car = spawn(&mut world, -9.0, 0.0, 0.0);
        let holder = |world: &World| world.frame().actor(car).unwrap().traffic_light;
        run(&mut world, 5);
        assert_eq!(holder(&world), holds_at_first.then_some(sign));
        // Long enough for it to sleep.
        run(&mut world, 80);
        assert_eq!(holder(&world), None);
        // On the way that crosses, and before the junction.
        for y in [-4.0, -14.0] {
            let other = spawn(&mut world, 0.0, y, std::f32::consts::FRAC_PI_2);
            run(&mut world, 80);
            assert_eq!(holder(&world), Some(sign), "{y}");
            world.apply(&Command::DestroyActor { actor: other }).unwrap();
            run(&mut world, 2);
            assert_eq!(holder(&world), None, "{y}");
        }
        // Who comes from the same road, and who is far away, goes first in nothing.
        spawn(&mut world, -20.0, 0.0, 0.0);
        spawn(&mut world, 0.0, -40.0, std::f32::consts::FRAC_PI_2);
        run(&mut world, 10);
        assert_eq!(holder(&world), None);
        let broken = world.rules_broken().map(|(_, broken)| broken.stop_signs).sum::<u32>();
        assert_eq!(broken, 0);
    }
}
