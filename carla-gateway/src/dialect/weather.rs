//! Weather.

use schemas::Weather;
use serde::{Deserialize, Serialize};

/// CARLA's fourteen parameters, in degrees, metres and per cent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WeatherParameters {
    cloudiness: f32,
    precipitation: f32,
    precipitation_deposits: f32,
    wind_intensity: f32,
    sun_azimuth_angle: f32,
    sun_altitude_angle: f32,
    fog_density: f32,
    fog_distance: f32,
    fog_falloff: f32,
    wetness: f32,
    scattering_intensity: f32,
    mie_scattering_scale: f32,
    rayleigh_scattering_scale: f32,
    dust_storm: f32,
}

impl WeatherParameters {
    pub(crate) fn of(weather: &Weather) -> Self {
        Self {
            cloudiness: weather.cloudiness_percent,
            precipitation: weather.precipitation_percent,
            precipitation_deposits: weather.precipitation_deposits_percent,
            wind_intensity: weather.wind_intensity_percent,
            sun_azimuth_angle: weather.sun_azimuth_rad.to_degrees(),
            sun_altitude_angle: weather.sun_altitude_rad.to_degrees(),
            fog_density: weather.fog_density_percent,
            fog_distance: weather.fog_distance_m,
            fog_falloff: weather.fog_falloff,
            wetness: weather.wetness_percent,
            scattering_intensity: weather.scattering_intensity,
            mie_scattering_scale: weather.mie_scattering_scale,
            rayleigh_scattering_scale: weather.rayleigh_scattering_scale,
            dust_storm: weather.dust_storm_percent,
        }
    }

    /// In our units; per cents out of range are clamped, as CARLA does.
    pub(crate) fn ours(&self) -> Weather {
        let percent = |number: f32| number.clamp(0.0, 100.0);
        Weather {
            cloudiness_percent: percent(self.cloudiness),
            precipitation_percent: percent(self.precipitation),
            precipitation_deposits_percent: percent(self.precipitation_deposits),
            wind_intensity_percent: percent(self.wind_intensity),
            sun_azimuth_rad: self.sun_azimuth_angle.to_radians(),
            sun_altitude_rad: self.sun_altitude_angle.clamp(-90.0, 90.0).to_radians(),
            fog_density_percent: percent(self.fog_density),
            fog_distance_m: self.fog_distance.max(0.0),
            fog_falloff: self.fog_falloff.max(0.0),
            wetness_percent: percent(self.wetness),
            scattering_intensity: self.scattering_intensity.max(0.0),
            mie_scattering_scale: self.mie_scattering_scale.max(0.0),
            rayleigh_scattering_scale: self.rayleigh_scattering_scale.max(0.0),
            dust_storm_percent: percent(self.dust_storm),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
