//! Who goes first at crossings and roundabouts without lights.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;
mod ways;

use std::sync::Arc;

use common::*;
use roads::{LaneTypes, Map};
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, Command, TrafficCommand, Vec3,
    VehicleControl, level_pose,
};
use ways::{Way, straight, world_with};
use world::World;

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
    world_with(&crossing_ways(signs))
}

/// The same, without signs, where traffic keeps to the left.
fn crossing_on_the_left() -> (World, Arc<Map>) {
    let ways = crossing_ways([None; 4]);
    let on_the_left = |way: Way| Way { keeps_left: true, ..way };
    world_with(&ways.into_iter().map(on_the_left).collect::<Vec<Way>>())
}

/// The same with ways through it whose lanes are cut into two sections.
fn crossing_of_sections(signs: [Option<&'static str>; 4]) -> (World, Arc<Map>) {
    let ways = crossing_ways(signs);
    let cut = |way: Way| Way { is_cut: way.junction >= 0, ..way };
    world_with(&ways.into_iter().map(cut).collect::<Vec<Way>>())
}

fn crossing_ways(signs: [Option<&'static str>; 4]) -> Vec<Way> {
    let way = |id: u32, side: u32, ahead_m: f64, length_m: f64| {
        let (from_m, heading_rad) = beside_crossing(side, ahead_m);
        straight(id, from_m, heading_rad, length_m)
    };
    let sides = (0..4).zip(signs);
    sides
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
        .collect()
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
fn where_traffic_keeps_to_the_left_who_comes_from_the_left_goes_first() {
    for is_agent in [false, true] {
        for right_is_older in [false, true] {
            let (mut world, roads) = crossing_on_the_left();
            let mut sides = [0, 1];
            if right_is_older {
                sides.reverse();
            }
            let mut cars = sides.map(|side| comes(&mut world, side, 60.0, is_agent));
            if right_is_older {
                cars.reverse();
            }
            let found = first(&mut world, &roads, cars);
            assert_eq!(found, cars[0].0, "agents {is_agent}, {right_is_older}");
        }
    }
    for (other, taken) in [(3, 1), (1, 0)] {
        let (mut world, _) = crossing_on_the_left();
        comes(&mut world, other, 70.0, false);
        let rolls = rolls(&mut world, 0, 60.0);
        run(&mut world, 240);
        assert_eq!(right_of_way_taken(&world, rolls), taken, "from side {other}");
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
fn who_rolls_in_behind_somebody_that_is_past_takes_nothing() {
    /// How far from the crossing's middle cars are whose front comes into the junction, or whose
    /// rear leaves it.
    const ENTRY_M: f32 = 12.3;
    const LEAVES_M: f32 = -ENTRY_M;
    let (mut before, mut behind) = (0, 0);
    for ahead_m in (50..110).step_by(2) {
        let (mut world, _) = crossing([None; 4]);
        let (other, _) = comes(&mut world, 1, 66.0, false);
        let rolls = rolls(&mut world, 0, f64::from(ahead_m));
        while position_m(&world, rolls).y < -ENTRY_M {
            run(&mut world, 1);
        }
        let other_x_m = position_m(&world, other).x;
        run(&mut world, 40);
        let taken = right_of_way_taken(&world, rolls);
        match other_x_m {
            // It is still to come, and goes first.
            15.0..35.0 => {
                before += 1;
                assert_eq!(taken, 1, "from {ahead_m} m, the other at {other_x_m} m");
            }
            // Its rear has left the way of who rolls in, but not the junction.
            LEAVES_M..-3.5 => {
                behind += 1;
                assert_eq!(taken, 0, "from {ahead_m} m, the other at {other_x_m} m");
            }
            _ => {}
        }
    }
    assert!(before > 2 && behind > 2, "{before} before it, {behind} behind it");
}

#[test]
fn a_junction_of_several_sections_is_entered_once() {
    for (other, signs, taken) in
        [(1, [None; 4], 1), (3, [None; 4], 0), (3, [Some("205"), None, None, None], 1)]
    {
        let (mut world, _) = crossing_of_sections(signs);
        comes(&mut world, other, 70.0, false);
        let rolls = rolls(&mut world, 0, 60.0);
        run(&mut world, 240);
        assert_eq!(right_of_way_taken(&world, rolls), taken, "from side {other}, {signs:?}");
    }
    let (mut world, _) = crossing_of_sections([Some("206"), None, None, None]);
    let rolls = rolls(&mut world, 0, 60.0);
    run(&mut world, 240);
    assert_eq!(world.frame().broken_by(rolls).map(|broken| broken.stop_signs), Some(1));
}

#[test]
fn traffic_and_agents_break_no_rule_at_signs() {
    let (mut world, roads) = crossing([None, Some("206"), None, Some("205")]);
    let cars = [0, 1, 2, 3].map(|side| comes(&mut world, side, 60.0, side % 2 == 0));
    order(&mut world, &roads, &cars, 1_000);
    assert_eq!(world.frame().rules_broken, []);
}
