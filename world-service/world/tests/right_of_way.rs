//! Who goes first at crossings and roundabouts without lights.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::fmt::Write as _;
use std::sync::Arc;

use common::*;
use roads::{LaneTypes, Map};
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, Command, TrafficCommand, Vec3,
    VehicleControl, WorldId, level_pose,
};
use world::{Town, World, WorldConfig};

/// One lane 3.5 m wide around a reference line that is one line or arc.
struct Way {
    id: u32,
    from_m: (f64, f64),
    heading_rad: f64,
    curvature_per_m: f64,
    length_m: f64,
    junction: i32,
    before: Option<u32>,
    after: Option<u32>,
    /// Type of a sign at its end.
    sign: Option<&'static str>,
}

impl Way {
    fn xodr(&self) -> String {
        let link = |tag: &str, id: Option<u32>, contact: &str| {
            let to_junction = || self.junction < 0 && tag == "successor";
            id.map_or_else(String::new, |id| match to_junction() {
                true => format!("<{tag} elementType=\"junction\" elementId=\"{id}\"/>"),
                false => format!(
                    "<{tag} elementType=\"road\" elementId=\"{id}\" contactPoint=\"{contact}\"/>"
                ),
            })
        };
        let inside = self.junction >= 0;
        let lane_link =
            if inside { "<link><predecessor id=\"-1\"/><successor id=\"-1\"/></link>" } else { "" };
        let shape = match self.curvature_per_m {
            0.0 => "<line/>".to_owned(),
            curvature => format!("<arc curvature=\"{curvature}\"/>"),
        };
        let sign = self.sign.map_or_else(String::new, |kind| {
            format!(
                "<signal id=\"9\" name=\"sign\" s=\"{}\" t=\"-3\" zOffset=\"0\" orientation=\"-\" \
                 type=\"{kind}\" subtype=\"-1\" country=\"OpenDRIVE\" value=\"-1\" dynamic=\"no\">\
                 <validity fromLane=\"-1\" toLane=\"-1\"/></signal>",
                self.length_m - 1.0
            )
        });
        format!(
            "<road name=\"{0}\" length=\"{1}\" id=\"{0}\" junction=\"{2}\"><link>{3}{4}</link>\
             <planView><geometry s=\"0\" x=\"{5}\" y=\"{6}\" hdg=\"{7}\" length=\"{1}\">{shape}\
             </geometry></planView><lanes><laneOffset s=\"0\" a=\"1.75\" b=\"0\" c=\"0\" d=\"0\"/>\
             <laneSection s=\"0\"><center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\
             <right><lane id=\"-1\" type=\"driving\" level=\"false\">{lane_link}\
             <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection>\
             </lanes><signals>{sign}</signals></road>",
            self.id,
            self.length_m,
            self.junction,
            link("predecessor", self.before, "end"),
            link("successor", self.after, "start"),
            self.from_m.0,
            self.from_m.1,
            self.heading_rad
        )
    }
}

/// Roads, and the ways that lead from one to another through junctions.
fn world_with(ways: &[Way]) -> (World, Arc<Map>) {
    let mut text = "<?xml version=\"1.0\"?><OpenDRIVE><header revMajor=\"1\" revMinor=\"4\" \
                    name=\"crossing\" version=\"1\" north=\"0\" south=\"0\" east=\"0\" west=\"0\"/>"
        .to_owned();
    text.extend(ways.iter().map(Way::xodr));
    let mut junctions: Vec<i32> =
        ways.iter().map(|way| way.junction).filter(|id| *id >= 0).collect();
    junctions.dedup();
    for junction in junctions {
        write!(text, "<junction id=\"{junction}\" name=\"{junction}\">").unwrap();
        for (index, way) in ways.iter().filter(|way| way.junction == junction).enumerate() {
            let (incoming, id) = (way.before.unwrap(), way.id);
            write!(
                text,
                "<connection id=\"{index}\" incomingRoad=\"{incoming}\" connectingRoad=\"{id}\" \
                 contactPoint=\"start\"><laneLink from=\"-1\" to=\"-1\"/></connection>"
            )
            .unwrap();
        }
        text.push_str("</junction>");
    }
    text.push_str("</OpenDRIVE>");
    let roads = Arc::new(Map::parse("crossing", &text).unwrap());
    let (id, map) = (WorldId::new(1).unwrap(), Arc::new(Town::new(Arc::clone(&roads))));
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map };
    (World::with_traffic(config).unwrap(), roads)
}

