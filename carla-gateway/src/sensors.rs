//! What sensors tell, byte by byte as CARLA's client reads it.

mod merge;
mod v2x;

pub(crate) use merge::merge;

use schemas::{ActorId, LidarPoint, Measurement, RadarDetection, Scan};
use schemas::{SemanticLidarPoint, SensorDatum, Vec3, carla};
use serde::Serialize;

use crate::dialect::{Actor, Transform, Vector3D, mirrored_spin};
use crate::snapshot::header;

/// Numbers of the sensors in the header; positions in a list inside the client.
mod kind {
    pub(super) const COLLISION: u64 = 0;
    pub(super) const GNSS: u64 = 4;
    pub(super) const IMU: u64 = 5;
    pub(super) const OBSTACLE: u64 = 7;
    pub(super) const RADAR: u64 = 9;
    pub(super) const SEMANTIC_LIDAR: u64 = 10;
    pub(super) const LIDAR: u64 = 11;
    pub(super) const V2X: u64 = 20;
    pub(super) const V2X_CUSTOM: u64 = 21;
}

/// What measurements are told with.
pub(crate) struct Told {
    pub(crate) frame_number: u64,
    /// What inertial sensors measure upwards besides gravity.
    pub(crate) extra_gravity_mps2: f32,
}

/// The payload of one measurement; `None` for what clients find out for themselves. `actor_of`
/// describes an actor that was met, or what stands in for scenery with a tag.
pub(crate) fn encode(
    datum: &SensorDatum,
    told: &Told,
    carrier: &Actor,
    actor_of: impl Fn(Option<ActorId>, u8) -> Actor,
) -> Option<Vec<u8>> {
    let transform = Transform::of(&datum.world_from_sensor);
    let head = |kind| header(kind, told.frame_number, datum.sim_secs, &transform);
    let pack = |kind, body: &dyn Fn(&mut Vec<u8>) -> Option<()>| {
        let mut out = head(kind);
        body(&mut out)?;
        Some(out)
    };
    match &datum.measurement {
        Measurement::Lidar(scan) => Some(lidar(head(kind::LIDAR), scan)),
        Measurement::SemanticLidar(scan) => Some(semantic_lidar(head(kind::SEMANTIC_LIDAR), scan)),
        Measurement::Radar(detections) => Some(radar(head(kind::RADAR), detections)),
        Measurement::Imu { acceleration_mps2, angular_velocity_radps, compass_rad } => {
            let gyroscope = mirrored_spin(*angular_velocity_radps);
            let up = datum.world_from_sensor.rotation.inverse() * Vec3::z();
            let felt_mps2 = acceleration_mps2 + up * told.extra_gravity_mps2;
            let body = (Vector3D::of(felt_mps2), gyroscope, *compass_rad);
            pack(kind::IMU, &|out| append(out, &body))
        }
        Measurement::Gnss { latitude_deg, longitude_deg, altitude_m } => {
            pack(kind::GNSS, &|out| append(out, &(latitude_deg, longitude_deg, altitude_m)))
        }
        Measurement::Collision { other, tag, impulse_ns } => {
            let body = (carrier, actor_of(*other, *tag), Vector3D::of(*impulse_ns));
            pack(kind::COLLISION, &|out| append(out, &body))
        }
        Measurement::Obstacle { other, tag, distance_m } => {
            let body = (carrier, actor_of(*other, *tag), *distance_m);
            pack(kind::OBSTACLE, &|out| append(out, &body))
        }
        Measurement::V2x(received) => Some(v2x::awareness(head(kind::V2X), received)),
        Measurement::V2xCustom(received) => Some(v2x::custom(head(kind::V2X_CUSTOM), received)),
        Measurement::LaneInvasion { .. } => None,
    }
}

fn append<T: Serialize>(out: &mut Vec<u8>, body: &T) -> Option<()> {
    let bytes = rmp_serde::to_vec(body);
    out.extend_from_slice(&bytes.ok()?);
    Some(())
}

