//! A line that several lights have, each for another way through the junction.

use std::sync::Arc;

use roads::Map;
use schemas::{
    BodyCommand, Command, TrafficLightColour as Colour, TrafficLightCommand, Vec3, level_pose,
};
use world::{Town, World, WorldConfig};

use crate::support::{config, run, set_colour};

/// A road to the east that leads straight on and to the left through a junction. A light holds
/// each way, 1 and 2, each with a controller of its own; the map names one of them first.
fn fork(left_first: bool) -> Arc<Map> {
    let to = |way: &str, kind: &str, id: u32, end: &str| {
        format!("<{way} elementType=\"{kind}\" elementId=\"{id}\" contactPoint=\"{end}\"/>")
    };
    let into = to("successor", "junction", 9, "start");
    let out = to("predecessor", "junction", 9, "end");
    let through =
        |on: u32| to("predecessor", "road", 1, "end") + &to("successor", "road", on, "start");
    let connection = |id: u32, way: u32| {
        format!(
            "<connection id=\"{id}\" incomingRoad=\"1\" connectingRoad=\"{way}\" \
             contactPoint=\"start\"><laneLink from=\"-1\" to=\"-1\"/></connection>"
        )
    };
    let controller = |id: u32| {
        format!("<controller id=\"{id}\"><control signalId=\"{id}\" type=\"0\"/></controller>")
    };
    let mut ways = [
        road(11, 9, [-10.0, 2.0, 0.0, 20.0, 0.0], &through(2), Some(1)),
        road(12, 9, [-10.0, 2.0, 0.0, 31.416, 0.05], &through(3), Some(2)),
    ];
    if left_first {
        ways.reverse();
    }
    let text = [
        "<OpenDRIVE><header/>".to_owned(),
        road(1, -1, [-70.0, 2.0, 0.0, 60.0, 0.0], &into, None),
        road(2, -1, [10.0, 2.0, 0.0, 90.0, 0.0], &out, None),
        road(3, -1, [10.0, 22.0, std::f64::consts::FRAC_PI_2, 60.0, 0.0], &out, None),
        ways.concat(),
        controller(1),
        controller(2),
        "<junction id=\"9\" name=\"\">".to_owned(),
        connection(0, 11),
        connection(1, 12),
        "<controller id=\"1\" type=\"0\"/><controller id=\"2\" type=\"0\"/>".to_owned(),
        "</junction></OpenDRIVE>".to_owned(),
    ];
    Arc::new(Map::parse("fork", &text.concat()).unwrap())
}

/// One lane of 4 m on the right, along x, y, heading, length and curvature, with a light at its
/// beginning.
fn road(id: u32, junction: i32, plan: [f64; 5], link: &str, light: Option<u32>) -> String {
    let [x, y, hdg, length, bend] = plan;
    let signal = light.map_or(String::new(), |light| {
        format!(
            "<signal id=\"{light}\" s=\"0\" t=\"-5\" type=\"1000001\" subtype=\"-1\" \
             country=\"OpenDRIVE\" dynamic=\"yes\" orientation=\"+\" zOffset=\"5\" value=\"-1\" \
             name=\"\"><validity fromLane=\"-1\" toLane=\"-1\"/></signal>"
        )
    });
    format!(
        "<road id=\"{id}\" length=\"{length}\" junction=\"{junction}\"><link>{link}</link>\
         <planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\">\
         <arc curvature=\"{bend}\"/></geometry></planView><lanes><laneSection s=\"0\">\
         <center><lane id=\"0\" type=\"none\"/></center><right><lane id=\"-1\" type=\"driving\">\
         <link><predecessor id=\"-1\"/><successor id=\"-1\"/></link>\
         <width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes>\
         <signals>{signal}</signals></road>"
    )
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
