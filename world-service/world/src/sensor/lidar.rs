//! Lidars: `sensor.lidar.ray_cast` and `sensor.lidar.ray_cast_semantic`.
//!
//! **Source:** CARLA's ray-cast lidars: channels spread evenly from the upper to the lower limit;
//! in a tick of dt the sensor turns by rotation_frequency · dt of its horizontal field of view,
//! clockwise seen from above, and every channel measures points_per_second · dt / channels times.
//! With `sensor_tick` it turns only in the ticks in which it measures.

use nalgebra::ComplexField;
use schemas::{Error, LidarPoint, Measurement, Scan, SemanticLidarPoint, Vec3};
use serde::{Deserialize, Serialize};

use super::config::{POINTS_PER_SECOND_MAX, POINTS_PER_TICK_MAX, RANGE_M_MAX, Settings};
use super::mount::{Mount, Surroundings};
use super::noise::Noise;
use crate::rays::{Hit, Packet, RAYS, Ray, Stacks};

/// Most lasers one above the other.
const CHANNELS_MAX: u32 = 1_024;
/// Fastest rotation.
const ROTATION_HZ_MAX: f64 = 1_000.0;
/// Neighbouring rays within this angle are cheaper together than one by one, also where almost half
/// of them are lost.
const PACKET_RAD_MAX: f64 = 0.35;

/// What both lidars have, and how far they have turned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Beams {
    channels: u32,
    range_m: f32,
    points_per_second: u32,
    rotation_hz: f64,
    upper_rad: f32,
    lower_rad: f32,
    horizontal_fov_rad: f64,
    /// From the left edge of the field of view, clockwise.
    turned_rad: f64,
}

/// `sensor.lidar.ray_cast`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Lidar {
    beams: Beams,
    /// Of the light, per metre.
    attenuation_per_m: f32,
    /// Share of rays that are lost whatever they meet.
    dropoff_general: f32,
    /// Points brighter than this are never lost.
    dropoff_intensity_limit: f32,
    /// Share of points that are lost at intensity 0.
    dropoff_zero_intensity: f32,
    /// Of the distance.
    deviation_m: f64,
}

/// `sensor.lidar.ray_cast_semantic`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SemanticLidar {
    beams: Beams,
}

impl Lidar {
    /// Whether it differs from `fresh` by its state only.
    pub(super) fn is_used(&self, fresh: &Self) -> bool {
        self.beams.is_turned(&fresh.beams)
            && Self { beams: fresh.beams.clone(), ..self.clone() } == *fresh
    }

    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        Ok(Self {
            beams: Beams::new(settings)?,
            attenuation_per_m: settings.number(
                "atmosphere_attenuation_rate",
                0.004,
                0.0..=1.0e3,
            )?,
            dropoff_general: settings.number("dropoff_general_rate", 0.45, 0.0..=1.0)?,
            dropoff_intensity_limit: settings.number("dropoff_intensity_limit", 0.8, 0.0..=1.0)?,
            dropoff_zero_intensity: settings.number("dropoff_zero_intensity", 0.4, 0.0..=1.0)?,
            deviation_m: settings.number("noise_stddev", 0.0, 0.0..=1.0e3)?,
        })
    }

    pub(super) fn measure(
        &mut self,
        mount: &Mount,
        around: &Surroundings,
        noise: &mut Noise,
    ) -> Measurement {
        let (attenuation_per_m, deviation_m) = (self.attenuation_per_m, self.deviation_m);
        let (general, limit, zero) =
            (self.dropoff_general, self.dropoff_intensity_limit, self.dropoff_zero_intensity);
        Measurement::Lidar(self.beams.scan(mount, around, |direction, cast| {
            if general > 0.0 && noise.uniform() < general {
                return None;
            }
            let hit = cast()?;
            let intensity = ComplexField::exp(-attenuation_per_m * hit.distance_m);
            // From 1 - zero at intensity 0 to 1 at the limit.
            let kept = intensity > limit || noise.uniform() < 1.0 - zero + zero * intensity / limit;
            let distance_m = hit.distance_m + noise.normal(deviation_m) as f32;
            let position_m = (direction * distance_m).into();
            kept.then_some(LidarPoint { position_m, intensity })
        }))
    }
}

impl SemanticLidar {
    pub(super) fn is_used(&self, fresh: &Self) -> bool {
        self.beams.is_turned(&fresh.beams)
    }

    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        Ok(Self { beams: Beams::new(settings)? })
    }

    pub(super) fn measure(&mut self, mount: &Mount, around: &Surroundings) -> Measurement {
        let rotation = mount.world_from_sensor.rotation;
        Measurement::SemanticLidar(self.beams.scan(mount, around, |direction, cast| {
            let hit = cast()?;
            Some(SemanticLidarPoint {
                position_m: (direction * hit.distance_m).into(),
                incidence_cos: -(rotation * direction).dot(&hit.normal),
                actor: hit.actor.map_or(0, schemas::ActorId::get),
                tag: hit.tag.into(),
            })
        }))
    }
}

