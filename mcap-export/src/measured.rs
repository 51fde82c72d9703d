//! What sensors other than cameras measured, as messages.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use bytemuck::{Pod, cast_slice};
use schemas::{AwarenessMessage, Measurement, Pose, RadarDetection, Received, SensorDatum};
use serde_json::{Value, json};

use crate::convert::{pose, time, vector};
use crate::ego::fix;
use crate::schema;

/// Types of the fields of points, as Foxglove counts them.
const UINT32: u8 = 5;
const FLOAT32: u8 = 7;

/// A message of one sensor.
pub(crate) struct Measured {
    /// Below the name of the sensor.
    pub(crate) topic: &'static str,
    pub(crate) schema_name: &'static str,
    pub(crate) schema: fn() -> Value,
    pub(crate) message: Value,
}

/// The short name of what measures so, and its message; `None` for what is told as an event or has
/// no message.
pub(crate) fn of(datum: &SensorDatum, frame_id: &str, now: u64) -> Option<Measured> {
    let cloud = |fields: &[(&str, u8)], points: &[u8]| Measured {
        topic: "points",
        schema_name: "foxglove.PointCloud",
        schema: schema::points,
        message: cloud(frame_id, now, fields, points),
    };
    const PLACE: [(&str, u8); 3] = [("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32)];
    let with = |more: &[(&'static str, u8)]| [&PLACE[..], more].concat();
    Some(match &datum.measurement {
        Measurement::Lidar(scan) => cloud(&with(&[("intensity", FLOAT32)]), bytes(&scan.points)),
        Measurement::SemanticLidar(scan) => {
            let more = [("incidence_cos", FLOAT32), ("actor", UINT32), ("tag", UINT32)];
            cloud(&with(&more), bytes(&scan.points))
        }
        Measurement::Radar(echoes) => {
            let points: Vec<[f32; 4]> = echoes.iter().map(echo).collect();
            cloud(&with(&[("velocity", FLOAT32)]), bytes(&points))
        }
        Measurement::Imu { acceleration_mps2, angular_velocity_radps, compass_rad } => Measured {
            topic: "inertia",
            schema_name: "causeway.Imu",
            schema: schema::inertia,
            message: json!({
                "timestamp": time(now),
                "frame_id": frame_id,
                "acceleration_mps2": vector(*acceleration_mps2),
                "angular_velocity_radps": vector(*angular_velocity_radps),
                "compass_rad": compass_rad,
            }),
        },
        Measurement::Gnss { latitude_deg, longitude_deg, altitude_m } => Measured {
            topic: "fix",
            schema_name: "foxglove.LocationFix",
            schema: schema::fix,
            message: fix(frame_id, now, [*latitude_deg, *longitude_deg, *altitude_m]),
        },
        Measurement::V2x(all) => Measured {
            topic: "awareness",
            schema_name: "causeway.V2xAwareness",
            schema: schema::awareness,
            message: received(frame_id, now, all, awareness),
        },
        Measurement::V2xCustom(all) => Measured {
            topic: "texts",
            schema_name: "causeway.V2xTexts",
            schema: schema::texts,
            message: received(
                frame_id,
                now,
                all,
                |told| json!({"station": told.station.get(), "text": told.text}),
            ),
        },
        Measurement::Collision { .. }
        | Measurement::Obstacle { .. }
        | Measurement::LaneInvasion { .. } => return None,
    })
}

/// What a sensor received in a tick, each with its power.
fn received<T>(frame_id: &str, now: u64, all: &[Received<T>], says: impl Fn(&T) -> Value) -> Value {
    let one = |one: &Received<T>| {
        let mut told = says(&one.message);
        told["power_dbm"] = json!(one.power_dbm);
        told
    };
    let messages: Vec<Value> = all.iter().map(one).collect();
    json!({"timestamp": time(now), "frame_id": frame_id, "messages": messages})
}

/// Kinds are numbers of ETSI TS 102 894-2; what the station did not tell is left out.
fn awareness(told: &AwarenessMessage) -> Value {
    let motion = told.motion.as_ref();
    let mut fields = json!({
        "station": told.station.get(),
        "kind": told.kind as u8,
        "made_secs": told.sim_secs,
        "latitude_deg": told.latitude_deg,
        "longitude_deg": told.longitude_deg,
        "altitude_m": told.altitude_m,
        "heading_deg": motion.map(|motion| motion.heading_deg),
        "speed_mps": motion.map(|motion| motion.speed_mps),
        "lights": told.lights,
    });
    if let Some(fields) = fields.as_object_mut() {
        fields.retain(|_, value| !value.is_null());
    }
    fields
}

fn bytes<T: Pod>(points: &[T]) -> &[u8] {
    cast_slice(points)
}

/// A place in the frame of the sensor, and the speed along the ray.
fn echo(of: &RadarDetection) -> [f32; 4] {
    let (up, across) = (of.altitude_rad.sin_cos(), of.azimuth_rad.sin_cos());
    let flat_m = of.depth_m * up.1;
    [flat_m * across.1, flat_m * across.0, of.depth_m * up.0, of.speed_mps]
}

/// All fields take four bytes.
fn cloud(frame_id: &str, now: u64, fields: &[(&str, u8)], points: &[u8]) -> Value {
    let field = |(index, (name, kind)): (usize, &(&str, u8))| json!({"name": name, "offset": 4 * index, "type": kind});
    let told: Vec<Value> = fields.iter().enumerate().map(field).collect();
    json!({
        "timestamp": time(now),
        "frame_id": frame_id,
        "pose": pose(&Pose::identity()),
        "point_stride": 4 * fields.len(),
        "fields": told,
        "data": STANDARD.encode(points),
    })
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, CustomMessage, LidarPoint, Scan, StationKind, Tick};

    use super::*;

    fn datum(measurement: Measurement) -> SensorDatum {
        SensorDatum {
            sensor: ActorId::new(7).unwrap(),
            tick: Tick(1),
            sim_secs: 0.05,
            world_from_sensor: Pose::identity(),
            measurement,
        }
    }

    #[test]
    fn points_are_told_with_their_layout() {
        let point = LidarPoint { position_m: [1.0, 2.0, 3.0], intensity: 0.5 };
        let scan = Scan { points: vec![point; 2], ..Scan::default() };
        let told = of(&datum(Measurement::Lidar(scan)), "ego/lidar", 0).unwrap().message;
        assert_eq!(told["point_stride"], 16);
        assert_eq!(told["fields"][3], json!({"name": "intensity", "offset": 12, "type": 7}));
        let data = STANDARD.decode(told["data"].as_str().unwrap()).unwrap();
        assert_eq!(data.len(), 32);
        assert_eq!(data[4..8], 2.0f32.to_le_bytes());
    }

    #[test]
    fn echoes_lie_where_their_angles_point_to() {
        let quarter = std::f32::consts::FRAC_PI_2;
        let left = RadarDetection {
            speed_mps: -3.0,
            azimuth_rad: quarter,
            altitude_rad: 0.0,
            depth_m: 10.0,
        };
        let [x, y, z, speed_mps] = echo(&left);
        assert!(x.abs() < 1e-5 && (y - 10.0).abs() < 1e-5 && z == 0.0 && speed_mps == -3.0);
        let above = RadarDetection { azimuth_rad: 0.0, altitude_rad: quarter, ..left };
        assert!((echo(&above)[2] - 10.0).abs() < 1e-5);
    }

    #[test]
    fn what_arrives_by_radio_is_told_with_its_power() {
        let says = AwarenessMessage {
            station: ActorId::new(9).unwrap(),
            kind: StationKind::RoadSideUnit,
            sim_secs: 1.5,
            latitude_deg: 49.0,
            longitude_deg: 8.0,
            altitude_m: 110.0,
            motion: None,
            lights: Some(3),
        };
        let all = vec![Received { power_dbm: -60.0, message: says }];
        let told = of(&datum(Measurement::V2x(all)), "ego/v2x/7", 0).unwrap();
        assert_eq!((told.topic, told.schema_name), ("awareness", "causeway.V2xAwareness"));
        let message = &told.message["messages"][0];
        assert_eq!(message["station"], 9);
        assert_eq!((&message["kind"], &message["lights"]), (&json!(15), &json!(3)));
        assert_eq!((&message["power_dbm"], message.get("speed_mps")), (&json!(-60.0), None));

        let text = CustomMessage { station: ActorId::new(9).unwrap(), text: "ice".to_owned() };
        let all = vec![Received { power_dbm: -61.0, message: text }];
        let told = of(&datum(Measurement::V2xCustom(all)), "ego/v2x_custom/8", 0).unwrap();
        assert_eq!((told.topic, &told.message["messages"][0]["text"]), ("texts", &json!("ice")));
    }

    #[test]
    fn what_is_an_event_has_no_topic_of_its_own() {
        let marks = vec!["solid".to_owned()];
        assert!(of(&datum(Measurement::LaneInvasion { marks }), "x", 0).is_none());
    }
}
