//! Radar: `sensor.other.radar`.
//!
//! **Source:** CARLA's radar: rays to random points of an ellipse at the range; the distance from
//! the middle of the ellipse, not the area, is equally distributed, so that echoes are denser
//! ahead.

use nalgebra::{ComplexField, RealField};
use schemas::{Error, Measurement, RadarDetection, Vec3};
use serde::{Deserialize, Serialize};

use super::config::{POINTS_PER_SECOND_MAX, POINTS_PER_TICK_MAX, RANGE_M_MAX, Settings};
use super::mount::{Mount, Surroundings};
use super::noise::Noise;
use crate::rays::{Ray, Stack};

/// Widest field of view, in degrees: rays go through a plane ahead.
const FOV_DEG_MAX: f32 = 179.0;

/// CARLA's attributes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Radar {
    /// Tangents of half of the horizontal and vertical field of view.
    half_tan: [f32; 2],
    range_m: f32,
    points_per_second: u32,
}

impl Radar {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        let half_tan = |id: &str| -> Result<f32, Error> {
            let fov_deg = settings.number(id, 30.0, 0.0..=FOV_DEG_MAX)?;
            Ok(ComplexField::tan(fov_deg.to_radians() / 2.0))
        };
        Ok(Self {
            half_tan: [half_tan("horizontal_fov")?, half_tan("vertical_fov")?],
            range_m: settings.number("range", 100.0, 0.0..=RANGE_M_MAX)?,
            points_per_second: settings.number(
                "points_per_second",
                1_500,
                0..=POINTS_PER_SECOND_MAX,
            )?,
        })
    }

    pub(super) fn measure(
        &self,
        mount: &Mount,
        around: &Surroundings,
        noise: &mut Noise,
    ) -> Measurement {
        let scene = around.sight.scene();
        let mut stack = Stack::new();
        // A small term, as 1,500 a second in 0.02 s are 30 and not 29.999….
        let rays = (f64::from(self.points_per_second) * around.dt_secs + 1.0e-6) as u32;
        let rays = rays.min(POINTS_PER_TICK_MAX);
        let echoes = (0..rays).filter_map(|_| {
            let direction = self.direction(noise);
            let pose = &mount.world_from_sensor;
            let ray = Ray::new(pose.translation.vector, pose.rotation * direction);
            let hit = scene.nearest(&ray, self.range_m, &mut stack)?;
            let target_mps = hit.actor.map_or(Vec3::zeros(), |actor| {
                (around.velocity_mps)(actor, ray.at(hit.distance_m))
            });
            Some(RadarDetection {
                speed_mps: (target_mps - mount.velocity_mps).dot(&ray.direction),
                azimuth_rad: RealField::atan2(direction.y, direction.x),
                altitude_rad: ComplexField::asin(direction.z),
                depth_m: hit.distance_m,
            })
        });
        Measurement::Radar(echoes.collect())
    }

    /// Of one ray, unit, sensor frame.
    fn direction(&self, noise: &mut Noise) -> Vec3 {
        let radius = noise.uniform();
        let (sin, cos) = ComplexField::sin_cos(f32::two_pi() * noise.uniform());
        let [half_width, half_height] = self.half_tan;
        Vec3::new(1.0, half_width * radius * cos, half_height * radius * sin).normalize()
    }
}
