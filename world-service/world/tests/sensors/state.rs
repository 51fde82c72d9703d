//! When sensors measure, what is refused, and that they survive snapshots.

use schemas::{
    ActorId, Command, ErrorCode, Pose, SensorCommand, SensorDatum, Vec3, WorldId, level_pose,
};
use world::{World, WorldConfig};

use crate::common::*;
use crate::support::*;

#[test]
fn a_sensor_measures_only_while_somebody_listens() {
    let mut world = world();
    let gnss = sensor(&mut world, "sensor.other.gnss", None, Pose::identity(), &[]);
    for on in [false, true, false] {
        world.apply(&Command::Sensor(SensorCommand::Listen { sensor: gnss, on })).unwrap();
        run(&mut world, 1);
        assert_eq!(data_of(&world, gnss).len(), usize::from(on));
    }
}

#[test]
fn a_sensor_of_responsibility_sensitive_safety_is_there_and_measures_nothing() {
    let mut world = world();
    let rss = sensor(&mut world, "sensor.other.rss", None, Pose::identity(), &[]);
    for _ in 0..3 {
        run(&mut world, 1);
        assert!(world.frame().actors.iter().any(|actor| actor.id == rss));
        assert!(data_of(&world, rss).is_empty() && world.cameras_due().is_empty());
    }
}

#[test]
fn measurements_are_sensor_tick_apart_over_a_thousand_ticks() {
    let mut world = world();
    let every = |world: &mut World, secs: &str| {
        let attributes = [("sensor_tick", secs)];
        sensor(world, "sensor.other.gnss", None, Pose::identity(), &attributes)
    };
    let sensors = [(every(&mut world, "0"), 1), (every(&mut world, "0.1"), 2)];
    let sensors = [sensors[0], sensors[1], (every(&mut world, "0.15"), 3)];
    let between = every(&mut world, "0.12");
    let mut told = 0;
    let camera = [("sensor_tick", "0.2")];
    let camera = sensor(&mut world, "sensor.camera.rgb", None, Pose::identity(), &camera);
    for tick in 1..=1_000u64 {
        run(&mut world, 1);
        for (sensor, apart) in sensors {
            let due = (tick - 1).is_multiple_of(apart);
            assert_eq!(data_of(&world, sensor).len(), usize::from(due), "{sensor} at {tick}");
        }
        told += data_of(&world, between).len();
        let due: &[ActorId] = if (tick - 1).is_multiple_of(4) { &[camera] } else { &[] };
        assert_eq!(world.cameras_due(), due, "at {tick}");
    }
    assert_eq!(told, 417, "49.95 s are 416 times 0.12 s");
}

#[test]
fn what_is_out_of_range_is_refused_and_changes_nothing() {
    let mut world = world();
    let before = world.state_hash();
    for (blueprint, id, value) in [
        ("sensor.lidar.ray_cast", "range", "-1"),
        ("sensor.lidar.ray_cast", "channels", "0"),
        ("sensor.lidar.ray_cast", "dropoff_general_rate", "1.5"),
        ("sensor.lidar.ray_cast_semantic", "points_per_second", "many"),
        ("sensor.other.radar", "horizontal_fov", "NaN"),
        ("sensor.other.imu", "noise_accel_stddev_y", "-0.1"),
        ("sensor.other.gnss", "sensor_tick", "-1"),
        ("sensor.other.obstacle", "only_dynamics", "perhaps"),
        ("sensor.other.v2x", "path_loss_model", "guess"),
        ("sensor.other.v2x_custom", "frequency_ghz", "0"),
    ] {
        let refused = try_sensor(&mut world, blueprint, None, Pose::identity(), &[(id, value)]);
        let refused = refused.expect_err(id);
        assert_eq!(refused.code, ErrorCode::InvalidArgument, "{id}: {refused:?}");
        assert!(refused.message.contains(id) && refused.found.contains(value), "{refused:?}");
    }
    assert_eq!(world.state_hash(), before);
}

