//! Satellite navigation: `sensor.other.gnss`.

use nalgebra::Point3;
use roads::{GeoPlace, Map};
use schemas::{Error, Measurement, Pose};
use serde::{Deserialize, Serialize};

use super::config::{NOISE_MAX, Settings};
use super::noise::Noise;

/// Bias and deviation of one coordinate, in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Fault {
    bias: f64,
    deviation: f64,
}

/// CARLA's attributes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Gnss {
    latitude_deg: Fault,
    longitude_deg: Fault,
    altitude_m: Fault,
}

impl Gnss {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        let fault = |name: &str| -> Result<Fault, Error> {
            Ok(Fault {
                bias: settings.number(
                    &format!("noise_{name}_bias"),
                    0.0,
                    -NOISE_MAX..=NOISE_MAX,
                )?,
                deviation: settings.number(
                    &format!("noise_{name}_stddev"),
                    0.0,
                    0.0..=NOISE_MAX,
                )?,
            })
        };
        Ok(Self {
            latitude_deg: fault("lat")?,
            longitude_deg: fault("lon")?,
            altitude_m: fault("alt")?,
        })
    }

    pub(super) fn measure(
        &self,
        roads: &Map,
        world_from_sensor: &Pose,
        noise: &mut Noise,
    ) -> Measurement {
        let GeoPlace { latitude_deg, longitude_deg, altitude_m } =
            self.locate(roads, world_from_sensor, noise);
        Measurement::Gnss { latitude_deg, longitude_deg, altitude_m }
    }

    /// Where a pose seems to be.
    pub(super) fn locate(&self, roads: &Map, pose: &Pose, noise: &mut Noise) -> GeoPlace {
        let position_m: nalgebra::Vector3<f64> = nalgebra::convert(pose.translation.vector);
        let place = roads.geo_place(&Point3::from(position_m));
        let mut read =
            |true_value: f64, fault: Fault| true_value + fault.bias + noise.normal(fault.deviation);
        GeoPlace {
            latitude_deg: read(place.latitude_deg, self.latitude_deg),
            longitude_deg: read(place.longitude_deg, self.longitude_deg),
            altitude_m: read(place.altitude_m, self.altitude_m),
        }
    }
}
