//! Navigation agents inside the tick.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::sync::{Arc, LazyLock};

use common::*;
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, AgentState, AgentStatus, Command,
    ErrorCode, Pose, TrafficLightColour, TrafficLightCommand, Vec3, VehicleControl, WorldId,
};
use world::{Town, World, WorldConfig};

fn roads() -> Arc<roads::Map> {
    static ROADS: LazyLock<Arc<roads::Map>> = LazyLock::new(|| {
        let text = roads::town::build("Town02_Opt").unwrap();
        Arc::new(roads::Map::parse("Town02_Opt", &text).unwrap())
    });
    Arc::clone(&ROADS)
}

fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| Arc::new(Town::new(roads())));
    Arc::clone(&TOWN)
}

fn town_world() -> World {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: town() };
    World::with_traffic(config).unwrap()
}

fn spawn_point(index: usize) -> Pose {
    let points = roads().spawn_points().to_vec();
    nalgebra::convert(points[index % points.len()])
}

fn agent(world: &mut World, actor: ActorId, options: AgentOptions, places_m: &[Vec3]) {
    world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route: false })).unwrap();
    world
        .apply(&Command::Agent(AgentCommand::SetRoute { actor, places_m: places_m.to_vec() }))
        .unwrap();
    world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
}

fn told(world: &World, actor: ActorId) -> AgentState {
    *world.frame().agents.iter().find(|agent| agent.actor == actor).unwrap()
}

fn of(behaviour: AgentBehaviour) -> AgentOptions {
    AgentOptions { behaviour, ..AgentOptions::default() }
}

/// How far a place is from the middle of the nearest driving lane.
fn off_lane_m(place_m: Vec3) -> f64 {
    let position: nalgebra::Vector3<f64> = nalgebra::convert(place_m);
    let lane = roads().nearest(position.into(), roads::LaneTypes::DRIVING).unwrap();
    (roads().pose(&lane).translation.vector - position).xy().norm()
}

#[test]
fn agents_of_all_kinds_reach_places_across_the_town() {
    for (behaviour, from, to) in [
        (AgentBehaviour::Basic, 3, 40),
        (AgentBehaviour::Cautious, 10, 60),
        (AgentBehaviour::Normal, 25, 5),
        (AgentBehaviour::Aggressive, 50, 12),
    ] {
        let mut world = town_world();
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", spawn_point(from), 0.0);
        let goal_m = spawn_point(to).translation.vector;
        agent(&mut world, car, of(behaviour), &[goal_m]);
        let whole_m = told(&world, car).distance_left_m;
        assert!(whole_m > 20.0, "{behaviour:?}: {whole_m} m");
        let mut fastest_mps: f32 = 0.0;
        for tick in 0..6_000 {
            let hits = run(&mut world, 1);
            assert!(hits.is_empty(), "{behaviour:?}, tick {tick}: {hits:?}");
            let place_m = position_m(&world, car);
            let off_m = off_lane_m(place_m);
            assert!(off_m < 1.5, "{behaviour:?}, tick {tick}: {off_m} m off at {place_m}");
            fastest_mps = fastest_mps.max(speed_mps(&world, car));
            if told(&world, car).status == AgentStatus::Arrived {
                break;
            }
        }
        let told = told(&world, car);
        assert_eq!(told.status, AgentStatus::Arrived, "{behaviour:?}: {told:?}");
        assert_eq!(told.distance_left_m, 0.0);
        run(&mut world, 60);
        let away_m = (position_m(&world, car) - goal_m).xy().norm();
        assert!(away_m < 4.0 && speed_mps(&world, car) < 0.05, "{behaviour:?}: {away_m} m");
        let most_mps = if behaviour == AgentBehaviour::Basic { 6.2 } else { 20.0 };
        assert!(fastest_mps > 4.5 && fastest_mps < most_mps, "{behaviour:?}: {fastest_mps} m/s");
    }
}

