//! What sensors other than cameras measure. Points and directions are in the sensor's frame, which
//! follows ISO 8855: x forward, y left, z up.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, AwarenessMessage, CustomMessage, Pose, Received, Tick, Vec3};

/// One return of a lidar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LidarPoint {
    /// Metres, sensor frame.
    pub position_m: [f32; 3],
    /// Share of the light that comes back, 0 to 1.
    pub intensity: f32,
}

/// One return of a lidar that knows what it met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SemanticLidarPoint {
    /// Metres, sensor frame.
    pub position_m: [f32; 3],
    /// Cosine between the ray and the surface normal.
    pub incidence_cos: f32,
    /// 0 for scenery.
    pub actor: u32,
    /// CARLA's semantic tag.
    pub tag: u32,
}

/// One echo of a radar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RadarDetection {
    /// Relative speed along the ray; approaching is negative.
    pub speed_mps: f32,
    /// Positive left.
    pub azimuth_rad: f32,
    /// Positive up.
    pub altitude_rad: f32,
    /// Distance along the ray.
    pub depth_m: f32,
}

/// A scan: points grouped by channel, top channel first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan<Point> {
    /// Where the scan stopped, clockwise from the left edge of the field of view.
    pub end_angle_rad: f32,
    /// How many points each channel has.
    pub points_per_channel: Vec<u32>,
    /// The points.
    pub points: Vec<Point>,
}

/// What a sensor measured.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// `sensor.lidar.ray_cast`.
    Lidar(Scan<LidarPoint>),
    /// `sensor.lidar.ray_cast_semantic`.
    SemanticLidar(Scan<SemanticLidarPoint>),
    /// `sensor.other.radar`.
    Radar(Vec<RadarDetection>),
    /// `sensor.other.imu`.
    Imu {
        /// With gravity: +g upwards at rest.
        acceleration_mps2: Vec3,
        /// Sensor frame.
        angular_velocity_radps: Vec3,
        /// Clockwise from north.
        compass_rad: f32,
    },
    /// `sensor.other.gnss`.
    Gnss {
        /// Positive north.
        latitude_deg: f64,
        /// Positive east.
        longitude_deg: f64,
        /// Above the map's zero.
        altitude_m: f64,
    },
    /// `sensor.other.collision`.
    Collision {
        /// Whom the carrier met; `None` for scenery.
        other: Option<ActorId>,
        /// CARLA's semantic tag of what it met.
        tag: u8,
        /// On the carrier, newton seconds, world frame.
        impulse_ns: Vec3,
    },
    /// `sensor.other.obstacle`.
    Obstacle {
        /// What is ahead; `None` for scenery.
        other: Option<ActorId>,
        /// CARLA's semantic tag of it.
        tag: u8,
        /// From the sensor.
        distance_m: f32,
    },
    /// `sensor.other.lane_invasion`.
    LaneInvasion {
        /// Kinds of the marks crossed, as OpenDRIVE names them.
        marks: Vec<String>,
    },
    /// `sensor.other.v2x`.
    V2x(Vec<Received<AwarenessMessage>>),
    /// `sensor.other.v2x_custom`.
    V2xCustom(Vec<Received<CustomMessage>>),
}

/// What one sensor measured in one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorDatum {
    /// Which sensor.
    pub sensor: ActorId,
    /// In which tick.
    pub tick: Tick,
    /// Simulated seconds since tick 0.
    pub sim_secs: f64,
    /// Where the sensor was.
    pub world_from_sensor: Pose,
    /// What it found.
    pub measurement: Measurement,
}