impl Beams {
    fn new(settings: Settings) -> Result<Self, Error> {
        let degrees = |id: &str, default: f32| {
            settings.number(id, default, -90.0..=90.0).map(f32::to_radians)
        };
        let horizontal_fov_deg: f64 = settings.number("horizontal_fov", 360.0, 1.0e-3..=360.0)?;
        Ok(Self {
            channels: settings.number("channels", 32, 1..=CHANNELS_MAX)?,
            range_m: settings.number("range", 10.0, 0.0..=RANGE_M_MAX)?,
            points_per_second: settings.number(
                "points_per_second",
                56_000,
                0..=POINTS_PER_SECOND_MAX,
            )?,
            rotation_hz: settings.number("rotation_frequency", 10.0, 0.0..=ROTATION_HZ_MAX)?,
            upper_rad: degrees("upper_fov", 10.0)?,
            lower_rad: degrees("lower_fov", -30.0)?,
            horizontal_fov_rad: horizontal_fov_deg.to_radians(),
            turned_rad: 0.0,
        })
    }

    /// One tick of turning. `point` makes a point of the direction of a ray in the sensor's frame
    /// and of what it meets when it is cast.
    fn scan<Point>(
        &mut self,
        mount: &Mount,
        around: &Surroundings,
        mut point: impl FnMut(Vec3, &mut dyn FnMut() -> Option<Hit>) -> Option<Point>,
    ) -> Scan<Point> {
        let points = f64::from(self.points_per_second) * around.dt_secs / f64::from(self.channels);
        let points_max = POINTS_PER_TICK_MAX / self.channels;
        let azimuths = self.turn((points.round() as u32).min(points_max), around.dt_secs);
        let step_rad = self.way_rad(around.dt_secs) / azimuths.len() as f64;
        let is_dense = step_rad * RAYS as f64 <= PACKET_RAD_MAX;
        let scene = around.sight.scene();
        let pose = &mount.world_from_sensor;
        let mut stacks = Stacks::default();
        let mut scan = Scan {
            end_angle_rad: self.turned_rad as f32,
            points_per_channel: Vec::with_capacity(self.channels as usize),
            points: Vec::with_capacity(self.channels as usize * azimuths.len()),
        };
        for channel in 0..self.channels {
            let (sin, cos) = ComplexField::sin_cos(self.elevation_rad(channel));
            let before = scan.points.len();
            for azimuths in azimuths.chunks(RAYS) {
                let direction = |at: usize| {
                    let (azimuth_sin, azimuth_cos): (f32, f32) = azimuths[at];
                    Vec3::new(cos * azimuth_cos, cos * azimuth_sin, sin)
                };
                let ray = |at| Ray::new(pose.translation.vector, pose.rotation * direction(at));
                let hits = is_dense.then(|| {
                    let packet = Packet::new(azimuths.len(), ray);
                    scene.nearest_of(&packet, self.range_m, &mut stacks)
                });
                scan.points.extend((0..azimuths.len()).filter_map(|at| {
                    let mut cast = || match &hits {
                        Some(hits) => hits[at],
                        None => scene.nearest(&ray(at), self.range_m, &mut stacks.of_rays),
                    };
                    point(direction(at), &mut cast)
                }));
            }
            scan.points_per_channel.push((scan.points.len() - before) as u32);
        }
        scan
    }

    /// Turns by one tick; sine and cosine of every azimuth on the way.
    fn turn(&mut self, points: u32, dt_secs: f64) -> Vec<(f32, f32)> {
        let way_rad = self.way_rad(dt_secs);
        let start_rad = self.turned_rad;
        self.turned_rad = (start_rad + way_rad) % self.horizontal_fov_rad;
        let azimuth = |point: u32| {
            let turned_rad = start_rad + way_rad * f64::from(point) / f64::from(points);
            ComplexField::sin_cos(self.azimuth_rad(turned_rad))
        };
        (0..points).map(azimuth).collect()
    }

    /// By how much it turns in a tick.
    fn way_rad(&self, dt_secs: f64) -> f64 {
        self.rotation_hz * dt_secs * self.horizontal_fov_rad
    }

    /// Counter-clockwise from the sensor's x axis, of a turn from the left edge.
    fn azimuth_rad(&self, turned_rad: f64) -> f32 {
        (self.horizontal_fov_rad / 2.0 - turned_rad % self.horizontal_fov_rad) as f32
    }

    /// Whether it differs from `fresh` by how far it has turned only.
    fn is_turned(&self, fresh: &Self) -> bool {
        (0.0..=self.horizontal_fov_rad).contains(&self.turned_rad)
            && Self { turned_rad: 0.0, ..self.clone() } == *fresh
    }

    fn elevation_rad(&self, channel: u32) -> f32 {
        let share = channel as f32 / (self.channels - 1).max(1) as f32;
        self.upper_rad + (self.lower_rad - self.upper_rad) * share
    }
}