#[test]
fn a_route_leads_past_all_its_places() {
    let mut world = town_world();
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", spawn_point(0), 0.0);
    let places_m = [30, 55, 18].map(|index| spawn_point(index).translation.vector);
    agent(&mut world, car, of(AgentBehaviour::Normal), &places_m);
    let mut nearest_m = [f32::INFINITY; 3];
    for _ in 0..12_000 {
        run(&mut world, 1);
        let here_m = position_m(&world, car);
        for (nearest_m, place_m) in nearest_m.iter_mut().zip(places_m) {
            *nearest_m = nearest_m.min((here_m - place_m).xy().norm());
        }
        if told(&world, car).status == AgentStatus::Arrived {
            break;
        }
    }
    assert_eq!(told(&world, car).status, AgentStatus::Arrived);
    assert!(nearest_m.iter().all(|m| *m < 4.0), "{nearest_m:?}");
}

#[test]
fn a_place_that_no_lane_leads_to_is_refused_and_the_route_stays() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let ahead = vec![Vec3::new(200.0, LANE_Y_M, 0.0)];
    agent(&mut world, car, AgentOptions::default(), &ahead);
    let before = world.state_hash();
    let behind = vec![Vec3::new(-200.0, LANE_Y_M, 0.0)];
    let refusal =
        world.apply(&Command::Agent(AgentCommand::SetRoute { actor: car, places_m: behind }));
    assert_eq!(refusal.unwrap_err().code, ErrorCode::InvalidArgument);
    assert_eq!(world.state_hash(), before);
    let distance_m = told(&world, car).distance_left_m;
    assert!((distance_m - 200.0).abs() < 1.0, "{distance_m}");
}

#[test]
fn without_an_agent_there_is_nothing_to_route_or_to_drive() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    for command in [
        Command::Agent(AgentCommand::SetRoute { actor: car, places_m: Vec::new() }),
        Command::Agent(AgentCommand::Drive { actor: car, on: true }),
    ] {
        assert_eq!(world.apply(&command).unwrap_err().code, ErrorCode::InvalidArgument);
    }
    assert!(world.frame().agents.is_empty());
}

#[test]
fn a_lane_change_is_driven_where_the_goal_lies_beside() {
    let mut world = world();
    let car = car(&mut world, -900.0, 10.0);
    let goal_m = Vec3::new(-700.0, -5.25, 0.0);
    let options = AgentOptions { target_speed_mps: Some(10.0), ..AgentOptions::default() };
    agent(&mut world, car, options, &[goal_m]);
    run(&mut world, 200);
    assert!((position_m(&world, car).y + 5.25).abs() < 0.4, "{}", position_m(&world, car));
    run(&mut world, 300);
    assert_eq!(told(&world, car).status, AgentStatus::Arrived);
}

#[test]
fn agents_stop_for_a_standing_car_and_for_people_but_not_when_told_to_ignore_them() {
    for behaviour in [
        AgentBehaviour::Basic,
        AgentBehaviour::Cautious,
        AgentBehaviour::Normal,
        AgentBehaviour::Aggressive,
    ] {
        for person in [false, true] {
            let mut world = world();
            let own = car(&mut world, -900.0, 0.0);
            if person {
                walker(&mut world, -700.0, 0.3);
            } else {
                let other = car(&mut world, -700.0, 0.0);
                brake(&mut world, other);
            }
            let goal_m = Vec3::new(-500.0, LANE_Y_M, 0.0);
            agent(&mut world, own, of(behaviour), &[goal_m]);
            let hits = run(&mut world, 1_200);
            assert!(hits.is_empty(), "{behaviour:?}, person {person}: {hits:?}");
            let gap_m = -700.0 - position_m(&world, own).x;
            assert!((3.0..25.0).contains(&gap_m), "{behaviour:?}, person {person}: {gap_m} m");
        }
    }
    let mut world = world();
    let own = car(&mut world, -900.0, 0.0);
    walker(&mut world, -850.0, 0.0);
    let options = AgentOptions { ignore_vehicles: true, ..AgentOptions::default() };
    agent(&mut world, own, options, &[Vec3::new(-500.0, LANE_Y_M, 0.0)]);
    assert!(!run(&mut world, 400).is_empty());
}