#[test]
fn only_sensors_can_be_listened_to() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let refused =
        world.apply(&Command::Sensor(SensorCommand::Listen { sensor: car, on: true })).unwrap_err();
    assert_eq!(refused.code, ErrorCode::InvalidArgument);
}

/// A car under way with noisy sensors of every kind.
fn equipped(seed: u64) -> World {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed, dt_secs: 0.05, map: flat() };
    let mut world = World::new(config).unwrap();
    let other = car(&mut world, 540.0, 0.0);
    let car = car(&mut world, 570.0, 12.0);
    let roof = level_pose(Vec3::new(0.0, 0.0, 2.0), 0.0);
    for (blueprint, attributes) in [
        ("sensor.lidar.ray_cast", [("noise_stddev", "0.02"), ("sensor_tick", "0.1")]),
        ("sensor.lidar.ray_cast_semantic", [("range", "30"), ("sensor_tick", "0.15")]),
        ("sensor.other.radar", [("range", "50"), ("noise_seed", "7")]),
        ("sensor.other.imu", [("noise_accel_stddev_x", "0.1"), ("noise_gyro_bias_z", "0.2")]),
        ("sensor.other.gnss", [("noise_lat_stddev", "0.1"), ("noise_alt_bias", "3")]),
        ("sensor.other.obstacle", [("distance", "30"), ("hit_radius", "0.3")]),
        ("sensor.other.collision", [("role_name", "a"), ("ros_name", "")]),
        ("sensor.other.lane_invasion", [("role_name", "b"), ("ros_name", "")]),
    ] {
        sensor(&mut world, blueprint, Some(car), roof, &attributes);
    }
    for station in [car, other] {
        let attributes = [("noise_head_stddev", "1"), ("scenario", "urban")];
        sensor(&mut world, "sensor.other.v2x", Some(station), roof, &attributes);
    }
    world
}

fn record(world: &mut World, ticks: usize) -> Vec<SensorDatum> {
    let mut data = Vec::new();
    for _ in 0..ticks {
        world.tick().unwrap();
        data.extend_from_slice(world.sensors());
    }
    data
}

#[test]
fn sensors_go_on_bit_for_bit_after_a_snapshot_and_in_a_fork() {
    let mut world = equipped(7);
    record(&mut world, 7);
    let bytes = world.snapshot();
    let mut restored = World::restore(&bytes, world.id(), 1, |_| Some(flat())).unwrap();
    let mut fork = world.fork(world.id());
    let expected = record(&mut world, 40);
    assert!(expected.len() > 100, "{}", expected.len());
    assert_eq!(record(&mut restored, 40), expected);
    assert_eq!(record(&mut fork, 40), expected);
    assert_eq!(restored.state_hash(), world.state_hash());
}

#[test]
fn equal_seeds_give_equal_noise_and_other_seeds_other_noise() {
    let expected = record(&mut equipped(7), 5);
    assert_eq!(record(&mut equipped(7), 5), expected);
    assert_ne!(record(&mut equipped(8), 5), expected);
}

#[test]
fn the_state_of_sensors_is_in_the_state_hash() {
    let mut world = world();
    let gnss = sensor(&mut world, "sensor.other.gnss", None, Pose::identity(), &[]);
    let listening = world.state_hash();
    world.apply(&Command::Sensor(SensorCommand::Listen { sensor: gnss, on: false })).unwrap();
    assert_ne!(world.state_hash(), listening);
}

#[test]
fn a_destroyed_sensor_measures_no_more_and_the_world_can_be_restored() {
    let mut world = equipped(7);
    let last = world.frame().actors.last().unwrap().id;
    world.apply(&Command::DestroyActor { actor: last }).unwrap();
    run(&mut world, 3);
    assert!(data_of(&world, last).is_empty());
    let restored = World::restore(&world.snapshot(), world.id(), 1, |_| Some(flat())).unwrap();
    assert_eq!(restored.state_hash(), world.state_hash());
}
