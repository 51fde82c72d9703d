//! Sun, sky, haze: what the weather of a frame means to a camera.

use schemas::{Tick, Vec3, Weather};

/// Light of one frame. Colours are linear radiance; 1 is a white wall in full sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Light {
    /// Unit vector to the sun, or to the moon at night, in the world.
    pub to_light: Vec3,
    /// Of the sun or moon on a surface that faces it.
    pub direct: Vec3,
    /// Of the sky straight up.
    pub zenith: Vec3,
    /// Of the sky at the horizon, and of far haze.
    pub horizon: Vec3,
    /// Of what the ground throws back upwards.
    pub bounce: Vec3,
    /// Brightness of the sun's disc; 0 at night and behind clouds.
    pub disc: f32,
    /// 0 clear to 1 overcast.
    pub cloud: f32,
    /// Haze per metre beyond `haze_start_m`: a part `1 - exp(-haze_per_m * (distance - start))` of
    /// what is seen.
    pub haze_per_m: f32,
    /// Nearer than this the air is clear.
    pub haze_start_m: f32,
    /// How fast fog thins upwards: by a factor e in 1 over this; 0: not at all.
    pub haze_fall_per_m: f32,
    /// 0 dry to 1 heavy rain in the air.
    pub rain: f32,
    /// 0 to 1, another one in every tick: which drops are seen.
    pub rain_phase: f32,
    /// 0 dry to 1 wet roads.
    pub wet: f32,
    /// 0 by day to 1 by night: lamps and windows are lit.
    pub night: f32,
    /// 0 under a high sun to 1 once it is down: how far a camera opens.
    pub dim: f32,
}

/// Below this altitude the moon takes over.
const SUN_SET_RAD: f32 = -0.05;
/// What a town's lamps add everywhere at night, besides what those nearby do.
const STREET_LIGHT: Vec3 = Vec3::new(0.034, 0.027, 0.019);
/// Less fog than this is the haze of a clear day, which is the same at all heights.
const FOG_MIN: f32 = 0.04;
/// Unreal Engine halves fog in 10 m over its falloff.
const FALL_PER_M: f32 = std::f32::consts::LN_2 / 10.0;
const FALLOFF_MAX: f32 = 10.0;
/// Where the moon stands.
const MOON_ALTITUDE_RAD: f32 = 0.9;

impl Light {
    /// **Source:** colours chosen by eye against photographs; angles as in [`Weather`], azimuth
    /// counter-clockwise from x.
    pub(crate) fn of(weather: &Weather, tick: Tick) -> Self {
        let cloud = share(weather.cloudiness_percent);
        let rain = share(weather.precipitation_percent);
        let altitude_rad = weather.sun_altitude_rad;
        // 0 at sunset, 1 once the sun is about 25° up.
        let day = smooth(altitude_rad.sin(), -0.08, 0.42);
        let dusk = smooth(altitude_rad.sin(), -0.2, 0.02) * (1.0 - day);
        let dust = share(weather.dust_storm_percent);
        let grey = (0.75 * cloud + 0.25 * rain + 0.6 * dust).min(1.0);

        let clear_zenith = mix(Vec3::new(0.012, 0.018, 0.034), Vec3::new(0.13, 0.29, 0.66), day);
        let clear_horizon = mix(Vec3::new(0.035, 0.040, 0.056), Vec3::new(0.60, 0.74, 0.90), day)
            + Vec3::new(0.55, 0.24, 0.08) * dusk;
        let overcast = Vec3::new(0.52, 0.55, 0.60) * (0.03 + 0.97 * day) * (1.0 - 0.35 * rain);
        let sand = Vec3::new(0.50, 0.36, 0.20) * (0.03 + 0.97 * day);
        let zenith = mix(mix(clear_zenith, overcast * 0.85, grey), sand, 0.8 * dust);
        let horizon = mix(mix(clear_horizon, overcast, grey), sand, dust.sqrt());

        let sun_is_up = altitude_rad > SUN_SET_RAD;
        let warm = mix(Vec3::new(1.0, 0.52, 0.24), Vec3::new(1.0, 0.955, 0.87), day);
        let sun = warm * 2.6 * smooth(altitude_rad.sin(), -0.06, 0.3).max(0.05 * day);
        let moon = Vec3::new(0.030, 0.038, 0.055);
        let direct = if sun_is_up { sun } else { moon } * (1.0 - 0.93 * grey);

        let night = 1.0 - smooth(altitude_rad.sin(), -0.05, 0.12);
        let fog = share(weather.fog_density_percent);
        Self {
            to_light: direction(
                weather.sun_azimuth_rad,
                if sun_is_up { altitude_rad.max(0.05) } else { MOON_ALTITUDE_RAD },
            ),
            direct,
            zenith,
            horizon,
            bounce: (zenith + horizon) * 0.12
                + direct * 0.10 * altitude_rad.sin().max(0.0)
                + STREET_LIGHT * night,
            disc: if sun_is_up { (1.0 - 1.4 * grey).max(0.0) } else { 0.0 },
            cloud,
            haze_per_m: 0.0006 + 0.0015 * rain + 0.06 * fog * fog + 0.02 * dust * dust,
            haze_start_m: metres(weather.fog_distance_m),
            haze_fall_per_m: if fog > FOG_MIN {
                FALL_PER_M * metres(weather.fog_falloff).min(FALLOFF_MAX)
            } else {
                0.0
            },
            rain,
            rain_phase: rain_phase(tick),
            wet: share(weather.wetness_percent)
                .max(share(weather.precipitation_deposits_percent))
                .max(0.7 * rain),
            night,
            dim: 1.0 - day,
        }
    }
}