/// A car some way before a light, with the light's id.
fn before_a_light(world: &mut World) -> (ActorId, ActorId, Vec3) {
    let lights = roads().traffic_lights();
    let (index, place) = lights
        .lights
        .iter()
        .enumerate()
        .find_map(|(index, light)| {
            let at = roads().previous(&light.boxes.first()?.front, 35.0).into_iter().next()?;
            Some((index, at))
        })
        .unwrap();
    let mut pose: Pose = nalgebra::convert(roads().pose(&place));
    pose.translation.z += 0.2;
    let car = spawn_at(world, "vehicle.lincoln.mkz", pose, 0.0);
    let front =
        nalgebra::convert(roads().pose(&lights.lights[index].boxes[0].front).translation.vector);
    (car, ActorId::new(index as u32 + 1).unwrap(), front)
}

fn show(world: &mut World, light: ActorId, colour: TrafficLightColour) {
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    let set = Command::TrafficLight(TrafficLightCommand::Set {
        actor: light,
        colour: Some(colour),
        green_secs: None,
        yellow_secs: None,
        red_secs: None,
    });
    world.apply(&set).unwrap();
}

#[test]
fn a_red_light_holds_an_agent_and_a_green_one_lets_it_go() {
    for ignore_lights in [false, true] {
        let mut world = town_world();
        let (car, light, front_m) = before_a_light(&mut world);
        show(&mut world, light, TrafficLightColour::Red);
        let options = AgentOptions { ignore_lights, ..of(AgentBehaviour::Normal) };
        agent(&mut world, car, options, &[]);
        let start_m = position_m(&world, car);
        run(&mut world, 400);
        let driven_m = (position_m(&world, car) - start_m).xy().norm();
        let to_line_m = (front_m - start_m).xy().norm();
        if ignore_lights {
            assert!(driven_m > to_line_m, "{driven_m} m of {to_line_m}");
            continue;
        }
        assert!(speed_mps(&world, car) < 0.05 && driven_m > 5.0, "{driven_m} m");
        assert!(driven_m < to_line_m, "{driven_m} m of {to_line_m}");
        show(&mut world, light, TrafficLightColour::Green);
        run(&mut world, 200);
        assert!(speed_mps(&world, car) > 2.0);
    }
}

#[test]
fn another_hand_on_the_wheel_pauses_the_agent_and_its_route_stays() {
    let mut world = world();
    let car = car(&mut world, -900.0, 0.0);
    agent(&mut world, car, AgentOptions::default(), &[Vec3::new(-600.0, LANE_Y_M, 0.0)]);
    run(&mut world, 100);
    let coast = VehicleControl { brake: 1.0, ..VehicleControl::default() };
    control(&mut world, car, coast);
    run(&mut world, 60);
    assert!(!told(&world, car).driving && speed_mps(&world, car) < 0.05);
    assert_eq!(told(&world, car).status, AgentStatus::OnRoute);
    world.apply(&Command::Agent(AgentCommand::Drive { actor: car, on: true })).unwrap();
    run(&mut world, 100);
    assert!(speed_mps(&world, car) > 4.0);
    world.apply(&Command::Agent(AgentCommand::Drive { actor: car, on: false })).unwrap();
    let held = state(&world, car).control;
    run(&mut world, 5);
    assert_eq!(state(&world, car).control, held);
}