/// A car at a place, driven by an agent or by traffic.
fn driven(world: &mut World, place_m: (f32, f32), heading_rad: f32, is_agent: bool) -> ActorId {
    let pose = level_pose(Vec3::new(place_m.0, place_m.1, 0.0), heading_rad);
    let actor = spawn_at(world, "vehicle.lincoln.mkz", pose, 8.0);
    let behaviour = AgentBehaviour::Normal;
    if is_agent {
        let options = AgentOptions { behaviour, ..AgentOptions::default() };
        let keep_route = false;
        world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route })).unwrap();
        world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
    } else {
        world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour })).unwrap();
    }
    actor
}

/// Cars in the order in which they come onto the roads that they are to reach, all of them without
/// a contact.
fn order(world: &mut World, roads: &Map, goals: &[(ActorId, u32)], ticks: u32) -> Vec<ActorId> {
    let mut reached: Vec<ActorId> = Vec::new();
    for _ in 0..ticks {
        let hits = run(world, 1);
        assert!(hits.is_empty(), "{hits:?}");
        for &(actor, road) in goals {
            let at_m = position_m(world, actor).cast::<f64>();
            let lane = roads.nearest(at_m.into(), LaneTypes::DRIVING).unwrap();
            if lane.road == road && !reached.contains(&actor) {
                reached.push(actor);
            }
        }
    }
    assert_eq!(reached.len(), goals.len(), "all drive on");
    reached
}

/// Which of two cars comes first onto the road that it is to reach, without a contact.
fn first(world: &mut World, roads: &Map, goals: [(ActorId, u32); 2]) -> ActorId {
    order(world, roads, &goals, 600)[0]
}

const UP: f64 = std::f64::consts::FRAC_PI_2;

fn straight(id: u32, from_m: (f64, f64), heading_rad: f64, length_m: f64) -> Way {
    let (curvature_per_m, junction, before, after, sign) = (0.0, -1, None, None, None);
    Way { id, from_m, heading_rad, curvature_per_m, length_m, junction, before, after, sign }
}

/// A ring of 20 m around the origin, driven around to the left, with a road onto it from the south.
/// Roads 1 and 2 are of the ring, road 3 leads to it.
fn roundabout() -> (World, Arc<Map>) {
    const RADIUS_M: f64 = 20.0;
    let on_ring = |id: u32, from_deg: f64, to_deg: f64| {
        let from_rad = from_deg.to_radians();
        let from_m = (RADIUS_M * from_rad.cos(), RADIUS_M * from_rad.sin());
        let length_m = RADIUS_M * (to_deg - from_deg).to_radians();
        let curvature_per_m = 1.0 / RADIUS_M;
        Way { curvature_per_m, ..straight(id, from_m, from_rad + UP, length_m) }
    };
    let through = |way: Way, junction, before, after| Way {
        junction,
        before: Some(before),
        after: Some(after),
        ..way
    };
    // Up along the road from the south, and to the right by 70° within 15 m onto the ring.
    let entry = Way { curvature_per_m: -1.0 / 15.0, ..straight(13, (-3.03, -32.89), UP, 18.326) };
    world_with(&[
        Way { after: Some(100), ..on_ring(1, -70.0, 70.0) },
        Way { after: Some(200), ..on_ring(2, 110.0, 250.0) },
        Way { after: Some(200), ..straight(3, (-3.03, -132.89), UP, 100.0) },
        through(on_ring(11, 70.0, 110.0), 100, 1, 2),
        through(on_ring(12, 250.0, 290.0), 200, 2, 1),
        through(entry, 200, 3, 1),
    ])
}

#[test]
fn who_is_on_a_roundabout_goes_before_who_comes_from_the_right_onto_it() {
    for is_agent in [true, false] {
        let (mut world, roads) = roundabout();
        let around = driven(&mut world, (-20.0, 0.0), -UP as f32, is_agent);
        let enters = driven(&mut world, (-3.03, -58.0), UP as f32, is_agent);
        let found = first(&mut world, &roads, [(around, 1), (enters, 1)]);
        assert_eq!(found, around, "agents {is_agent}");
    }
}

/// Where a road of the crossing begins, `ahead_m` before its middle as traffic comes to it from a
/// side: 0 from the south, 1 from the east, and on around to the left. Who comes from the next side
/// comes from the right.
fn beside_crossing(side: u32, ahead_m: f64) -> ((f64, f64), f64) {
    let heading_rad = UP * (1.0 + f64::from(side));
    let (sin, cos) = heading_rad.sin_cos();
    ((-ahead_m * cos + 1.75 * sin, -ahead_m * sin - 1.75 * cos), heading_rad)
}

