//! Lidar points against surfaces that are known exactly, and cars as far as their boxes tell;
//! pictures tell the rest, elsewhere.

use std::f32::consts::{PI, TAU};

use schemas::{
    ActorId, Command, ErrorCode, SemanticLidarPoint, SensorCommand, Vec3, VehicleControl,
    WalkerCommand, WalkerControl, level_pose,
};
use world::World;

use crate::common::*;
use crate::support::*;

const SEMANTIC: &str = "sensor.lidar.ray_cast_semantic";
const LIDAR: &str = "sensor.lidar.ray_cast";
/// Every ray meets the road within 5 m, 100 rays of each channel in a tick of 0.05 s.
const DOWNWARD: [(&str, &str); 5] = [
    ("channels", "32"),
    ("points_per_second", "64000"),
    ("upper_fov", "-25"),
    ("lower_fov", "-60"),
    ("range", "100"),
];
// Tags of CARLA.
const ROAD: u32 = 1;
const WALL: u32 = 4;
const CAR: u32 = 14;
const MILLIMETRE: f32 = 1.0e-3;
/// How far mirrors and plates stand out of the box.
const MIRROR_M: f32 = 0.1;

fn place(x_m: f32) -> schemas::Pose {
    level_pose(Vec3::new(x_m, LANE_Y_M, 2.0), 0.0)
}

fn least(distances_m: &[f32]) -> f32 {
    distances_m.iter().fold(f32::INFINITY, |least, distance_m| least.min(distance_m.abs()))
}

#[test]
fn points_lie_on_the_road_the_wall_and_the_car_and_say_which() {
    let mut world = world();
    let car = car(&mut world, 590.0, 0.0);
    run(&mut world, 60);
    let attributes = [("channels", "64"), ("points_per_second", "300000"), ("range", "60")];
    let pose = place(580.0);
    let lidar = sensor(&mut world, SEMANTIC, None, pose, &attributes);
    // Two ticks are one turn; the second looks ahead.
    let mut points: Vec<SemanticLidarPoint> = Vec::new();
    for _ in 0..2 {
        run(&mut world, 1);
        points.extend(semantic_scan(&world, lidar).points);
    }
    let car_from_world = state(&world, car).world_from_actor.inverse();
    let mut met = [0; 3];
    let (mut rear, mut roof) = (0, 0);
    for point in points {
        let at_m = pose * nalgebra::Point3::from(point.position_m);
        let off_m = if point.tag == ROAD {
            met[0] += 1;
            assert_eq!(point.actor, 0);
            at_m.z
        } else if point.tag == WALL {
            met[1] += 1;
            least(&[at_m.x - 599.5, at_m.x - 600.5, at_m.z - 3.0, at_m.y.abs() - 15.0])
        } else if point.tag == CAR {
            met[2] += 1;
            assert_eq!(point.actor, car.get());
            // Its rear is on end, its roof lies far ahead of it, and nothing is far out of its box.
            let at_m = car_from_world * at_m;
            let is_behind = at_m.x < -2.2 && at_m.z < 0.9;
            rear += u32::from(is_behind);
            roof += u32::from(at_m.z > 1.3 && at_m.x.abs() < 1.4);
            let out_m = [at_m.x.abs() - 2.46, at_m.y.abs() - 0.93, at_m.z - 1.48];
            out_m.into_iter().fold(0.0, f32::max) / MIRROR_M * MILLIMETRE
        } else {
            continue;
        };
        assert!(off_m.abs() < MILLIMETRE, "{point:?} at {at_m} is off by {off_m} m");
        assert!(point.incidence_cos > 0.0 && point.incidence_cos <= 1.0 + 1.0e-5, "{point:?}");
    }
    assert!(met.iter().all(|&count| count > 50), "{met:?}");
    assert!(rear > 20 && roof > 5, "{rear} {roof}");
}

/// As collectors of boxes ask for it, who count the points of each actor.
#[test]
fn a_dense_lidar_has_its_points_up_to_a_million_a_tick() {
    for (points_per_second, of_a_channel) in [("17920000", 875), ("100000000", 976)] {
        let mut world = world();
        let dense = [("channels", "1024"), ("points_per_second", points_per_second)];
        let attributes = [&dense[..], &DOWNWARD[2..]].concat();
        let lidar = sensor(&mut world, SEMANTIC, None, place(580.0), &attributes);
        run(&mut world, 1);
        let scan = semantic_scan(&world, lidar);
        assert_eq!(scan.points_per_channel, vec![of_a_channel; 1_024]);
        assert_eq!(scan.points.len(), 1_024 * of_a_channel as usize);
    }
}

