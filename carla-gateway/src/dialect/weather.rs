//! Weather.

use schemas::Weather;
use serde::{Deserialize, Serialize};

/// CARLA's fourteen parameters, in degrees, metres and per cent, in CARLA's order: cloudiness,
/// precipitation and its deposits, wind, azimuth and altitude of the sun, density, distance and
/// falloff of fog, wetness, scattering, Mie's and Rayleigh's scale, dust.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct WeatherParameters([f32; 14]);

impl WeatherParameters {
    pub(crate) fn of(weather: &Weather) -> Self {
        Self([
            weather.cloudiness_percent,
            weather.precipitation_percent,
            weather.precipitation_deposits_percent,
            weather.wind_intensity_percent,
            weather.sun_azimuth_rad.to_degrees(),
            weather.sun_altitude_rad.to_degrees(),
            weather.fog_density_percent,
            weather.fog_distance_m,
            weather.fog_falloff,
            weather.wetness_percent,
            weather.scattering_intensity,
            weather.mie_scattering_scale,
            weather.rayleigh_scattering_scale,
            weather.dust_storm_percent,
        ])
    }

    /// As recordings have it.
    pub(crate) fn recorded(&self) -> recording::Weather {
        recording::Weather(self.0)
    }

    /// The inverse of [`recorded`](Self::recorded); `None` for numbers that are none.
    pub(crate) fn of_recorded(recorded: &recording::Weather) -> Option<Self> {
        recorded.0.iter().all(|number| number.is_finite()).then_some(Self(recorded.0))
    }

    /// Whether it is CARLA's `WeatherParameters.Default`, -1 as far as the wetness: the weather
    /// that a map begins with.
    fn is_of_the_map(&self) -> bool {
        self.0[..10].iter().all(|number| *number < 0.0)
    }

    /// In our units; per cents out of range are clamped, as CARLA does.
    pub(crate) fn ours(&self) -> Weather {
        if self.is_of_the_map() {
            return Weather::CLEAR_NOON;
        }
        let [cloudiness, precipitation, deposits, wind, azimuth_deg, altitude_deg, ..] = self.0;
        let [.., density, fog_distance_m, falloff, wetness, scattering, mie, rayleigh, dust] =
            self.0;
        let percent = |number: f32| number.clamp(0.0, 100.0);
        Weather {
            cloudiness_percent: percent(cloudiness),
            precipitation_percent: percent(precipitation),
            precipitation_deposits_percent: percent(deposits),
            wind_intensity_percent: percent(wind),
            sun_azimuth_rad: azimuth_deg.to_radians(),
            sun_altitude_rad: altitude_deg.clamp(-90.0, 90.0).to_radians(),
            fog_density_percent: percent(density),
            fog_distance_m: fog_distance_m.max(0.0),
            fog_falloff: falloff.max(0.0),
            wetness_percent: percent(wetness),
            scattering_intensity: scattering.max(0.0),
            mie_scattering_scale: mie.max(0.0),
            rayleigh_scattering_scale: rayleigh.max(0.0),
            dust_storm_percent: percent(dust),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carlas_default_is_the_weather_that_a_map_begins_with() {
        let mut default = [-1.0; 14];
        default[10..].copy_from_slice(&[1.0, 0.03, 0.0331, 0.0]);
        assert_eq!(WeatherParameters(default).ours(), Weather::CLEAR_NOON);
        default[0] = 0.0;
        assert!(WeatherParameters(default).ours().sun_altitude_rad < 0.0);
    }

    #[test]
    fn fog_falloff_comes_before_wetness() {
        let weather = Weather { wetness_percent: 7.0, fog_falloff: 3.0, ..Weather::CLEAR_NOON };
        let bytes = rmp_serde::to_vec(&WeatherParameters::of(&weather)).unwrap();
        assert_eq!(bytes[0], 0x9e);
        assert_eq!(bytes[1 + 5 * 8 + 1..][..4], 3.0f32.to_be_bytes());
        let back = rmp_serde::from_slice::<WeatherParameters>(&bytes).unwrap().ours();
        assert!((back.sun_altitude_rad - weather.sun_altitude_rad).abs() < 1e-5);
    }
}
