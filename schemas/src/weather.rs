//! CARLA's weather presets.
//!
//! **Source:** values of the CARLA 0.9.16 client library; the order of the first fourteen is that
//! of CARLA 0.8, by whose numbers papers name them.

use crate::Weather;

/// Cloudiness, precipitation, deposits, wind, sun altitude in degrees, fog density, wetness, dust.
const PRESETS: [(&str, [f32; 8]); 22] = [
    ("ClearNoon", [5.0, 0.0, 0.0, 10.0, 45.0, 2.0, 0.0, 0.0]),
    ("CloudyNoon", [60.0, 0.0, 0.0, 10.0, 45.0, 3.0, 0.0, 0.0]),
    ("WetNoon", [5.0, 0.0, 50.0, 10.0, 45.0, 3.0, 0.0, 0.0]),
    ("WetCloudyNoon", [60.0, 0.0, 50.0, 10.0, 45.0, 3.0, 0.0, 0.0]),
    ("MidRainyNoon", [60.0, 60.0, 60.0, 60.0, 45.0, 3.0, 0.0, 0.0]),
    ("HardRainNoon", [100.0, 100.0, 90.0, 100.0, 45.0, 7.0, 0.0, 0.0]),
    ("SoftRainNoon", [20.0, 30.0, 50.0, 30.0, 45.0, 3.0, 0.0, 0.0]),
    ("ClearSunset", [5.0, 0.0, 0.0, 10.0, 15.0, 2.0, 0.0, 0.0]),
    ("CloudySunset", [60.0, 0.0, 0.0, 10.0, 15.0, 3.0, 0.0, 0.0]),
    ("WetSunset", [5.0, 0.0, 50.0, 10.0, 15.0, 2.0, 0.0, 0.0]),
    ("WetCloudySunset", [60.0, 0.0, 50.0, 10.0, 15.0, 2.0, 0.0, 0.0]),
    ("MidRainSunset", [60.0, 60.0, 60.0, 60.0, 15.0, 3.0, 0.0, 0.0]),
    ("HardRainSunset", [100.0, 100.0, 90.0, 100.0, 15.0, 7.0, 0.0, 0.0]),
    ("SoftRainSunset", [20.0, 30.0, 50.0, 30.0, 15.0, 2.0, 0.0, 0.0]),
    ("ClearNight", [5.0, 0.0, 0.0, 10.0, -90.0, 60.0, 0.0, 0.0]),
    ("CloudyNight", [60.0, 0.0, 0.0, 10.0, -90.0, 60.0, 0.0, 0.0]),
    ("WetNight", [5.0, 0.0, 50.0, 10.0, -90.0, 60.0, 60.0, 0.0]),
    ("WetCloudyNight", [60.0, 0.0, 50.0, 10.0, -90.0, 60.0, 60.0, 0.0]),
    ("SoftRainNight", [60.0, 30.0, 50.0, 30.0, -90.0, 60.0, 60.0, 0.0]),
    ("MidRainyNight", [80.0, 60.0, 60.0, 60.0, -90.0, 60.0, 80.0, 0.0]),
    ("HardRainNight", [100.0, 100.0, 90.0, 100.0, -90.0, 100.0, 100.0, 0.0]),
    ("DustStorm", [100.0, 0.0, 0.0, 100.0, 45.0, 2.0, 0.0, 100.0]),
];

impl Weather {
    /// Names of CARLA's presets. The first fourteen have the numbers 1 to 14 in CARLA 0.8.
    pub fn presets() -> impl ExactSizeIterator<Item = &'static str> {
        PRESETS.iter().map(|(name, _)| *name)
    }

    /// A preset of CARLA's by name; `None` for another name.
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        let (_, values) = PRESETS.iter().find(|(known, _)| *known == name)?;
        let [cloudiness, precipitation, deposits, wind, sun_altitude_deg, fog, wetness, dust] =
            *values;
        Some(Self {
            cloudiness_percent: cloudiness,
            precipitation_percent: precipitation,
            precipitation_deposits_percent: deposits,
            wind_intensity_percent: wind,
            sun_altitude_rad: sun_altitude_deg.to_radians(),
            fog_density_percent: fog,
            wetness_percent: wetness,
            dust_storm_percent: dust,
            ..Self::CLEAR_NOON
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_noon_is_the_one_that_worlds_start_with() {
        assert_eq!(Weather::preset("ClearNoon"), Some(Weather::CLEAR_NOON));
        assert_eq!(Weather::preset("Nice"), None);
    }

    #[test]
    fn the_first_fourteen_are_where_papers_have_them() {
        let at = |number: usize| Weather::presets().nth(number - 1);
        for (number, name) in [
            (1, "ClearNoon"),
            (3, "WetNoon"),
            (4, "WetCloudyNoon"),
            (6, "HardRainNoon"),
            (8, "ClearSunset"),
            (10, "WetSunset"),
            (14, "SoftRainSunset"),
        ] {
            assert_eq!(at(number), Some(name));
        }
    }
}