#[test]
fn an_ignored_car_lets_the_rays_of_that_sensor_through_until_another_list_comes() {
    let mut world = world();
    let ahead = car(&mut world, 590.0, 0.0);
    let attributes = [("channels", "64"), ("points_per_second", "600000"), ("range", "60")];
    let [blind, seeing] = [(); 2].map(|()| {
        let turning = [&attributes[..], &[("rotation_frequency", "20")]].concat();
        sensor(&mut world, SEMANTIC, None, place(580.0), &turning)
    });
    let meets_car = |world: &World, lidar| {
        semantic_scan(world, lidar).points.iter().any(|point| point.actor == ahead.get())
    };
    world
        .apply(&Command::Sensor(SensorCommand::IgnoreVehicles {
            sensor: blind,
            vehicles: vec![ahead],
        }))
        .unwrap();
    run(&mut world, 1);
    assert_eq!((meets_car(&world, blind), meets_car(&world, seeing)), (false, true));
    let mut restored = World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
    run(&mut restored, 1);
    assert_eq!((meets_car(&restored, blind), meets_car(&restored, seeing)), (false, true));
    world
        .apply(&Command::Sensor(SensorCommand::IgnoreVehicles {
            sensor: blind,
            vehicles: Vec::new(),
        }))
        .unwrap();
    run(&mut world, 1);
    assert!(meets_car(&world, blind));
}

#[test]
fn forks_and_restored_worlds_measure_the_same_on_what_steers_and_walks() {
    let mut world = world();
    let turning = car(&mut world, 588.0, 0.0);
    let steer = VehicleControl { throttle: 0.3, steer: 0.6, ..VehicleControl::default() };
    control(&mut world, turning, steer);
    let walking = walker(&mut world, 584.0, 2.0);
    let steps = WalkerControl { direction: Vec3::y(), speed_mps: 1.4, jump: false };
    let steps = WalkerCommand::Control { actor: walking, control: steps };
    world.apply(&Command::Walker(steps)).unwrap();
    let attributes = [("channels", "64"), ("points_per_second", "600000"), ("range", "60")];
    let lidar = sensor(&mut world, SEMANTIC, None, place(580.0), &attributes);
    run(&mut world, 9);
    let mut fork = world.fork(world.id());
    let mut restored = World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
    for _ in 0..4 {
        for world in [&mut world, &mut fork, &mut restored] {
            run(world, 1);
        }
        assert_eq!(fork.sensors(), world.sensors());
        assert_eq!(restored.sensors(), world.sensors());
        assert_eq!(restored.state_hash(), world.state_hash());
    }
    let points = semantic_scan(&world, lidar).points;
    for actor in [turning, walking] {
        assert!(points.iter().any(|point| point.actor == actor.get()), "{actor:?}");
    }
}

#[test]
fn only_vehicles_are_ignored_and_only_by_sensors() {
    let mut world = world();
    let car = car(&mut world, 590.0, 0.0);
    let lidar = sensor(&mut world, SEMANTIC, None, place(580.0), &[]);
    let nobody = ActorId::new(999).unwrap();
    for (sensor, vehicle, code) in [
        (car, car, ErrorCode::InvalidArgument),
        (lidar, lidar, ErrorCode::InvalidArgument),
        (lidar, nobody, ErrorCode::UnknownActor),
        (nobody, car, ErrorCode::UnknownActor),
    ] {
        let command =
            Command::Sensor(SensorCommand::IgnoreVehicles { sensor, vehicles: vec![vehicle] });
        let before = world.state_hash();
        assert_eq!(world.apply(&command).unwrap_err().code, code, "{command:?}");
        assert_eq!(world.state_hash(), before);
    }
}

#[test]
fn the_incidence_on_a_level_road_is_the_sine_of_the_ray_downwards() {
    let mut world = world();
    let lidar = sensor(&mut world, SEMANTIC, None, place(0.0), &DOWNWARD);
    run(&mut world, 1);
    for point in semantic_scan(&world, lidar).points {
        let distance_m = Vec3::from(point.position_m).norm();
        assert!((point.incidence_cos - 2.0 / distance_m).abs() < 1.0e-4, "{point:?}");
    }
}

