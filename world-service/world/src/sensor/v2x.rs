//! Cooperative awareness messages: `sensor.other.v2x`.

use schemas::{ActorId, AwarenessMessage, Error, Measurement, StationKind, StationMotion, Vec3};
use serde::{Deserialize, Serialize};

use super::config::{NOISE_MAX, Settings};
use super::gnss::Gnss;
use super::imu::compass_rad;
use super::mount::{Mount, Station, Surroundings};
use super::noise::Noise;
use super::radio::{Antenna, Content, Radio, Transmission};
use crate::vehicle::GRAVITY_MPS2;

/// Sums of time steps are off by less than this.
const TOLERANCE_SECS: f64 = 1.0e-6;
/// Changes since the last message that ask for another one.
///
/// - **Source:** ETSI EN 302 637-2 V1.4.1, section 6.1.3.
const MOVED_M: f32 = 4.0;
const TURNED_DEG: f32 = 4.0;
const FASTER_MPS: f32 = 0.5;
/// Messages in a row without such changes before they are sent as seldom as may be.
const QUIET_MAX: u32 = 3;
/// How often lights are told.
const LIGHTS_SECS: f64 = 0.5;
/// How often a road side unit sends.
const ROAD_SIDE_SECS: f64 = 0.5;
/// Longest time between two messages.
const PERIOD_SECS_MAX: f64 = 3_600.0;

/// CARLA's attributes, and what was last sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct V2x {
    radio: Radio,
    /// Shortest and longest time between two messages.
    period_secs: [f64; 2],
    /// A message whenever the shortest time is over.
    fixed_rate: bool,
    place: Gnss,
    heading_bias_deg: f64,
    heading_deviation_deg: f64,
    /// m/s², by axis of the vehicle.
    acceleration_deviation: [f64; 3],
    yaw_rate_bias_radps: f64,
    yaw_rate_deviation_radps: f64,
    speed_deviation_mps: f64,
    service: Service,
}

/// When messages are made, and the motion they tell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Service {
    last: Option<Last>,
    /// Time between two messages while little changes; `None`: the longest.
    quiet_secs: Option<f64>,
    quiet: u32,
    lights_secs: Option<f64>,
    /// Of the host at the end of the last tick, world frame.
    velocity_mps: Option<Vec3>,
}

/// The station at its last message.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Last {
    secs: f64,
    position_m: Vec3,
    forward: Vec3,
    speed_mps: f32,
}

