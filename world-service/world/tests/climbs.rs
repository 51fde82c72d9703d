//! Goal: drivers get on where the road is steep. Method: cars that stand in a queue on a climb of
//! 36 %, as there are on CARLA's Town03, are handed over to drivers; beyond it the road goes down
//! as steeply.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

use std::collections::BTreeSet;
use std::sync::Arc;

use roads::Map;
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, Command, Pose, TrafficCommand,
    UnitQuaternion, Vec3, WorldId,
};
use world::{Town, World, WorldConfig};

const CARS: [&str; 5] = [
    "vehicle.lincoln.mkz",
    "vehicle.dodge.charger",
    "vehicle.tesla.model3",
    "vehicle.nissan.patrol",
    "vehicle.audi.tt",
];
const LANE_Y_M: f32 = -1.75;
/// The first car stands here on the climb or on the way down, the others behind it.
const CLIMB_X_M: f32 = 95.0;
const DOWN_X_M: f32 = 200.0;
const APART_M: f32 = 10.0;
/// Beyond the way down.
const BEYOND_X_M: f32 = 230.0;
const TICKS_MAX: usize = 2_400;

/// A lane of 600 m that climbs by 36 % from 40 to 110 m, and goes down as steeply from 140 to
/// 210 m, with 20 m of way for each change of the slope before.
fn hill() -> World {
    let pieces = [
        (0.0, 0.0, 0.0, 0.0),
        (20.0, 0.0, 0.0, 0.009),
        (40.0, 3.6, 0.36, 0.0),
        (110.0, 28.8, 0.36, -0.012),
        (140.0, 28.8, -0.36, 0.0),
        (210.0, 3.6, -0.36, 0.009),
        (230.0, 0.0, 0.0, 0.0),
    ];
    let pieces = pieces.map(|(s, a, b, c)| {
        format!("<elevation s=\"{s}\" a=\"{a}\" b=\"{b}\" c=\"{c}\" d=\"0\"/>")
    });
    let text = format!(
        "<OpenDRIVE><header/><road id=\"1\" length=\"600\" junction=\"-1\"><link/><planView>\
         <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"600\"><line/></geometry></planView>\
         <elevationProfile>{}</elevationProfile><lanes><laneSection s=\"0\">\
         <center><lane id=\"0\" type=\"none\"/></center><right>\
         <lane id=\"-1\" type=\"driving\">\
         <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right>\
         </laneSection></lanes></road></OpenDRIVE>",
        pieces.concat()
    );
    let map = Arc::new(Town::new(Arc::new(Map::parse("hill", &text).unwrap())));
    let id = WorldId::new(1).unwrap();
    World::new(WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map }).unwrap()
}

/// Cars at rest on the climb, or on the way down.
fn queue(world: &mut World, kinds: &[&str], first_x_m: f32) -> Vec<ActorId> {
    let slope: f32 = if first_x_m < 125.0 { 0.36 } else { -0.36 };
    let place = |index: usize| {
        let x_m = first_x_m - APART_M * index as f32;
        let from_m = if slope > 0.0 { x_m - 40.0 } else { 210.0 - x_m };
        let z_m = 3.6 + 0.36 * from_m + 0.05;
        let rotation = UnitQuaternion::from_euler_angles(0.0, -slope.atan(), 0.0);
        Pose::from_parts(Vec3::new(x_m, LANE_Y_M, z_m).into(), rotation)
    };
    let mut put = |(index, kind): (usize, &&str)| {
        world.apply(&Command::spawn(*kind, place(index), Vec3::zeros())).unwrap().unwrap()
    };
    kinds.iter().enumerate().map(&mut put).collect()
}

fn join(world: &mut World, cars: &[ActorId], behaviour: AgentBehaviour) {
    for actor in cars {
        let join = TrafficCommand::Join { actor: *actor, behaviour };
        world.apply(&Command::Traffic(join)).unwrap();
    }
}

/// Drives until all have passed the hill, or long enough; who has.
fn drive(world: &mut World, who: &str) -> BTreeSet<ActorId> {
    let mut passed = BTreeSet::new();
    for _ in 0..TICKS_MAX {
        world.tick().unwrap();
        let hits = world.collisions();
        assert!(hits.is_empty(), "{who}: {hits:?}");
        let beyond = |x_m: f32| x_m > BEYOND_X_M;
        let frame = world.frame();
        let cars = frame.actors.iter();
        let there = cars.filter(|car| beyond(car.world_from_actor.translation.vector.x));
        passed.extend(there.map(|car| car.id));
        if passed.len() == CARS.len() {
            break;
        }
    }
    passed
}

