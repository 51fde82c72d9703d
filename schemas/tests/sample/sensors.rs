//! One datum of every kind of sensor.

use schemas::{AwarenessMessage, CustomMessage, Received, StationKind, StationMotion};
use schemas::{
    LidarPoint, Measurement, RadarDetection, Scan, SemanticLidarPoint, SensorDatum, Tick, Vec3,
    level_pose,
};

use super::actor;

pub(crate) fn sensors() -> Vec<SensorDatum> {
    let lidar = Scan {
        end_angle_rad: 1.0,
        points_per_channel: vec![1, 0],
        points: vec![LidarPoint { position_m: [1.0, 2.0, 3.0], intensity: 0.5 }],
    };
    let semantic =
        SemanticLidarPoint { position_m: [1.0, 2.0, 3.0], incidence_cos: 0.25, actor: 4, tag: 14 };
    let echo =
        RadarDetection { speed_mps: -3.0, azimuth_rad: 0.1, altitude_rad: 0.2, depth_m: 30.0 };
    let measurements = [
        Measurement::Lidar(lidar),
        Measurement::SemanticLidar(Scan {
            end_angle_rad: 2.0,
            points_per_channel: vec![1],
            points: vec![semantic],
        }),
        Measurement::Radar(vec![echo]),
        Measurement::Imu {
            acceleration_mps2: Vec3::z() * 9.81,
            angular_velocity_radps: Vec3::x(),
            compass_rad: 0.5,
        },
        Measurement::Gnss { latitude_deg: 42.0, longitude_deg: 2.0, altitude_m: 3.0 },
        Measurement::Collision { other: None, tag: 3, impulse_ns: Vec3::x() },
        Measurement::Obstacle { other: Some(actor(2)), tag: 12, distance_m: 4.0 },
        Measurement::LaneInvasion { marks: vec!["broken".into()] },
        Measurement::V2x(awareness()),
        Measurement::V2xCustom(vec![Received {
            power_dbm: -70.5,
            message: CustomMessage { station: actor(3), text: "grüß dich".into() },
        }]),
    ];
    let datum = |(index, measurement)| SensorDatum {
        sensor: actor(20 + index as u32),
        tick: Tick(42),
        sim_secs: 2.1,
        world_from_sensor: level_pose(Vec3::x(), 0.25),
        measurement,
    };
    measurements.into_iter().enumerate().map(datum).collect()
}

/// Of a vehicle that tells everything, and of a road side unit.
fn awareness() -> Vec<Received<AwarenessMessage>> {
    let motion = StationMotion {
        heading_deg: 90.0,
        speed_mps: 13.9,
        forward: false,
        length_m: 4.9,
        width_m: 1.9,
        acceleration_mps2: Vec3::z() * 9.81,
        yaw_rate_radps: -0.1,
    };
    let vehicle = AwarenessMessage {
        station: actor(4),
        kind: StationKind::SpecialVehicle,
        sim_secs: 2.1,
        latitude_deg: 42.0,
        longitude_deg: 2.0,
        altitude_m: 3.0,
        motion: Some(motion),
        lights: Some(3),
    };
    let kind = StationKind::RoadSideUnit;
    let unit = AwarenessMessage { kind, motion: None, lights: None, ..vehicle.clone() };
    [vehicle, unit].map(|message| Received { power_dbm: -60.0, message }).into()
}