impl V2x {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        let bias = |id| settings.number(id, 0.0, -NOISE_MAX..=NOISE_MAX);
        let deviation = |id| settings.number(id, 0.0, 0.0..=NOISE_MAX);
        let period = |id, default| settings.number(id, default, 0.0..=PERIOD_SECS_MAX);
        Ok(Self {
            radio: Radio::new(settings)?,
            period_secs: [period("gen_cam_min", 0.1)?, period("gen_cam_max", 1.0)?],
            fixed_rate: settings.flag("fixed_rate", false)?,
            place: Gnss::new(settings)?,
            heading_bias_deg: bias("noise_head_bias")?,
            heading_deviation_deg: deviation("noise_head_stddev")?,
            acceleration_deviation: settings.axes("noise_accel_stddev_?", 0.0..=NOISE_MAX)?,
            yaw_rate_bias_radps: bias("noise_yawrate_bias")?,
            yaw_rate_deviation_radps: deviation("noise_yawrate_stddev")?,
            speed_deviation_mps: deviation("noise_vel_stddev_x")?,
            service: Service::default(),
        })
    }

    /// Whether it differs from `fresh` by what it did only.
    pub(super) fn is_used(&self, fresh: &Self) -> bool {
        Self { service: Service::default(), ..self.clone() } == *fresh
    }

    /// What the host sends in this tick. Nothing without a host.
    pub(super) fn transmit(
        &mut self,
        sensor: ActorId,
        mount: &Mount,
        around: &Surroundings,
        (now_secs, noise): (f64, &mut Noise),
    ) -> Option<Transmission> {
        let host = mount.host?;
        let station = (around.station)(host)?;
        let before_mps = self.service.velocity_mps.replace(station.velocity_mps);
        if !self.service.is_due(&station, now_secs, self.period_secs, self.fixed_rate) {
            return None;
        }
        let change_mps = station.velocity_mps - before_mps.unwrap_or(station.velocity_mps);
        let felt_mps2 = change_mps / around.dt_secs as f32 + Vec3::z() * GRAVITY_MPS2;
        let pose = &station.carrier.world_from_actor;
        let place = self.place.locate(around.roads, pose, noise);
        let tells_lights = station.has_wheels && self.service.tells_lights(now_secs);
        let message = AwarenessMessage {
            station: host,
            kind: station.kind,
            sim_secs: now_secs,
            latitude_deg: place.latitude_deg,
            longitude_deg: place.longitude_deg,
            altitude_m: place.altitude_m,
            motion: station.has_wheels.then(|| self.motion(&station, felt_mps2, noise)),
            lights: tells_lights.then_some(station.lights),
        };
        let antenna = Antenna::on_host(mount, around)?;
        Some(self.radio.transmission(sensor, antenna, Content::Awareness(message)))
    }

    /// `None` when nothing arrives, and without a host.
    pub(super) fn measure(
        &self,
        mount: &Mount,
        around: &Surroundings,
        noise: &mut Noise,
    ) -> Option<Measurement> {
        let antenna = Antenna::on_host(mount, around)?;
        let received = self.radio.receive(&antenna, around, noise, |sent| match &sent.content {
            Content::Awareness(message) if sent.antenna.host != antenna.host => {
                vec![message.clone()]
            }
            _ => Vec::new(),
        });
        (!received.is_empty()).then_some(Measurement::V2x(received))
    }

    fn motion(&self, station: &Station, felt_mps2: Vec3, noise: &mut Noise) -> StationMotion {
        let rotation = &station.carrier.world_from_actor.rotation;
        let heading_deg = f64::from(compass_rad(rotation * Vec3::x()).to_degrees())
            + self.heading_bias_deg
            + noise.normal(self.heading_deviation_deg);
        let along_mps = station.along_mps();
        let speed_mps = f64::from(along_mps.abs()) + noise.normal(self.speed_deviation_mps);
        let half_m = station.carrier.box_half_m;
        let jitter_mps2 = self.acceleration_deviation.map(|value| noise.normal(value) as f32);
        let yaw_rate_radps = rotation.inverse_transform_vector(&station.angular_radps).z;
        StationMotion {
            heading_deg: heading_deg.rem_euclid(360.0) as f32,
            speed_mps: speed_mps.max(0.0) as f32,
            forward: along_mps >= 0.0,
            length_m: 2.0 * half_m.x,
            width_m: 2.0 * half_m.y,
            acceleration_mps2: rotation.inverse_transform_vector(&felt_mps2)
                + Vec3::from(jitter_mps2),
            yaw_rate_radps: yaw_rate_radps
                + (self.yaw_rate_bias_radps + noise.normal(self.yaw_rate_deviation_radps)) as f32,
        }
    }
}

impl Service {
    /// Whether a message is to be made now; if so it counts as made.
    fn is_due(
        &mut self,
        station: &Station,
        now_secs: f64,
        period_secs: [f64; 2],
        fixed_rate: bool,
    ) -> bool {
        let due = self.last.is_none_or(|last| {
            let elapsed_secs = now_secs - last.secs + TOLERANCE_SECS;
            if station.kind == StationKind::RoadSideUnit {
                return elapsed_secs >= ROAD_SIDE_SECS;
            }
            let allowed = elapsed_secs >= period_secs[0];
            allowed && (fixed_rate || self.wants(&last, station, elapsed_secs, period_secs[1]))
        });
        if due {
            self.last = Some(Last::of(station, now_secs));
        }
        due
    }

    /// Whether enough has changed since the last message, or enough time is over.
    fn wants(
        &mut self,
        last: &Last,
        station: &Station,
        elapsed_secs: f64,
        longest_secs: f64,
    ) -> bool {
        if last.differs(station) {
            self.quiet_secs = Some(elapsed_secs.min(longest_secs));
            self.quiet = 0;
            return true;
        }
        if elapsed_secs < self.quiet_secs.unwrap_or(longest_secs) {
            return false;
        }
        self.quiet += 1;
        if self.quiet >= QUIET_MAX {
            self.quiet_secs = None;
        }
        true
    }

    fn tells_lights(&mut self, now_secs: f64) -> bool {
        let due =
            self.lights_secs.is_none_or(|last| now_secs - last + TOLERANCE_SECS >= LIGHTS_SECS);
        if due {
            self.lights_secs = Some(now_secs);
        }
        due
    }
}

impl Last {
    fn of(station: &Station, secs: f64) -> Self {
        let pose = &station.carrier.world_from_actor;
        Self {
            secs,
            position_m: pose.translation.vector,
            forward: pose.rotation * Vec3::x(),
            speed_mps: station.along_mps(),
        }
    }

    fn differs(&self, station: &Station) -> bool {
        let now = Self::of(station, self.secs);
        (now.position_m - self.position_m).norm() > MOVED_M
            || now.forward.angle(&self.forward).to_degrees() > TURNED_DEG
            || (now.speed_mps - self.speed_mps).abs() > FASTER_MPS
    }
}
