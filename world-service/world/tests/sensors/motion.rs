//! IMU, GNSS and radar.

use schemas::{Measurement, Pose, RadarDetection, Vec3, level_pose};

use crate::common::*;
use crate::support::*;

#[test]
fn an_imu_on_a_standing_car_feels_gravity_only() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let imu = sensor(&mut world, "sensor.other.imu", Some(car), Pose::identity(), &[]);
    run(&mut world, 60);
    let Measurement::Imu { acceleration_mps2, angular_velocity_radps, compass_rad } =
        only(&world, imu).measurement
    else {
        panic!("no IMU")
    };
    assert!((acceleration_mps2 - Vec3::z() * 9.81).norm() < 0.05, "{acceleration_mps2}");
    assert!(angular_velocity_radps.norm() < 0.01, "{angular_velocity_radps}");
    assert!((compass_rad - std::f32::consts::FRAC_PI_2).abs() < 0.01, "east: {compass_rad}");
}

#[test]
fn an_imu_feels_braking_as_a_push_to_the_rear() {
    let mut world = world();
    let car = car(&mut world, 0.0, 20.0);
    let imu = sensor(&mut world, "sensor.other.imu", Some(car), Pose::identity(), &[]);
    brake(&mut world, car);
    run(&mut world, 20);
    let before_mps = state(&world, car).linear_velocity_mps;
    run(&mut world, 1);
    let change_mps2 = (state(&world, car).linear_velocity_mps - before_mps) / 0.05;
    let Measurement::Imu { acceleration_mps2, .. } = only(&world, imu).measurement else {
        panic!("no IMU")
    };
    assert!(change_mps2.x < -4.0, "{change_mps2}");
    // The nose dips while it brakes, and the sensor is below the centre of mass.
    assert!((acceleration_mps2.x - change_mps2.x).abs() < 0.5, "{acceleration_mps2}");
}

#[test]
fn a_gnss_tells_the_place_of_the_sensor_by_the_projection_of_the_map() {
    let mut world = world();
    let place_m = Vec3::new(300.0, -120.0, 7.5);
    let gnss = sensor(&mut world, "sensor.other.gnss", None, level_pose(place_m, 1.0), &[]);
    run(&mut world, 1);
    let Measurement::Gnss { latitude_deg, longitude_deg, altitude_m } =
        only(&world, gnss).measurement
    else {
        panic!("no GNSS")
    };
    // Spherical transverse Mercator about 42° north, 2° east; the client counts y to the right.
    let scaled_radius_m = 0.9996 * 6_378_137.0;
    let (x, d) = (300.0 / scaled_radius_m, 120.0 / scaled_radius_m + 42.0_f64.to_radians());
    let expected_lat_deg = (d.sin() / x.cosh()).asin().to_degrees();
    let expected_lon_deg = 2.0 + x.sinh().atan2(d.cos()).to_degrees();
    assert!((latitude_deg - expected_lat_deg).abs() < 1.0e-10, "{latitude_deg}");
    assert!((longitude_deg - expected_lon_deg).abs() < 1.0e-10, "{longitude_deg}");
    assert_eq!(altitude_m, 7.5);
}

#[test]
fn bias_and_noise_of_a_gnss_are_those_asked_for() {
    let mut world = world();
    let exact = sensor(&mut world, "sensor.other.gnss", None, Pose::identity(), &[]);
    let attributes = [("noise_lat_bias", "0.5"), ("noise_alt_stddev", "2")];
    let off = sensor(&mut world, "sensor.other.gnss", None, Pose::identity(), &attributes);
    let mut altitudes_m = Vec::new();
    for _ in 0..400 {
        run(&mut world, 1);
        let read = |sensor| match only(&world, sensor).measurement {
            Measurement::Gnss { latitude_deg, longitude_deg, altitude_m } => {
                (latitude_deg, longitude_deg, altitude_m)
            }
            other => panic!("no GNSS: {other:?}"),
        };
        let (exact, off) = (read(exact), read(off));
        assert!((off.0 - exact.0 - 0.5).abs() < 1.0e-9);
        assert_eq!(off.1, exact.1);
        altitudes_m.push(off.2 - exact.2);
    }
    let square_m2 = altitudes_m.iter().map(|error_m| error_m * error_m).sum::<f64>() / 400.0;
    assert!((square_m2.sqrt() - 2.0).abs() < 0.4, "{square_m2}");
}

/// The echoes of a car 30 m ahead of a radar that stands on the road.
fn echoes_of_a_car(heading_rad: f32) -> Vec<RadarDetection> {
    let mut world = world();
    let pose = level_pose(Vec3::new(30.0, LANE_Y_M, 0.3), heading_rad);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 10.0);
    let at = level_pose(Vec3::new(0.0, LANE_Y_M, 1.0), 0.0);
    let radar =
        sensor(&mut world, "sensor.other.radar", None, at, &[("points_per_second", "9000")]);
    run(&mut world, 1);
    let Measurement::Radar(echoes) = only(&world, radar).measurement else { panic!("no radar") };
    let to_car_m = position_m(&world, car).x;
    echoes
        .into_iter()
        .filter(|echo| echo.depth_m < to_car_m && echo.altitude_rad.abs() < 0.02)
        .inspect(|echo| assert!(echo.azimuth_rad.abs() <= 15.01_f32.to_radians(), "{echo:?}"))
        .collect()
}

#[test]
fn a_radar_sees_what_approaches_as_negative_and_what_leaves_as_positive() {
    for (heading_rad, speed_mps) in [(std::f32::consts::PI, -10.0), (0.0, 10.0)] {
        let echoes = echoes_of_a_car(heading_rad);
        assert!(echoes.len() > 3, "{}", echoes.len());
        for echo in echoes {
            assert!((echo.speed_mps - speed_mps).abs() < 0.5, "{echo:?}");
            assert!((26.0..29.5).contains(&echo.depth_m), "{echo:?}");
        }
    }
}

#[test]
fn a_moving_radar_sees_the_standing_road_approach() {
    let mut world = world();
    let car = car(&mut world, 0.0, 15.0);
    let mount = level_pose(Vec3::new(2.6, 0.0, 0.6), 0.0);
    let radar = sensor(&mut world, "sensor.other.radar", Some(car), mount, &[]);
    run(&mut world, 1);
    let Measurement::Radar(echoes) = only(&world, radar).measurement else { panic!("no radar") };
    assert!(echoes.len() > 10, "{}", echoes.len());
    for echo in echoes {
        let along = echo.azimuth_rad.cos() * echo.altitude_rad.cos();
        assert!((echo.speed_mps + 15.0 * along).abs() < 0.5, "{echo:?}");
    }
}