#[test]
fn traffic_that_stands_in_a_queue_on_a_steep_hill_gets_off_it_and_touches_nobody() {
    let behaviours = [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Aggressive];
    for behaviour in behaviours {
        for first_x_m in [CLIMB_X_M, DOWN_X_M] {
            let mut world = hill();
            let cars = queue(&mut world, &CARS, first_x_m);
            join(&mut world, &cars, behaviour);
            let passed = drive(&mut world, &format!("{behaviour:?} from {first_x_m} m"));
            assert_eq!(passed, cars.into_iter().collect(), "{behaviour:?} from {first_x_m} m");
        }
    }
}

#[test]
fn agents_in_a_queue_on_a_steep_climb_get_over_it_and_touch_nobody() {
    for behaviour in [AgentBehaviour::Cautious, AgentBehaviour::Normal] {
        let mut world = hill();
        let cars = queue(&mut world, &CARS, CLIMB_X_M);
        for actor in &cars {
            let options = AgentOptions { behaviour, ..AgentOptions::default() };
            let set = AgentCommand::Set { actor: *actor, options, keep_route: false };
            world.apply(&Command::Agent(set)).unwrap();
            let drive = AgentCommand::Drive { actor: *actor, on: true };
            world.apply(&Command::Agent(drive)).unwrap();
        }
        let passed = drive(&mut world, &format!("{behaviour:?}"));
        assert_eq!(passed, cars.into_iter().collect(), "{behaviour:?}");
    }
}

/// Goal: an engine too weak for a climb is no danger to those behind. Method: a quadricycle stands
/// on it, in front of a car.
#[test]
fn who_cannot_start_on_a_climb_stands_and_does_not_roll_back() {
    let mut world = hill();
    let cars = queue(&mut world, &["vehicle.micro.microlino", "vehicle.lincoln.mkz"], CLIMB_X_M);
    join(&mut world, &cars, AgentBehaviour::Normal);
    let x_m = |world: &World| {
        let frame = world.frame();
        frame.actor(cars[0]).unwrap().world_from_actor.translation.vector.x
    };
    let began_m = x_m(&world);
    assert!(drive(&mut world, "quadricycle").is_empty(), "it gets over the hill");
    let rolled_m = began_m - x_m(&world);
    assert!(rolled_m < 0.5, "it rolled back by {rolled_m} m");
}

/// Goal: nobody takes a climb that it cannot start on where another way leads on. Method: a road
/// forks into a climb of 25 % and a level way; bicycles, and a motorcycle for which both will do,
/// come to it with many seeds.
#[test]
fn a_bicycle_takes_the_level_way_where_the_other_one_climbs_too_steeply() {
    let climbs = |kind: &str, seed: u64| {
        let mut world = fork(seed);
        let pose = Pose::translation(20.0, LANE_Y_M, 0.05);
        let actor = world.apply(&Command::spawn(kind, pose, Vec3::zeros())).unwrap().unwrap();
        join(&mut world, &[actor], AgentBehaviour::Normal);
        let place =
            |world: &World| world.frame().actor(actor).unwrap().world_from_actor.translation.vector;
        let through = (0..TICKS_MAX).any(|_| {
            world.tick().unwrap();
            place(&world).x > 155.0
        });
        assert!(through, "{kind}, seed {seed}: {}", place(&world));
        place(&world).z > 0.5
    };
    let count = |kind: &str| (1..=8).filter(|seed| climbs(kind, *seed)).count();
    assert_eq!(count("vehicle.diamondback.century"), 0);
    let motorcycles = count("vehicle.kawasaki.ninja");
    assert!((1..8).contains(&motorcycles), "{motorcycles} of 8");
}

