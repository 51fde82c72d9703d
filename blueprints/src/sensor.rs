//! Things that measure.

use crate::attribute::{Attribute, AttributeKind, common};
use crate::{Blueprint, Class};

mod camera;

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum SensorClass {
    CameraRgb,
    CameraDepth,
    CameraSemanticSegmentation,
    CameraInstanceSegmentation,
    CameraNormals,
    CameraOpticalFlow,
    CameraDvs,
    CameraCosmos,
    Lidar,
    SemanticLidar,
    Radar,
    Gnss,
    Imu,
    Collision,
    LaneInvasion,
    Obstacle,
    Rss,
    V2x,
    V2xCustom,
}

/// A row of a table of attributes: (id, kind, recommended values).
type Row = (&'static str, AttributeKind, &'static [&'static str]);

/// A sensor: (id without `sensor.`, class, proposed roles, tables of attributes).
type Kind = (&'static str, SensorClass, &'static [&'static str], &'static [&'static [Row]]);

/// Roles that CARLA proposes for most sensors.
const SIDES: [&str; 8] =
    ["front", "back", "left", "right", "front_left", "front_right", "back_left", "back_right"];

pub(crate) fn blueprints() -> impl Iterator<Item = Blueprint> {
    use SensorClass::{
        Collision, Gnss, Imu, LaneInvasion, Lidar, Obstacle, Radar, Rss, SemanticLidar, V2x,
        V2xCustom,
    };
    let others: [Kind; 11] = [
        ("lidar.ray_cast", Lidar, &SIDES, &[TICK, SCAN, LIDAR]),
        ("lidar.ray_cast_semantic", SemanticLidar, &SIDES, &[TICK, SCAN]),
        ("other.collision", Collision, &SIDES, &[]),
        ("other.gnss", Gnss, &["default"], &[TICK, SEED, PLACE]),
        ("other.imu", Imu, &["default"], &[TICK, SEED, IMU]),
        ("other.lane_invasion", LaneInvasion, &SIDES, &[]),
        ("other.obstacle", Obstacle, &SIDES, &[TICK, OBSTACLE]),
        ("other.radar", Radar, &["default"], &[TICK, RADAR, SEED]),
        ("other.rss", Rss, &SIDES, &[]),
        ("other.v2x", V2x, &["default"], &[TICK, SEED, RADIO, CAM, PLACE, MOTION]),
        ("other.v2x_custom", V2xCustom, &["default"], &[TICK, SEED, RADIO]),
    ];
    camera::blueprints().chain(
        others
            .into_iter()
            .map(|(name, class, roles, tables)| blueprint(name, class, roles, tables)),
    )
}

fn blueprint(name: &str, class: SensorClass, roles: &[&str], tables: &[&[Row]]) -> Blueprint {
    let id = format!("sensor.{name}");
    let mut attributes = common(&id, roles);
    attributes.extend(tables.iter().flat_map(|table| table.iter()).map(attribute));
    Blueprint::new(&id, Class::Sensor(class), true, attributes)
}

/// Texts with several proposals are choices; numbers are free.
fn attribute(&(id, kind, values): &Row) -> Attribute {
    if kind == AttributeKind::String && values.len() > 1 {
        Attribute::choice(id, kind, values)
    } else {
        Attribute::open(id, kind, values)
    }
}

use AttributeKind::{Bool, Float, Int, String as Text};

const TICK: &[Row] = &[("sensor_tick", Float, &["0.0"])];

const SEED: &[Row] = &[("noise_seed", Int, &["0"])];

const SCAN: &[Row] = &[
    ("channels", Int, &["32"]),
    ("range", Float, &["10.0"]),
    ("points_per_second", Int, &["56000"]),
    ("rotation_frequency", Float, &["10.0"]),
    ("upper_fov", Float, &["10.0"]),
    ("lower_fov", Float, &["-30.0"]),
    ("horizontal_fov", Float, &["360.0"]),
];

const LIDAR: &[Row] = &[
    ("atmosphere_attenuation_rate", Float, &["0.004"]),
    ("noise_seed", Int, &["0"]),
    ("dropoff_general_rate", Float, &["0.45"]),
    ("dropoff_intensity_limit", Float, &["0.8"]),
    ("dropoff_zero_intensity", Float, &["0.4"]),
    ("noise_stddev", Float, &["0.0"]),
];

const RADAR: &[Row] = &[
    ("horizontal_fov", Float, &["30"]),
    ("vertical_fov", Float, &["30"]),
    ("range", Float, &["100"]),
    ("points_per_second", Int, &["1500"]),
];

const OBSTACLE: &[Row] = &[
    ("distance", Float, &["5.0"]),
    ("hit_radius", Float, &["0.5"]),
    ("only_dynamics", Bool, &["false"]),
    ("debug_linetrace", Bool, &["false"]),
];

const IMU: &[Row] = &[
    ("noise_accel_stddev_x", Float, &["0.0"]),
    ("noise_accel_stddev_y", Float, &["0.0"]),
    ("noise_accel_stddev_z", Float, &["0.0"]),
    ("noise_gyro_stddev_x", Float, &["0.0"]),
    ("noise_gyro_stddev_y", Float, &["0.0"]),
    ("noise_gyro_stddev_z", Float, &["0.0"]),
    ("noise_gyro_bias_x", Float, &["0.0"]),
    ("noise_gyro_bias_y", Float, &["0.0"]),
    ("noise_gyro_bias_z", Float, &["0.0"]),
];

const PLACE: &[Row] = &[
    ("noise_lat_stddev", Float, &["0.0"]),
    ("noise_lat_bias", Float, &["0.0"]),
    ("noise_lon_stddev", Float, &["0.0"]),
    ("noise_lon_bias", Float, &["0.0"]),
    ("noise_alt_stddev", Float, &["0.0"]),
    ("noise_alt_bias", Float, &["0.0"]),
];

const RADIO: &[Row] = &[
    ("transmit_power", Float, &["21.5"]),
    ("receiver_sensitivity", Float, &["-99.0"]),
    ("frequency_ghz", Float, &["5.9"]),
    ("combined_antenna_gain", Float, &["10.0"]),
    ("scenario", Text, &["highway", "rural", "urban"]),
    ("path_loss_model", Text, &["winner", "geometric"]),
    ("path_loss_exponent", Float, &["2.7"]),
    ("d_ref", Float, &["1.0"]),
    ("filter_distance", Float, &["500.0"]),
    ("use_etsi_fading", Bool, &["true"]),
    ("custom_fading_stddev", Float, &["0.0"]),
];

const CAM: &[Row] = &[
    ("gen_cam_min", Float, &["0.1"]),
    ("gen_cam_max", Float, &["1.0"]),
    ("fixed_rate", Bool, &["false"]),
];

const MOTION: &[Row] = &[
    ("noise_head_stddev", Float, &["0.0"]),
    ("noise_head_bias", Float, &["0.0"]),
    ("noise_accel_stddev_x", Float, &["0.0"]),
    ("noise_accel_stddev_y", Float, &["0.0"]),
    ("noise_accel_stddev_z", Float, &["0.0"]),
    ("noise_yawrate_stddev", Float, &["0.0"]),
    ("noise_yawrate_bias", Float, &["0.0"]),
    ("noise_vel_stddev_x", Float, &["0.0"]),
];