/// Angle, channels, points per channel: the same for both lidars.
fn scan_head<T>(out: &mut Vec<u8>, scan: &Scan<T>) {
    out.extend_from_slice(&scan.end_angle_rad.to_le_bytes());
    out.extend_from_slice(&(scan.points_per_channel.len() as u32).to_le_bytes());
    for count in &scan.points_per_channel {
        out.extend_from_slice(&count.to_le_bytes());
    }
}

fn put_point(out: &mut Vec<u8>, position_m: [f32; 3]) {
    let mirrored = carla::mirror_y(Vec3::from(position_m));
    for number in [mirrored.x, mirrored.y, mirrored.z] {
        out.extend_from_slice(&number.to_le_bytes());
    }
}

fn lidar(mut out: Vec<u8>, scan: &Scan<LidarPoint>) -> Vec<u8> {
    scan_head(&mut out, scan);
    out.reserve(scan.points.len() * 16);
    for point in &scan.points {
        put_point(&mut out, point.position_m);
        out.extend_from_slice(&point.intensity.to_le_bytes());
    }
    out
}

fn semantic_lidar(mut out: Vec<u8>, scan: &Scan<SemanticLidarPoint>) -> Vec<u8> {
    scan_head(&mut out, scan);
    out.reserve(scan.points.len() * 24);
    for point in &scan.points {
        put_point(&mut out, point.position_m);
        out.extend_from_slice(&point.incidence_cos.to_le_bytes());
        out.extend_from_slice(&point.actor.to_le_bytes());
        out.extend_from_slice(&point.tag.to_le_bytes());
    }
    out
}

fn radar(mut out: Vec<u8>, detections: &[RadarDetection]) -> Vec<u8> {
    for found in detections {
        // Positive azimuth is to the right there.
        for number in [found.speed_mps, -found.azimuth_rad, found.altitude_rad, found.depth_m] {
            out.extend_from_slice(&number.to_le_bytes());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use schemas::{Pose, Tick};

    use super::*;

    fn datum(measurement: Measurement) -> SensorDatum {
        SensorDatum {
            sensor: ActorId::new(9).unwrap(),
            tick: Tick(4),
            sim_secs: 0.2,
            world_from_sensor: Pose::identity(),
            measurement,
        }
    }

    fn body(measurement: Measurement) -> Vec<u8> {
        let actor_of = |_, _| Actor::default();
        let told = Told { frame_number: 70, extra_gravity_mps2: -2.81 };
        let bytes = encode(&datum(measurement), &told, &Actor::default(), actor_of).unwrap();
        assert_eq!(bytes[8], 70);
        bytes[48..].to_vec()
    }

    #[test]
    fn imu_and_gnss_are_messagepack() {
        let imu = body(Measurement::Imu {
            acceleration_mps2: Vec3::new(1.0, 2.0, 9.81),
            angular_velocity_radps: Vec3::new(0.0, 0.0, 1.0),
            compass_rad: 3.0,
        });
        let ([ax, ay, az], [_, _, gz], compass): ([f32; 3], [f32; 3], f32) =
            rmp_serde::from_slice(&imu).unwrap();
        assert!((az - 7.0).abs() < 1e-5, "{az}");
        assert_eq!((ax, ay, gz, compass), (1.0, -2.0, -1.0, 3.0));
        let gnss =
            body(Measurement::Gnss { latitude_deg: 1.0, longitude_deg: 2.0, altitude_m: 3.0 });
        assert_eq!((gnss[0], gnss[1], gnss.len()), (0x93, 0xcb, 28));
    }

    #[test]
    fn a_lidar_tells_channels_before_points() {
        let point = LidarPoint { position_m: [1.0, 2.0, 3.0], intensity: 0.5 };
        let scan =
            Scan { end_angle_rad: 0.25, points_per_channel: vec![0, 1], points: vec![point] };
        let bytes = body(Measurement::Lidar(scan));
        assert_eq!(bytes.len(), 4 + 4 + 8 + 16);
        assert_eq!(bytes[4..16], [2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(bytes[20..24], (-2.0f32).to_le_bytes());
    }
}