/// A road of 100 m that forks into two lanes side by side in the end: straight on up a climb, and
/// to the right on level ground.
fn fork(seed: u64) -> World {
    let lane = "<lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center><right>\
                <lane id=\"-1\" type=\"driving\"><link><predecessor id=\"-1\"/>\
                <successor id=\"-1\"/></link>\
                <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes>";
    let line = |x: f64, y: f64, length: f64| {
        format!(
            "<planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"0\" length=\"{length}\"><line/>\
             </geometry></planView>"
        )
    };
    let link = |before: &str, after: &str| {
        let to = |tag: &str, id: &str, contact: &str| match id {
            "" => String::new(),
            "9" => format!("<{tag} elementType=\"junction\" elementId=\"9\"/>"),
            _ => format!(
                "<{tag} elementType=\"road\" elementId=\"{id}\" contactPoint=\"{contact}\"/>"
            ),
        };
        format!(
            "<link>{}{}</link>",
            to("predecessor", before, "end"),
            to("successor", after, "start")
        )
    };
    let climb = "<elevationProfile><elevation s=\"0\" a=\"0\" b=\"0\" c=\"0.00625\" d=\"0\"/>\
                 <elevation s=\"20\" a=\"2.5\" b=\"0.25\" c=\"0\" d=\"0\"/></elevationProfile>";
    let aside = "<planView><geometry s=\"0\" x=\"100\" y=\"0\" hdg=\"0\" length=\"31.6\">\
                 <paramPoly3 pRange=\"normalized\" aU=\"0\" bU=\"30\" cU=\"0\" dU=\"0\" aV=\"0\" \
                 bV=\"0\" cV=\"-24\" dV=\"16\"/></geometry></planView>";
    let road = |id: u8, junction: i8, length: f64, inner: &str| {
        format!(
            "<road id=\"{id}\" length=\"{length}\" junction=\"{junction}\">{inner}{lane}</road>"
        )
    };
    let text = format!(
        "<OpenDRIVE><header/>{}{}{}{}{}<junction id=\"9\" name=\"\">\
         <connection id=\"0\" incomingRoad=\"1\" connectingRoad=\"2\" contactPoint=\"start\">\
         <laneLink from=\"-1\" to=\"-1\"/></connection>\
         <connection id=\"1\" incomingRoad=\"1\" connectingRoad=\"3\" contactPoint=\"start\">\
         <laneLink from=\"-1\" to=\"-1\"/></connection></junction></OpenDRIVE>",
        road(1, -1, 100.0, &(link("", "9") + &line(0.0, 0.0, 100.0))),
        road(2, 9, 30.0, &(link("1", "4") + &line(100.0, 0.0, 30.0))),
        road(3, 9, 31.6, &(link("1", "5") + aside)),
        road(4, -1, 80.0, &(link("9", "") + &line(130.0, 0.0, 80.0) + climb)),
        road(5, -1, 80.0, &(link("9", "") + &line(130.0, -8.0, 80.0))),
    );
    let map = Arc::new(Town::new(Arc::new(Map::parse("fork", &text).unwrap())));
    let id = WorldId::new(1).unwrap();
    World::new(WorldConfig { id, epoch: 1, seed, dt_secs: 0.05, map }).unwrap()
}

/// Goal: a motorcycle stays upright where its way crosses a higher road of the same junction, as on
/// CARLA's Town03. Method: the other road lies 0.4 m higher there.
#[test]
fn a_motorcycle_crosses_a_higher_road_of_the_junction_upright() {
    let road = |id: u8,
                junction: i8,
                link: &str,
                [x, y, hdg, length]: [f64; 4],
                elevation: &str| {
        format!(
            "<road id=\"{id}\" length=\"{length}\" junction=\"{junction}\"><link>{link}</link><planView>\
             <geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\"><line/></geometry>\
             </planView><elevationProfile>{elevation}</elevationProfile><lanes><laneSection s=\"0\">\
             <center><lane id=\"0\" type=\"none\"/></center><right><lane id=\"-1\" type=\"driving\">\
             <link><predecessor id=\"-1\"/><successor id=\"-1\"/></link>\
             <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes></road>"
        )
    };
    let on = "<successor elementType=\"junction\" elementId=\"9\"/>";
    let off = "<predecessor elementType=\"junction\" elementId=\"9\"/>";
    let through = "<predecessor elementType=\"road\" elementId=\"1\" contactPoint=\"end\"/>\
                   <successor elementType=\"road\" elementId=\"3\" contactPoint=\"start\"/>";
    let hump = "<elevation s=\"0\" a=\"0\" b=\"0\" c=\"0.01875\" d=\"-0.0015625\"/>\
                <elevation s=\"8\" a=\"0.4\" b=\"0\" c=\"0\" d=\"0\"/>\
                <elevation s=\"22\" a=\"0.4\" b=\"0\" c=\"-0.01875\" d=\"0.0015625\"/>";
    let north = std::f64::consts::FRAC_PI_2;
    let text = format!(
        "<OpenDRIVE><header/>{}{}{}{}<junction id=\"9\" name=\"\">\
         <connection id=\"0\" incomingRoad=\"1\" connectingRoad=\"2\" contactPoint=\"start\">\
         <laneLink from=\"-1\" to=\"-1\"/></connection></junction></OpenDRIVE>",
        road(1, -1, on, [0.0, 0.0, 0.0, 100.0], ""),
        road(2, 9, through, [100.0, 0.0, 0.0, 30.0], ""),
        road(3, -1, off, [130.0, 0.0, 0.0, 100.0], ""),
        road(4, 9, "", [115.0, -15.0, north, 30.0], hump),
    );
    let map = Arc::new(Town::new(Arc::new(Map::parse("hump", &text).unwrap())));
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map };
    let mut world = World::new(config).unwrap();
    let (kind, pose) = ("vehicle.vespa.zx125", Pose::translation(20.0, LANE_Y_M, 0.05));
    let actor = world.apply(&Command::spawn(kind, pose, Vec3::zeros())).unwrap().unwrap();
    join(&mut world, &[actor], AgentBehaviour::Normal);
    let through = (0..TICKS_MAX).any(|_| {
        world.tick().unwrap();
        let pose = world.frame().actor(actor).unwrap().world_from_actor;
        let up = pose.rotation * Vec3::z();
        assert!(up.z > 0.95, "{pose}");
        pose.translation.vector.x > 150.0
    });
    assert!(through);
}