/// Four roads that meet at right angles: road 1 to 4 lead to the crossing from the four sides, the
/// straight ways on lead to 5 to 8. Signs of these types stand at their ends.
fn crossing(signs: [Option<&'static str>; 4]) -> (World, Arc<Map>) {
    let way = |id: u32, side: u32, ahead_m: f64, length_m: f64| {
        let (from_m, heading_rad) = beside_crossing(side, ahead_m);
        straight(id, from_m, heading_rad, length_m)
    };
    let sides = (0..4).zip(signs);
    let ways: Vec<Way> = sides
        .flat_map(|(side, sign)| {
            let [to, on, within] = [1 + side, 5 + side, 11 + side];
            [
                Way { after: Some(100), sign, ..way(to, side, 110.0, 100.0) },
                way(on, side, -10.0, 100.0),
                Way {
                    junction: 100,
                    before: Some(to),
                    after: Some(on),
                    ..way(within, side, 10.0, 20.0)
                },
            ]
        })
        .collect();
    world_with(&ways)
}

/// A car that comes to the crossing from a side at 8 m/s, and the road that it is to reach.
fn comes(world: &mut World, side: u32, ahead_m: f64, is_agent: bool) -> (ActorId, u32) {
    let ((x, y), heading_rad) = beside_crossing(side, ahead_m);
    (driven(world, (x as f32, y as f32), heading_rad as f32, is_agent), 5 + side)
}

#[test]
fn of_two_who_come_at_once_who_comes_from_the_right_goes_first() {
    // From how far each comes: as near as the other, or so that it is seen a moment later.
    for (left_m, right_m) in [(60.0, 60.0), (80.0, 80.0), (60.0, 62.0)] {
        for is_agent in [false, true] {
            for right_is_older in [false, true] {
                let (mut world, roads) = crossing([None; 4]);
                let mut at = [(0, left_m), (1, right_m)];
                if right_is_older {
                    at.reverse();
                }
                let mut cars = at.map(|(side, m)| comes(&mut world, side, m, is_agent));
                if right_is_older {
                    cars.reverse();
                }
                let found = first(&mut world, &roads, cars);
                assert_eq!(found, cars[1].0, "{left_m}, {right_m}, {is_agent}, {right_is_older}");
            }
        }
    }
}

#[test]
fn four_who_come_at_once_do_not_wait_for_ever() {
    for (is_agent, sign) in [(false, None), (true, None), (false, Some("206")), (true, Some("206"))]
    {
        let (mut world, roads) = crossing([sign; 4]);
        let cars = [0, 1, 2, 3].map(|side| comes(&mut world, side, 60.0, is_agent));
        order(&mut world, &roads, &cars, 1_000);
    }
}

#[test]
fn who_has_a_sign_lets_others_through_also_from_the_left() {
    for sign in ["205", "206"] {
        for is_agent in [false, true] {
            let (mut world, roads) = crossing([None, Some(sign), None, None]);
            // The one with the sign comes from the right, and sooner.
            let signed = comes(&mut world, 1, 50.0, is_agent);
            let free = comes(&mut world, 0, 60.0, is_agent);
            let found = first(&mut world, &roads, [signed, free]);
            assert_eq!(found, free.0, "{sign}, agents {is_agent}");
        }
    }
}

/// A car that nobody drives, and which rolls on towards the crossing from a side at 8 m/s.
fn rolls(world: &mut World, side: u32, ahead_m: f64) -> ActorId {
    let ((x, y), heading_rad) = beside_crossing(side, ahead_m);
    let pose = level_pose(Vec3::new(x as f32, y as f32, 0.0), heading_rad as f32);
    let actor = spawn_at(world, "vehicle.lincoln.mkz", pose, 8.0);
    control(world, actor, VehicleControl { throttle: 0.25, ..VehicleControl::default() });
    actor
}

fn right_of_way_taken(world: &World, actor: ActorId) -> u32 {
    let frame = world.frame();
    frame.broken_by(actor).map_or(0, |broken| broken.right_of_way)
}

#[test]
fn whoever_drives_in_before_those_who_go_first_is_counted() {
    // From where the other comes, the signs, and whether the one from the south takes its way.
    for (other, signs, taken) in [
        (1, [None; 4], 1),
        (3, [None; 4], 0),
        (2, [None; 4], 0),
        (3, [Some("205"), None, None, None], 1),
        (1, [None, Some("205"), None, None], 0),
    ] {
        let (mut world, _) = crossing(signs);
        comes(&mut world, other, 70.0, false);
        let rolls = rolls(&mut world, 0, 60.0);
        run(&mut world, 240);
        assert_eq!(right_of_way_taken(&world, rolls), taken, "from side {other}, {signs:?}");
    }
}

#[test]
fn traffic_and_agents_break_no_rule_at_signs() {
    let (mut world, roads) = crossing([None, Some("206"), None, Some("205")]);
    let cars = [0, 1, 2, 3].map(|side| comes(&mut world, side, 60.0, side % 2 == 0));
    order(&mut world, &roads, &cars, 1_000);
    assert_eq!(world.frame().rules_broken, []);
}
