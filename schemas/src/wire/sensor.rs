//! What sensors are told, and what they measured.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, UnionWIPOffset, Vector, WIPOffset};

use super::parts::{actor_in, finite, pose_in, pose_out, unknown_variant, vec3_in, vec3_out};
use super::{check_count, needed, v2x};
use crate::generated as fb;
use crate::limits::{IGNORED_VEHICLES_MAX, V2X_TEXT_BYTES_MAX};
use crate::{
    ActorId, Command, Error, LidarPoint, Measurement, RadarDetection, Scan, SensorCommand,
};
use crate::{SemanticLidarPoint, SensorDatum, Tick};

type Body = (fb::CommandBody, WIPOffset<UnionWIPOffset>);

type Data<'a> = Vector<'a, ForwardsUOffset<fb::SensorDatum<'a>>>;

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &SensorCommand) -> Body {
    match command {
        SensorCommand::Listen { sensor, on } => {
            let body = fb::Listen::create(b, &fb::ListenArgs { sensor: sensor.get(), on: *on });
            (fb::CommandBody::Listen, body.as_union_value())
        }
        SensorCommand::IgnoreVehicles { sensor, vehicles } => {
            let vehicles = ignored_out(b, vehicles);
            let args = fb::IgnoreVehiclesArgs { sensor: sensor.get(), vehicles };
            (fb::CommandBody::IgnoreVehicles, fb::IgnoreVehicles::create(b, &args).as_union_value())
        }
        SensorCommand::SendV2x { sensor, text } => {
            let text = Some(b.create_string(text));
            let body = fb::SendV2x::create(b, &fb::SendV2xArgs { sensor: sensor.get(), text });
            (fb::CommandBody::SendV2x, body.as_union_value())
        }
    }
}

/// # Errors
/// For a text that is too long, too many vehicles, and what no command of the schema is.
pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(listen) = raw.body_as_listen() {
        return Ok(Command::Sensor(SensorCommand::Listen {
            sensor: actor_in(listen.sensor())?,
            on: listen.on(),
        }));
    }
    if let Some(ignore) = raw.body_as_ignore_vehicles() {
        let vehicles = ignored_in(ignore.vehicles())?;
        return Ok(Command::Sensor(SensorCommand::IgnoreVehicles {
            sensor: actor_in(ignore.sensor())?,
            vehicles,
        }));
    }
    let send = needed(raw.body_as_send_v2x(), "a known command")?;
    check_count("bytes of a text", send.text().len(), V2X_TEXT_BYTES_MAX)?;
    Ok(Command::Sensor(SensorCommand::SendV2x {
        sensor: actor_in(send.sensor())?,
        text: send.text().to_owned(),
    }))
}

/// Nothing where nobody is ignored.
pub(super) fn ignored_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    vehicles: &[ActorId],
) -> Option<WIPOffset<Vector<'a, u32>>> {
    let raw = vehicles.iter().map(|vehicle| vehicle.get());
    (!vehicles.is_empty()).then(|| b.create_vector_from_iter(raw))
}

pub(super) fn ignored_in(raw: Option<Vector<'_, u32>>) -> Result<Vec<ActorId>, Error> {
    check_count("ignored vehicles", raw.map_or(0, |raw| raw.len()), IGNORED_VEHICLES_MAX)?;
    raw.iter().flatten().map(actor_in).collect()
}

pub(super) fn sensors_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    data: &[SensorDatum],
) -> WIPOffset<Data<'a>> {
    let raw: Vec<_> = data.iter().map(|datum| datum_out(b, datum)).collect();
    b.create_vector(&raw)
}

pub(super) fn sensors_in(raw: Option<Data<'_>>) -> Result<Vec<SensorDatum>, Error> {
    let Some(raw) = raw else { return Ok(Vec::new()) };
    raw.iter().map(|datum| datum_in(&datum)).collect()
}

fn datum_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    datum: &SensorDatum,
) -> WIPOffset<fb::SensorDatum<'a>> {
    let (measurement_type, measurement) = measurement_out(b, &datum.measurement);
    let args = fb::SensorDatumArgs {
        sensor: datum.sensor.get(),
        tick: datum.tick.0,
        sim_secs: datum.sim_secs,
        world_from_sensor: Some(&pose_out(&datum.world_from_sensor)),
        measurement_type,
        measurement: Some(measurement),
    };
    fb::SensorDatum::create(b, &args)
}