/// Unit vector at an azimuth from x towards y and an altitude.
fn direction(azimuth_rad: f32, altitude_rad: f32) -> Vec3 {
    let level = altitude_rad.cos();
    Vec3::new(level * azimuth_rad.cos(), level * azimuth_rad.sin(), altitude_rad.sin())
}

/// A percentage as 0 to 1; nonsense is 0.
fn share(percent: f32) -> f32 {
    if percent.is_finite() { (percent / 100.0).clamp(0.0, 1.0) } else { 0.0 }
}

/// A number from 0 to 1 that jumps from tick to tick: steps of the golden section.
fn rain_phase(tick: Tick) -> f32 {
    const GOLDEN: u32 = 0x9e37_79b1;
    (tick.0 as u32).wrapping_mul(GOLDEN) as f32 / u32::MAX as f32
}

/// A length that makes sense; nonsense is 0.
fn metres(length_m: f32) -> f32 {
    if length_m.is_finite() { length_m.clamp(0.0, 10_000.0) } else { 0.0 }
}

fn smooth(value: f32, low: f32, high: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: Vec3, b: Vec3, share_of_b: f32) -> Vec3 {
    a + (b - a) * share_of_b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light_of(weather: &Weather) -> Light {
        Light::of(weather, Tick(1))
    }

    fn weather() -> Weather {
        Weather::CLEAR_NOON
    }

    #[test]
    fn the_light_comes_from_where_the_weather_says() {
        let light = light_of(&Weather {
            sun_azimuth_rad: std::f32::consts::FRAC_PI_2,
            sun_altitude_rad: 0.5,
            ..weather()
        });
        assert!((light.to_light - Vec3::new(0.0, 0.5f32.cos(), 0.5f32.sin())).norm() < 1e-6);
    }

    #[test]
    fn clouds_take_the_sun_and_night_takes_nearly_everything() {
        let noon = light_of(&weather());
        let grey = light_of(&Weather { cloudiness_percent: 100.0, ..weather() });
        let night = light_of(&Weather { sun_altitude_rad: -0.6, ..weather() });
        assert!(grey.direct.x < 0.4 * noon.direct.x);
        assert!(night.direct.x < 0.05 * noon.direct.x && night.horizon.x < 0.1 * noon.horizon.x);
        assert!(night.night > 0.99 && noon.night < 0.01);
    }

    #[test]
    fn nonsense_in_the_weather_gives_finite_light() {
        let light = light_of(&Weather {
            cloudiness_percent: f32::NAN,
            fog_density_percent: 1e30,
            ..weather()
        });
        assert!(light.direct.iter().chain(light.horizon.iter()).all(|part| part.is_finite()));
        assert!(light.haze_per_m.is_finite());
    }

    #[test]
    fn dust_colours_and_thickens_the_air() {
        let clear = light_of(&weather());
        let dusty = light_of(&Weather { dust_storm_percent: 80.0, ..weather() });
        assert!(dusty.haze_per_m > 5.0 * clear.haze_per_m);
        assert!(dusty.horizon.x > 1.5 * dusty.horizon.z && clear.horizon.x < clear.horizon.z);
    }
}
