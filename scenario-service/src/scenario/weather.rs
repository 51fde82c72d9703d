//! CARLA's weather presets by name, and weather given value by value.

use schemas::{SplitMix64, Weather};
use serde_json::Value;

use super::ScenarioError;
use super::config::wrong;
use crate::openenv::coerce::{self, Bounds};

/// From which `random` draws: every preset by day that the reference server draws from.
const RANDOM: [&str; 12] = [
    "ClearNoon",
    "CloudyNoon",
    "WetNoon",
    "WetCloudyNoon",
    "HardRainNoon",
    "SoftRainNoon",
    "ClearSunset",
    "CloudySunset",
    "WetSunset",
    "WetCloudySunset",
    "HardRainSunset",
    "SoftRainSunset",
];

/// What a client asked the sky to do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum WeatherChoice {
    /// A known preset.
    Preset(&'static str),
    /// Drawn anew at every reset.
    Random,
    /// Value by value.
    Custom(Weather),
}

impl Default for WeatherChoice {
    fn default() -> Self {
        Self::Preset("ClearNoon")
    }
}

impl WeatherChoice {
    /// A preset's name, `random`, or an object of CARLA's parameters over `ClearNoon`.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for anything else.
    pub(crate) fn from_json(value: &Value) -> Result<Self, ScenarioError> {
        match value {
            Value::String(name) if name == "random" => Ok(Self::Random),
            Value::String(name) => Weather::presets()
                .find(|known| known == name)
                .map(Self::Preset)
                .ok_or_else(|| wrong("weather", "a CARLA weather preset or \"random\"", value)),
            Value::Object(values) => {
                let mut weather = Weather::CLEAR_NOON;
                for (name, value) in values {
                    set(&mut weather, name, value)?;
                }
                Ok(Self::Custom(weather))
            }
            _ => Err(wrong("weather", "a preset's name or an object of parameters", value)),
        }
    }

    /// The weather and the name that state reports.
    pub(crate) fn resolve(&self, rng: &mut SplitMix64) -> (Weather, String) {
        let name = match self {
            Self::Custom(weather) => return (*weather, "custom".to_owned()),
            Self::Preset(name) => name,
            Self::Random => rng.choose(&RANDOM).copied().unwrap_or("ClearNoon"),
        };
        (Weather::preset(name).unwrap_or(Weather::CLEAR_NOON), name.to_owned())
    }
}

fn set(weather: &mut Weather, name: &str, value: &Value) -> Result<(), ScenarioError> {
    let percent = Bounds { min: 0.0, max: 100.0 };
    let free = Bounds { min: 0.0, max: 100_000.0 };
    let angle = |max: f64| Bounds { min: -max, max };
    let (target, bounds): (&mut f32, Bounds) = match name {
        "cloudiness" => (&mut weather.cloudiness_percent, percent),
        "precipitation" => (&mut weather.precipitation_percent, percent),
        "precipitation_deposits" => (&mut weather.precipitation_deposits_percent, percent),
        "wind_intensity" => (&mut weather.wind_intensity_percent, percent),
        "sun_azimuth_angle" => (&mut weather.sun_azimuth_rad, angle(360.0)),
        "sun_altitude_angle" => (&mut weather.sun_altitude_rad, angle(90.0)),
        "fog_density" => (&mut weather.fog_density_percent, percent),
        "fog_distance" => (&mut weather.fog_distance_m, free),
        "wetness" => (&mut weather.wetness_percent, percent),
        "fog_falloff" => (&mut weather.fog_falloff, free),
        "scattering_intensity" => (&mut weather.scattering_intensity, free),
        "mie_scattering_scale" => (&mut weather.mie_scattering_scale, free),
        "rayleigh_scattering_scale" => (&mut weather.rayleigh_scattering_scale, free),
        "dust_storm" => (&mut weather.dust_storm_percent, percent),
        _ => return Err(wrong("weather", "an object of CARLA's parameters", &name.into())),
    };
    let wanted = format!("a {name} from {} to {}", bounds.min, bounds.max);
    let read = coerce::number(name, value, bounds).map_err(|_| wrong("weather", &wanted, value))?;
    *target = if name.ends_with("_angle") { read.to_radians() as f32 } else { read as f32 };
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn random_draws_every_preset_of_its_list_and_the_same_one_for_a_seed() {
        let draw = |seed| WeatherChoice::Random.resolve(&mut SplitMix64::new(seed)).1;
        let names: std::collections::BTreeSet<String> = (0..500).map(draw).collect();
        assert_eq!(names.len(), RANDOM.len());
        assert_eq!(draw(3), draw(3));
    }

    #[test]
    fn parameters_are_read_one_by_one_and_wrong_ones_are_refused() {
        let choice = WeatherChoice::from_json(&json!({ "wetness": 80, "sun_altitude_angle": 90 }));
        let (weather, name) = choice.unwrap().resolve(&mut SplitMix64::new(0));
        assert_eq!((weather.wetness_percent, name.as_str()), (80.0, "custom"));
        assert!((weather.sun_altitude_rad - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        for value in [json!("Nice"), json!({ "wetness": 101 }), json!({ "rain": 1 }), json!(3)] {
            assert!(WeatherChoice::from_json(&value).is_err(), "{value}");
        }
    }
}
