//! Drivers where there is little room: on a ring that is full, and in bends tighter than they turn.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::f64::consts::TAU;
use std::sync::Arc;

use common::*;
use roads::{LaneTypes, Map};
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, Command, Pose, TrafficCommand, Vec3,
    level_pose,
};
use world::{Town, World};

const WIDTH_M: f64 = 3.5;

/// Roads one after the other from the origin to the east, each of lines and arcs (length and
/// curvature), with one lane on their right; `closed`: the last one leads to the first.
fn roads(all: &[&[(f64, f64)]], closed: bool) -> Arc<Map> {
    let (mut at, mut text) = ([0.0f64; 3], "<OpenDRIVE><header/>".to_owned());
    for (index, parts) in all.iter().enumerate() {
        let (mut s, mut plan) = (0.0, String::new());
        for (length, bend) in *parts {
            let [x, y, hdg] = at;
            plan += &format!(
                "<geometry s=\"{s}\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\">\
                 <arc curvature=\"{bend}\"/></geometry>"
            );
            let turn = length * bend;
            let chord = if turn == 0.0 { *length } else { 2.0 / bend * (turn / 2.0).sin() };
            let along = hdg + turn / 2.0;
            at = [x + chord * along.cos(), y + chord * along.sin(), hdg + turn];
            s += length;
        }
        let link = |way: &str, other: Option<usize>, end: &str| {
            let id = other.filter(|other| *other < all.len() || closed)? % all.len() + 1;
            Some(format!("<{way} elementType=\"road\" elementId=\"{id}\" contactPoint=\"{end}\"/>"))
        };
        let before = index.checked_sub(1).or(closed.then_some(all.len() - 1));
        let links =
            [link("predecessor", before, "end"), link("successor", Some(index + 1), "start")];
        text += &format!(
            "<road id=\"{}\" length=\"{s}\" junction=\"-1\"><link>{}</link>\
             <planView>{plan}</planView><lanes><laneSection s=\"0\"><center>\
             <lane id=\"0\" type=\"none\"/></center><right><lane id=\"-1\" type=\"driving\">\
             <link><predecessor id=\"-1\"/><successor id=\"-1\"/></link>\
             <width sOffset=\"0\" a=\"{WIDTH_M}\" b=\"0\" c=\"0\" d=\"0\"/></lane></right>\
             </laneSection></lanes></road>",
            index + 1,
            links.into_iter().flatten().collect::<String>()
        );
    }
    Arc::new(Map::parse("tight", &(text + "</OpenDRIVE>")).unwrap())
}

fn hand_over(world: &mut World, actor: ActorId) {
    let behaviour = AgentBehaviour::Normal;
    let options = AgentOptions { behaviour, ..AgentOptions::default() };
    let keep_route = false;
    world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route })).unwrap();
    world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
}

/// Twelve cars at rest on a ring, each nearer to the next one than agents drive up to.
#[test]
fn agents_that_fill_a_ring_close_up_and_go_around() {
    const GAP_M: f64 = 4.5;
    let length_m = f64::from(
        2.0 * {
            let mut world = world();
            let car = car(&mut world, 0.0, 0.0);
            state(&world, car).box_half_extent_m.x
        },
    );
    let around_m = 12.0 * (length_m + GAP_M);
    let radius_m = around_m / TAU - WIDTH_M / 2.0;
    let map = roads(&[&[(TAU * radius_m, 1.0 / radius_m)]], true);
    let mut world = world_on(Arc::new(Town::new(map)), 0.05);
    let cars = (0..12).map(|number| {
        let turn = TAU * f64::from(number) / 12.0;
        let away_m = radius_m + WIDTH_M / 2.0;
        let at_m =
            Vec3::new((away_m * turn.sin()) as f32, (radius_m - away_m * turn.cos()) as f32, 0.2);
        spawn_at(&mut world, "vehicle.lincoln.mkz", level_pose(at_m, turn as f32), 0.0)
    });
    let cars: Vec<ActorId> = cars.collect();
    cars.iter().for_each(|car| hand_over(&mut world, *car));
    run(&mut world, 180);
    assert!(cars.iter().all(|car| speed_mps(&world, *car) < 0.1), "they keep their distance");
    let (mut driven_m, mut hits) = (0.0, 0);
    for _ in 0..1_200 {
        hits += run(&mut world, 1).len();
        driven_m += cars.iter().map(|car| 0.05 * speed_mps(&world, *car)).sum::<f32>();
    }
    assert_eq!(hits, 0);
    assert!(driven_m > 12.0 * 10.0, "{driven_m} m by all of them in a minute");
}

/// How far the middle of a lorry, which turns about 5 m, comes beside that of its lane where this
/// turns about 3.7 m and then about 7.7 m, as one of a town that others drew.
fn beside_m(by_agent: bool, side: f64) -> f64 {
    // The lane is on the right: inside of a turn to the right.
    let right_m = WIDTH_M / 2.0;
    let arc = |radius_m: f64, turn: f64| {
        let own_m = if side < 0.0 { radius_m + right_m } else { radius_m - right_m };
        (own_m * turn, side / own_m)
    };
    let bend = [arc(3.7, 0.96), arc(7.7, 0.59)];
    let map = roads(&[&[(60.0, 0.0)], &bend, &[(80.0, 0.0)]], false);
    let mut world = world_on(Arc::new(Town::new(Arc::clone(&map))), 0.05);
    let start = level_pose(Vec3::new(20.0, -right_m as f32, 0.2), 0.0);
    let actor = spawn_at(&mut world, "vehicle.carlamotors.carlacola", start, 0.0);
    if by_agent {
        hand_over(&mut world, actor);
    } else {
        let behaviour = AgentBehaviour::Normal;
        world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour })).unwrap();
    }
    let (mut worst_m, mut last) = (0.0f64, Pose::identity());
    for _ in 0..400 {
        run(&mut world, 1);
        last = state(&world, actor).world_from_actor;
        let at_m: nalgebra::Vector3<f64> = nalgebra::convert(last.translation.vector);
        let lane = map.pose(&map.nearest(at_m.into(), LaneTypes::DRIVING).unwrap());
        worst_m = worst_m.max(lane.inverse().transform_point(&at_m.into()).y.abs());
    }
    assert!(last.translation.y.abs() > 20.0, "it came out of the bend: {last}");
    worst_m
}

#[test]
fn a_lorry_stays_near_the_middle_of_bends_tighter_than_it_turns() {
    let found_m = [(true, -1.0), (true, 1.0), (false, -1.0), (false, 1.0)]
        .map(|(by_agent, side)| beside_m(by_agent, side));
    let [agent_m, traffic_m] = [found_m[0].max(found_m[1]), found_m[2].max(found_m[3])];
    assert!(agent_m < 0.6 && traffic_m < 0.4, "{found_m:?} m");
}
