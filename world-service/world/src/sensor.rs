//! What measures: everything of CARLA's `sensor.*` but the pictures of cameras, of which only the
//! moment is known here.
//!
//! A sensor measures while somebody listens, at the end of a tick, once in `sensor_tick` seconds of
//! simulated time.

mod collision;
mod config;
mod due;
mod gnss;
mod imu;
mod lane_invasion;
mod lidar;
mod mount;
mod noise;
mod obstacle;
mod radar;
mod radio;
mod v2x;
mod v2x_custom;

use schemas::{ActorId, Attribute, Error, ErrorCode, Measurement};
use serde::{Deserialize, Serialize};

use config::Settings;
use due::Pace;
use gnss::Gnss;
use imu::Imu;
use lane_invasion::LaneInvasion;
use lidar::{Lidar, SemanticLidar};
use noise::Noise;
use obstacle::Obstacle;
use radar::Radar;
use v2x::V2x;
use v2x_custom::V2xCustom;

pub(crate) use mount::{Carrier, Mount, Station, Surroundings};
pub(crate) use radio::Transmission;

/// Longest time between two measurements.
const PERIOD_SECS_MAX: f64 = 1.0e6;

/// One sensor: settings and state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sensor {
    pub listening: bool,
    /// Vehicles that its rays go through.
    pub ignored: Vec<ActorId>,
    pace: Pace,
    noise: Noise,
    device: Device,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Device {
    Camera,
    Collision,
    LaneInvasion(LaneInvasion),
    Obstacle(Obstacle),
    Gnss(Gnss),
    Imu(Imu),
    Lidar(Lidar),
    SemanticLidar(SemanticLidar),
    Radar(Radar),
    V2x(Box<V2x>),
    V2xCustom(V2xCustom),
    /// Measures nothing: clients that know it compute what it tells themselves.
    Rss,
}

/// What came of one tick of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// A camera takes a picture of this tick.
    Picture,
    /// In the order of happening.
    Measured(Vec<Measurement>),
}

impl Sensor {
    /// A sensor to which nobody listens yet; `number` is its own among the actors of its world.
    ///
    /// # Errors
    /// `InvalidArgument` for an attribute out of its range, `Unsupported` for a blueprint that is
    /// not here.
    pub(crate) fn new(
        blueprint: &str,
        attributes: &[Attribute],
        world_seed: u64,
        number: u32,
    ) -> Result<Self, Error> {
        let settings = Settings(attributes);
        let device = match blueprint {
            "sensor.other.collision" => Device::Collision,
            "sensor.other.lane_invasion" => Device::LaneInvasion(LaneInvasion::default()),
            "sensor.other.obstacle" => Device::Obstacle(Obstacle::new(settings)?),
            "sensor.other.gnss" => Device::Gnss(Gnss::new(settings)?),
            "sensor.other.imu" => Device::Imu(Imu::new(settings)?),
            "sensor.lidar.ray_cast" => Device::Lidar(Lidar::new(settings)?),
            "sensor.lidar.ray_cast_semantic" => {
                Device::SemanticLidar(SemanticLidar::new(settings)?)
            }
            "sensor.other.radar" => Device::Radar(Radar::new(settings)?),
            "sensor.other.v2x" => Device::V2x(Box::new(V2x::new(settings)?)),
            "sensor.other.v2x_custom" => Device::V2xCustom(V2xCustom::new(settings)?),
            "sensor.other.rss" => Device::Rss,
            camera if camera.starts_with("sensor.camera.") => Device::Camera,
            other => {
                return Err(Error::new(ErrorCode::Unsupported, "this sensor is not available")
                    .wanted("a camera, lidar, radar, IMU, GNSS, V2X or event sensor")
                    .found(other));
            }
        };
        let period_secs = settings.number("sensor_tick", 0.0, 0.0..=PERIOD_SECS_MAX)?;
        let noise = Noise::new(world_seed, settings.seed()?, number);
        Ok(Self {
            listening: false,
            ignored: Vec::new(),
            pace: Pace::new(period_secs),
            noise,
            device,
        })
    }