fn measurement_out(
    b: &mut FlatBufferBuilder<'_>,
    measurement: &Measurement,
) -> (fb::Measurement, WIPOffset<UnionWIPOffset>) {
    use fb::Measurement as Kind;
    match measurement {
        Measurement::Lidar(scan) => (Kind::Lidar, lidar_out(b, scan)),
        Measurement::SemanticLidar(scan) => (Kind::SemanticLidar, semantic_lidar_out(b, scan)),
        Measurement::Radar(detections) => {
            let detection = |d: &RadarDetection| {
                fb::RadarDetection::new(d.speed_mps, d.azimuth_rad, d.altitude_rad, d.depth_m)
            };
            let raw: Vec<_> = detections.iter().map(detection).collect();
            let detections = Some(b.create_vector(&raw));
            (Kind::Radar, fb::Radar::create(b, &fb::RadarArgs { detections }).as_union_value())
        }
        Measurement::Imu { acceleration_mps2, angular_velocity_radps, compass_rad } => {
            let args = fb::ImuArgs {
                acceleration_in_sensor_mps2: Some(&vec3_out(acceleration_mps2)),
                angular_velocity_in_sensor_radps: Some(&vec3_out(angular_velocity_radps)),
                compass_rad: *compass_rad,
            };
            (Kind::Imu, fb::Imu::create(b, &args).as_union_value())
        }
        Measurement::Gnss { latitude_deg, longitude_deg, altitude_m } => {
            let args = fb::GnssArgs {
                latitude_deg: *latitude_deg,
                longitude_deg: *longitude_deg,
                altitude_m: *altitude_m,
            };
            (Kind::Gnss, fb::Gnss::create(b, &args).as_union_value())
        }
        Measurement::Collision { other, tag, impulse_ns } => {
            let args = fb::CollisionEventArgs {
                other: other.map_or(0, ActorId::get),
                tag: *tag,
                impulse_in_world_ns: Some(&vec3_out(impulse_ns)),
            };
            (Kind::CollisionEvent, fb::CollisionEvent::create(b, &args).as_union_value())
        }
        Measurement::Obstacle { other, tag, distance_m } => {
            let other = other.map_or(0, ActorId::get);
            let args = fb::ObstacleArgs { other, tag: *tag, distance_m: *distance_m };
            (Kind::Obstacle, fb::Obstacle::create(b, &args).as_union_value())
        }
        Measurement::LaneInvasion { marks } => {
            let texts: Vec<_> = marks.iter().map(|mark| b.create_string(mark)).collect();
            let args = fb::LaneInvasionArgs { marks: Some(b.create_vector(&texts)) };
            (Kind::LaneInvasion, fb::LaneInvasion::create(b, &args).as_union_value())
        }
        Measurement::V2x(received) => (Kind::V2x, v2x::awareness_out(b, received)),
        Measurement::V2xCustom(received) => (Kind::V2xCustom, v2x::custom_out(b, received)),
    }
}

fn position_out(position_m: &[f32; 3]) -> fb::Vec3 {
    let [x, y, z] = *position_m;
    fb::Vec3::new(x, y, z)
}

fn position_in(raw: &fb::Vec3) -> [f32; 3] {
    [raw.x(), raw.y(), raw.z()]
}

fn lidar_out(b: &mut FlatBufferBuilder<'_>, scan: &Scan<LidarPoint>) -> WIPOffset<UnionWIPOffset> {
    let point = |p: &LidarPoint| fb::LidarPoint::new(&position_out(&p.position_m), p.intensity);
    let raw: Vec<_> = scan.points.iter().map(point).collect();
    let args = fb::LidarArgs {
        end_angle_rad: scan.end_angle_rad,
        points_per_channel: Some(b.create_vector(&scan.points_per_channel)),
        points: Some(b.create_vector(&raw)),
    };
    fb::Lidar::create(b, &args).as_union_value()
}

fn semantic_lidar_out(
    b: &mut FlatBufferBuilder<'_>,
    scan: &Scan<SemanticLidarPoint>,
) -> WIPOffset<UnionWIPOffset> {
    let point = |p: &SemanticLidarPoint| {
        let position_m = position_out(&p.position_m);
        fb::SemanticLidarPoint::new(&position_m, p.incidence_cos, p.actor, p.tag)
    };
    let raw: Vec<_> = scan.points.iter().map(point).collect();
    let args = fb::SemanticLidarArgs {
        end_angle_rad: scan.end_angle_rad,
        points_per_channel: Some(b.create_vector(&scan.points_per_channel)),
        points: Some(b.create_vector(&raw)),
    };
    fb::SemanticLidar::create(b, &args).as_union_value()
}

