//! Worlds on the generated town.

mod common;

use std::sync::{Arc, LazyLock};

use common::*;
use schemas::{Command, PilotMode, Pose, Vec3, VehicleCommand, level_pose};
use world::Town;

fn roads() -> Arc<roads::Map> {
    static ROADS: LazyLock<Arc<roads::Map>> = LazyLock::new(|| {
        let text = roads::town::build("Town10HD_Opt").expect("the town exists");
        Arc::new(roads::Map::parse("Town10HD_Opt", &text).expect("the town is valid"))
    });
    Arc::clone(&ROADS)
}

fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| Arc::new(Town::new(roads())));
    Arc::clone(&TOWN)
}

#[test]
fn a_car_can_be_spawned_at_every_spawn_point_and_stands_there() {
    let mut world = world_on(town(), 0.05);
    let points: Vec<Pose> =
        roads().spawn_points().iter().map(|&point| nalgebra::convert(point)).collect();
    assert!(points.len() > 20);
    let cars: Vec<_> = points
        .iter()
        .map(|&point| spawn_at(&mut world, "vehicle.lincoln.mkz", point, 0.0))
        .collect();
    assert!(run(&mut world, 60).is_empty());
    for (car, point) in cars.into_iter().zip(points) {
        let state = state(&world, car);
        assert!(state.linear_velocity_mps.norm() < 0.01, "{point}: {}", state.linear_velocity_mps);
        let moved_m = state.world_from_actor.translation.vector - point.translation.vector;
        assert!(moved_m.xy().norm() < 0.05 && moved_m.z < 0.0, "{point}: {moved_m}");
    }
}

#[test]
fn a_pilot_drives_through_the_town_on_its_lanes_without_touching_anything() {
    for start in [0, 7, 19] {
        let mut world = world_on(town(), 0.05);
        let pose: Pose = nalgebra::convert(roads().spawn_points()[start]);
        let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 0.0);
        let mode = PilotMode::KeepLane;
        let target_speed_mps = Some(10.0);
        world
            .apply(&Command::Vehicle(VehicleCommand::Pilot { actor: car, mode, target_speed_mps }))
            .unwrap();
        let mut driven_m = 0.0;
        for tick in 0..1_200 {
            let hits = run(&mut world, 1);
            assert!(hits.is_empty(), "from {start}: {hits:?}");
            let state = state(&world, car);
            driven_m += state.linear_velocity_mps.norm() * 0.05;
            let place: Vec3 = state.world_from_actor.translation.vector;
            let position: nalgebra::Vector3<f64> = nalgebra::convert(place);
            let lane = roads().nearest(position.into(), roads::LaneTypes::DRIVING).unwrap();
            let off_m = (roads().pose(&lane).translation.vector - position).xy().norm();
            assert!(off_m < 1.0, "from {start}, tick {tick}: {off_m} m beside its lane at {place}");
        }
        assert!(driven_m > 200.0, "from {start}: {driven_m} m in a minute");
    }
}

#[test]
fn a_car_that_leaves_the_road_hits_a_house_and_not_the_ground() {
    let mut world = world_on(town(), 0.05);
    let fronts = roads()
        .scenery()
        .iter()
        .filter(|item| item.kind == roads::SceneryKind::Building)
        .flat_map(|house| {
            let centre: Vec3 = nalgebra::convert(house.pose.translation.vector);
            let half_m: Vec3 = nalgebra::convert(house.half_extent_m);
            let pose: Pose = nalgebra::convert(house.pose);
            [
                (Vec3::x(), half_m.x),
                (-Vec3::x(), half_m.x),
                (Vec3::y(), half_m.y),
                (-Vec3::y(), half_m.y),
            ]
            .map(|(out, half_m)| (centre, pose.rotation * out, half_m))
        })
        .collect::<Vec<_>>();
    let start = fronts.into_iter().find_map(|(centre, out, half_m)| {
        let place = centre + out * (half_m + 6.0);
        let pose = level_pose(Vec3::new(place.x, place.y, 0.3), (-out.y).atan2(-out.x));
        let spawn = Command::spawn("vehicle.lincoln.mkz", pose, -out * 10.0);
        world.apply(&spawn).ok().flatten()
    });
    let car = start.expect("some house has room in front of it");
    let collisions = run(&mut world, 40);
    assert!(collisions.iter().any(|hit| hit.actor == car && hit.other.is_none()));
    let place = position_m(&world, car);
    assert!(place.z.abs() < 1.0, "{place}");
}