    /// Whether it can have come from `fresh`; what a snapshot may get wrong.
    pub(crate) fn is_used(&self, fresh: &Self) -> bool {
        let device = match (&self.device, &fresh.device) {
            (Device::Imu(used), Device::Imu(fresh)) => used.is_used(fresh),
            (Device::Lidar(used), Device::Lidar(fresh)) => used.is_used(fresh),
            (Device::SemanticLidar(used), Device::SemanticLidar(fresh)) => used.is_used(fresh),
            (Device::LaneInvasion(_), Device::LaneInvasion(_)) => true,
            (Device::V2x(used), Device::V2x(fresh)) => used.is_used(fresh),
            (Device::V2xCustom(used), Device::V2xCustom(fresh)) => used.is_used(fresh),
            (used, fresh) => used == fresh,
        };
        device && self.pace.is_used(&fresh.pace)
    }

    /// Whether it sends, too.
    pub(crate) fn is_radio(&self) -> bool {
        matches!(self.device, Device::V2x(_) | Device::V2xCustom(_))
    }

    /// Gives it a text to send in the next tick.
    ///
    /// # Errors
    /// `InvalidArgument` for a sensor that sends no texts, others of
    /// [`queue`](V2xCustom::queue).
    pub(crate) fn send(&mut self, text: &str) -> Result<(), Error> {
        match &mut self.device {
            Device::V2xCustom(custom) => custom.queue(text),
            _ => Err(Error::new(ErrorCode::InvalidArgument, "the sensor sends no texts")
                .wanted("a sensor.other.v2x_custom")),
        }
    }

    /// What it sends at the end of a tick at `now_secs`, whether somebody listens or not.
    pub(crate) fn transmit(
        &mut self,
        id: ActorId,
        mount: &Mount,
        around: &Surroundings,
        now_secs: f64,
    ) -> Option<Transmission> {
        match &mut self.device {
            Device::V2x(v2x) => v2x.transmit(id, mount, around, (now_secs, &mut self.noise)),
            Device::V2xCustom(custom) => custom.transmit(id, mount, around),
            _ => None,
        }
    }

    /// The end of a tick at `now_secs`; `None` when there is nothing to tell.
    pub(crate) fn tick(
        &mut self,
        id: ActorId,
        mount: &Mount,
        around: &Surroundings,
        now_secs: f64,
    ) -> Option<Outcome> {
        if let Device::Imu(imu) = &mut self.device {
            imu.feel(mount, around.dt_secs);
        }
        // What is said by radio is heard when it is said.
        if !self.listening || !(self.is_radio() || self.pace.take(now_secs)) {
            return None;
        }
        let noise = &mut self.noise;
        let measurement = match &mut self.device {
            Device::Camera => return Some(Outcome::Picture),
            Device::Rss => return None,
            Device::Collision => {
                let contacts = collision::measure(mount.carrier.as_ref()?, around);
                return (!contacts.is_empty()).then_some(Outcome::Measured(contacts));
            }
            Device::LaneInvasion(lines) => lines.measure(mount.carrier.as_ref()?, around.roads)?,
            Device::Obstacle(obstacle) => obstacle.measure(mount, around)?,
            Device::Gnss(gnss) => gnss.measure(around.roads, &mount.world_from_sensor, noise),
            Device::Imu(imu) => imu.measure(mount, noise),
            Device::Lidar(lidar) => lidar.measure(mount, around, noise),
            Device::SemanticLidar(lidar) => lidar.measure(mount, around),
            Device::Radar(radar) => radar.measure(mount, around, noise),
            Device::V2x(v2x) => v2x.measure(mount, around, noise)?,
            Device::V2xCustom(custom) => custom.measure(id, mount, around, noise)?,
        };
        Some(Outcome::Measured(vec![measurement]))
    }
}