#[test]
fn a_town_of_agents_goes_on_bit_for_bit_when_restored_or_forked() {
    let mut world = town_world();
    for index in 0..8 {
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", spawn_point(index * 7), 0.0);
        let places_m: Vec<Vec3> = match index % 2 {
            0 => vec![spawn_point(index * 7 + 31).translation.vector],
            _ => Vec::new(),
        };
        agent(&mut world, car, of(AgentBehaviour::Normal), &places_m);
    }
    run(&mut world, 200);
    let other = WorldId::new(9).unwrap();
    let restored = World::restore(&world.snapshot(), other, 2, |_| Some(town())).unwrap();
    let mut copies = [restored, world.fork(other)];
    let before = world.state_hash();
    for _ in 0..300 {
        world.tick().unwrap();
        for copy in &mut copies {
            copy.tick().unwrap();
            assert_eq!(copy.state_hash(), world.state_hash());
        }
    }
    assert_ne!(world.state_hash(), before);
    assert!(copies.iter().all(|copy| copy.snapshot() == world.snapshot()));
}

#[test]
fn the_agent_counts_in_the_state_hash() {
    let mut world = world();
    let car = car(&mut world, -900.0, 0.0);
    let mut before = world.state_hash();
    for command in [
        Command::Agent(AgentCommand::Set {
            actor: car,
            options: AgentOptions::default(),
            keep_route: false,
        }),
        Command::Agent(AgentCommand::SetRoute {
            actor: car,
            places_m: vec![Vec3::new(0.0, LANE_Y_M, 0.0)],
        }),
        Command::Agent(AgentCommand::Drive { actor: car, on: true }),
    ] {
        world.apply(&command).unwrap();
        assert_ne!(world.state_hash(), before, "{command:?}");
        before = world.state_hash();
    }
}

/// Cruising speed on the empty road, and the gap to a car that stands ahead, metres.
fn cruise_and_gap(behaviour: AgentBehaviour) -> (f32, f32) {
    let goal_m = Vec3::new(950.0, LANE_Y_M, 0.0);
    let mut alone = world();
    let own = car(&mut alone, -900.0, 5.0);
    agent(&mut alone, own, of(behaviour), &[goal_m]);
    run(&mut alone, 600);
    let mut behind = world();
    let own = car(&mut behind, -900.0, 5.0);
    let other = car(&mut behind, -700.0, 0.0);
    brake(&mut behind, other);
    agent(&mut behind, own, of(behaviour), &[goal_m]);
    let hits = run(&mut behind, 1_200);
    assert!(hits.is_empty(), "{behaviour:?}: {hits:?}");
    let lengths_m = 2.0 * state(&behind, own).box_half_extent_m.x;
    let gap_m = position_m(&behind, other).x - position_m(&behind, own).x - lengths_m;
    (speed_mps(&alone, own), gap_m)
}

#[test]
fn who_is_more_aggressive_cruises_faster_and_stops_closer() {
    let kinds = [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Aggressive];
    let [cautious, normal, aggressive] = kinds.map(cruise_and_gap);
    let all = format!("{cautious:?}, {normal:?}, {aggressive:?}");
    assert!(cautious.0 < normal.0 - 2.0 && normal.0 < aggressive.0 - 2.0, "{all}");
    assert!(cautious.1 > normal.1 + 0.3 && normal.1 > aggressive.1 + 0.3, "{all}");
}

#[test]
fn agents_let_each_other_through_where_no_light_says_who_goes_first() {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: town() };
    // No lights and no signs: who comes from the right goes first.
    let mut world = World::new(config).unwrap();
    for index in 0..20 {
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", spawn_point(index * 5), 0.0);
        agent(&mut world, car, of(AgentBehaviour::Normal), &[]);
    }
    let mut driven_m = 0.0;
    for second in 0..180 {
        let hits = run(&mut world, 20);
        assert!(hits.is_empty(), "second {second}: {hits:?}");
        let frame = world.frame();
        driven_m += frame.actors.iter().map(|actor| actor.linear_velocity_mps.norm()).sum::<f32>();
    }
    assert!(driven_m > 20.0 * 180.0 * 1.0, "{driven_m} m");
}