fn datum_in(raw: &fb::SensorDatum<'_>) -> Result<SensorDatum, Error> {
    Ok(SensorDatum {
        sensor: actor_in(raw.sensor())?,
        tick: Tick(raw.tick()),
        sim_secs: raw.sim_secs(),
        world_from_sensor: pose_in(raw.world_from_sensor(), "world_from_sensor")?,
        measurement: measurement_in(raw)?,
    })
}

fn measurement_in(raw: &fb::SensorDatum<'_>) -> Result<Measurement, Error> {
    use fb::Measurement as Kind;
    match raw.measurement_type() {
        Kind::Lidar => {
            let scan = needed(raw.measurement_as_lidar(), "a scan")?;
            let point = |p: &fb::LidarPoint| LidarPoint {
                position_m: position_in(p.position_m()),
                intensity: p.intensity(),
            };
            Ok(Measurement::Lidar(Scan {
                end_angle_rad: scan.end_angle_rad(),
                points_per_channel: scan.points_per_channel().iter().collect(),
                points: scan.points().iter().map(point).collect(),
            }))
        }
        Kind::SemanticLidar => {
            let scan = needed(raw.measurement_as_semantic_lidar(), "a scan")?;
            let point = |p: &fb::SemanticLidarPoint| SemanticLidarPoint {
                position_m: position_in(p.position_m()),
                incidence_cos: p.incidence_cos(),
                actor: p.actor(),
                tag: p.tag(),
            };
            Ok(Measurement::SemanticLidar(Scan {
                end_angle_rad: scan.end_angle_rad(),
                points_per_channel: scan.points_per_channel().iter().collect(),
                points: scan.points().iter().map(point).collect(),
            }))
        }
        Kind::Radar => {
            let radar = needed(raw.measurement_as_radar(), "detections")?;
            let detection = |d: &fb::RadarDetection| RadarDetection {
                speed_mps: d.speed_mps(),
                azimuth_rad: d.azimuth_rad(),
                altitude_rad: d.altitude_rad(),
                depth_m: d.depth_m(),
            };
            Ok(Measurement::Radar(radar.detections().iter().map(detection).collect()))
        }
        _ => event_in(raw),
    }
}

fn event_in(raw: &fb::SensorDatum<'_>) -> Result<Measurement, Error> {
    if let Some(imu) = raw.measurement_as_imu() {
        return Ok(Measurement::Imu {
            acceleration_mps2: vec3_in(imu.acceleration_in_sensor_mps2(), "acceleration")?,
            angular_velocity_radps: vec3_in(imu.angular_velocity_in_sensor_radps(), "spin")?,
            compass_rad: finite(imu.compass_rad(), "compass_rad")?,
        });
    }
    if let Some(gnss) = raw.measurement_as_gnss() {
        return Ok(Measurement::Gnss {
            latitude_deg: gnss.latitude_deg(),
            longitude_deg: gnss.longitude_deg(),
            altitude_m: gnss.altitude_m(),
        });
    }
    if let Some(event) = raw.measurement_as_collision_event() {
        return Ok(Measurement::Collision {
            other: ActorId::new(event.other()),
            tag: event.tag(),
            impulse_ns: vec3_in(event.impulse_in_world_ns(), "impulse")?,
        });
    }
    if let Some(obstacle) = raw.measurement_as_obstacle() {
        return Ok(Measurement::Obstacle {
            other: ActorId::new(obstacle.other()),
            tag: obstacle.tag(),
            distance_m: finite(obstacle.distance_m(), "distance_m")?,
        });
    }
    if let Some(invasion) = raw.measurement_as_lane_invasion() {
        let marks = invasion.marks().iter().map(str::to_owned).collect();
        return Ok(Measurement::LaneInvasion { marks });
    }
    if let Some(radio) = raw.measurement_as_v2x() {
        return Ok(Measurement::V2x(v2x::awareness_in(&radio)?));
    }
    if let Some(radio) = raw.measurement_as_v2x_custom() {
        return Ok(Measurement::V2xCustom(v2x::custom_in(&radio)?));
    }
    Err(unknown_variant("measurement", raw.measurement_type().0))
}
