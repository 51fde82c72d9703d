//! What is ahead: `sensor.other.obstacle`.

use schemas::{Error, Measurement, Vec3};
use serde::{Deserialize, Serialize};

use super::config::{RANGE_M_MAX, Settings};
use super::mount::{Mount, Surroundings};
use crate::rays::{Ray, Sweep};

/// CARLA's attributes: a ball of `radius_m` that moves forward from the sensor. `only_dynamics`
/// leaves out ground and scenery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Obstacle {
    distance_m: f32,
    radius_m: f32,
    only_dynamics: bool,
}

impl Obstacle {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        // It only asks for lines to be drawn, but has to be sound.
        settings.flag("debug_linetrace", false)?;
        Ok(Self {
            distance_m: settings.number("distance", 5.0, 0.0..=RANGE_M_MAX)?,
            radius_m: settings.number("hit_radius", 0.5, 0.0..=RANGE_M_MAX)?,
            only_dynamics: settings.flag("only_dynamics", false)?,
        })
    }

    /// `None` when the way is free.
    pub(super) fn measure(&self, mount: &Mount, around: &Surroundings) -> Option<Measurement> {
        let pose = &mount.world_from_sensor;
        let sweep = Sweep {
            ray: Ray::new(pose.translation.vector, pose.rotation * Vec3::x()),
            radius_m: self.radius_m,
            reach_m: self.distance_m,
        };
        let carrier = mount.carrier.map(|carrier| carrier.id);
        let touch = around.sight.scene().sweep(&sweep, !self.only_dynamics, carrier)?;
        let (other, tag, distance_m) = (touch.actor, touch.tag, touch.distance_m);
        Some(Measurement::Obstacle { other, tag, distance_m })
    }
}