#[test]
fn channels_and_azimuths_follow_from_the_attributes() {
    let mut world = world();
    let lidar = sensor(&mut world, SEMANTIC, None, place(0.0), &DOWNWARD);
    for tick in 0..3u8 {
        run(&mut world, 1);
        let scan = semantic_scan(&world, lidar);
        assert_eq!(scan.points_per_channel, [100; 32], "64,000 a second · 0.05 s / 32");
        // Ten turns a second: half a turn clockwise in a tick, from behind.
        let start_rad = if tick % 2 == 0 { PI } else { 0.0 };
        let apart = |a: f32, b: f32| ((a - b + PI).rem_euclid(TAU) - PI).abs();
        assert!((scan.end_angle_rad - start_rad).abs() < 1.0e-5, "{}", scan.end_angle_rad);
        for (index, point) in scan.points.iter().enumerate() {
            let (channel, turn) = ((index / 100) as f32, (index % 100) as f32);
            let [x, y, z] = point.position_m;
            let azimuth_rad = start_rad - PI * turn / 100.0;
            assert!(apart(y.atan2(x), azimuth_rad) < 1.0e-4, "{index}: {point:?}");
            let elevation_rad = (-25.0 - 35.0 * channel / 31.0).to_radians();
            assert!((z.atan2(x.hypot(y)) - elevation_rad).abs() < 1.0e-4, "{index}: {point:?}");
        }
    }
}

#[test]
fn intensity_falls_off_exponentially_with_the_distance() {
    let mut world = world();
    let extra = [("dropoff_general_rate", "0"), ("dropoff_intensity_limit", "0")];
    let attributes = [&DOWNWARD[..], &extra, &[("atmosphere_attenuation_rate", "0.1")]].concat();
    let lidar = sensor(&mut world, LIDAR, None, place(0.0), &attributes);
    run(&mut world, 1);
    let scan = scan(&world, lidar);
    assert_eq!(scan.points.len(), 3_200);
    for point in scan.points {
        let distance_m = Vec3::from(point.position_m).norm();
        assert!((point.intensity - (-0.1 * distance_m).exp()).abs() < 1.0e-5, "{point:?}");
    }
}

#[test]
fn points_are_lost_at_the_rates_asked_for() {
    let share = |extra: &[(&str, &str)]| {
        let mut world = world();
        let attributes = [&DOWNWARD[..], extra].concat();
        let lidar = sensor(&mut world, LIDAR, None, place(0.0), &attributes);
        let mut points = 0;
        for _ in 0..10 {
            run(&mut world, 1);
            points += scan(&world, lidar).points.len();
        }
        points as f32 / 32_000.0
    };
    // Five standard errors are 0.014.
    let general = [("dropoff_general_rate", "0.45"), ("dropoff_intensity_limit", "0")];
    assert!((share(&general) - 0.55).abs() < 0.014);
    // So thick an atmosphere that no light comes back: only the zero intensity counts.
    let dark = [
        ("dropoff_general_rate", "0"),
        ("dropoff_zero_intensity", "0.4"),
        ("atmosphere_attenuation_rate", "100"),
    ];
    assert!((share(&dark) - 0.6).abs() < 0.014);
}

#[test]
fn noise_moves_points_along_their_rays() {
    let mut world = world();
    let attributes =
        [&DOWNWARD[..], &[("dropoff_general_rate", "0"), ("noise_stddev", "0.05")]].concat();
    let noisy = sensor(&mut world, LIDAR, None, place(0.0), &attributes);
    let exact = sensor(&mut world, SEMANTIC, None, place(0.0), &DOWNWARD);
    run(&mut world, 1);
    let (noisy, exact) = (scan(&world, noisy), semantic_scan(&world, exact));
    assert_eq!(noisy.points.len(), exact.points.len());
    let mut square_m2 = 0.0;
    for (noisy, exact) in noisy.points.iter().zip(&exact.points) {
        let (noisy_m, exact_m) = (Vec3::from(noisy.position_m), Vec3::from(exact.position_m));
        assert!(noisy_m.cross(&exact_m).norm() < 1.0e-3 * exact_m.norm_squared());
        square_m2 += (noisy_m.norm() - exact_m.norm()).powi(2);
    }
    let deviation_m = (square_m2 / 3_200.0).sqrt();
    assert!((deviation_m - 0.05).abs() < 0.004, "{deviation_m}");
}
