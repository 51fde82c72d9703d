//! How much light a picture takes, and which colour it shows white.

use nalgebra::{Matrix3, Vector2};
use schemas::{Exposure, Vec3};

/// Exposure value at ISO 100 of a plain picture at noon that follows the light; by night it is one
/// less. They are CARLA's bounds, so that its defaults change nothing.
const NOON_EV100: f32 = 12.0;
const NIGHT_EV: f32 = 1.0;
/// Fixed exposure that shows noon as a plain picture does: at ISO 100 and f/1.4, 1/3000 s looks as
/// CARLA's automatic exposure.
const NOON_FIXED_EV100: f32 = 12.5;
/// Of radiance, at noon and by night.
const NOON_GAIN: f32 = 0.95;
const NIGHT_GAIN: f32 = 1.9;
/// More stops from a plain picture are black or white.
const STOPS_MAX: f32 = 16.0;
/// Temperatures that have a colour.
const TEMPERATURES_K: [f32; 2] = [1_500.0, 15_000.0];

/// What radiance is multiplied by before the display's curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tone {
    /// All channels alike.
    pub(crate) gain: f32,
    /// White balance, by rows; none: colours stay.
    pub(crate) white: Option<[[f32; 3]; 3]>,
}

impl Tone {
    /// At an hour from 0 under a high sun to 1 by night. The light of the scene is what the weather
    /// says, not what the picture shows, so that it is the same for all rows; it follows at once.
    pub(crate) fn of(exposure: &Exposure, dim: f32) -> Self {
        let plain = NOON_GAIN + (NIGHT_GAIN - NOON_GAIN) * dim;
        let white = (exposure.temperature_k != Exposure::PLAIN.temperature_k
            || exposure.tint != Exposure::PLAIN.tint)
            .then(|| white_balance(exposure.temperature_k, exposure.tint));
        let stops = match exposure.fixed_ev100 {
            Some(ev100) => NOON_FIXED_EV100 - ev100,
            None => {
                let [least, most] = exposure.range_ev100;
                let wanted = NOON_EV100 - NIGHT_EV * dim;
                wanted - wanted.max(least).min(most.max(least))
            }
        };
        let stops = (stops + exposure.compensation_ev).clamp(-STOPS_MAX, STOPS_MAX);
        let base = if exposure.fixed_ev100.is_some() { NOON_GAIN } else { plain };
        let gain = if stops == 0.0 { base } else { base * stops.exp2() };
        Self { gain, white }
    }

    /// All of it, by rows.
    pub(crate) fn rows(&self) -> [[f32; 3]; 3] {
        let rows = self.white.unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        rows.map(|row| row.map(|part| part * self.gain))
    }
}

/// From linear sRGB in light of a temperature to linear sRGB in daylight.
///
/// **Source:** Unreal Engine 4.26's `WhiteBalance`: daylight locus of CIE 15 from 4000 K on, below
/// the Planckian locus of Krystek, "An algorithm to calculate correlated colour temperature",
/// 1985; the tint moves 0.05 along the isotherm; Bradford's adaptation.
fn white_balance(temperature_k: f32, tint: f32) -> [[f32; 3]; 3] {
    let [least, most] = TEMPERATURES_K;
    let kelvin = temperature_k.clamp(least, most);
    let planckian = xy_of_uv(planckian_uv(kelvin));
    let base = if kelvin < 4_000.0 { planckian } else { daylight_xy(kelvin) };
    let tinted = xy_of_uv(isothermal_uv(kelvin, tint.clamp(-1.0, 1.0)));
    let source = base + (tinted - planckian);
    let adapted = XYZ_TO_SRGB * adaptation(source, DAYLIGHT) * SRGB_TO_XYZ;
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| adapted[(row, column)]))
}

/// Of D65.
const DAYLIGHT: Vector2<f32> = Vector2::new(0.3127, 0.3290);
const SRGB_TO_XYZ: Matrix3<f32> = Matrix3::new(
    0.412_390_8,
    0.357_584_3,
    0.180_480_8, //
    0.212_639,
    0.715_168_7,
    0.072_192_3, //
    0.019_330_8,
    0.119_194_8,
    0.950_532_2,
);
const XYZ_TO_SRGB: Matrix3<f32> = Matrix3::new(
    3.240_97,
    -1.537_383_2,
    -0.498_610_8, //
    -0.969_243_6,
    1.875_967_5,
    0.041_555_1, //
    0.055_630_1,
    -0.203_977,
    1.056_971_5,
);
const BRADFORD: Matrix3<f32> = Matrix3::new(
    0.8951, 0.2664, -0.1614, //
    -0.7502, 1.7135, 0.0367, //
    0.0389, -0.0685, 1.0296,
);
const FROM_BRADFORD: Matrix3<f32> = Matrix3::new(
    0.986_992_9,
    -0.147_054_3,
    0.159_962_7, //
    0.432_305_3,
    0.518_360_3,
    0.049_291_2, //
    -0.008_528_7,
    0.040_042_8,
    0.968_486_7,
);

fn daylight_xy(kelvin: f32) -> Vector2<f32> {
    let t = kelvin * (1.4388 / 1.438);
    let x = if t <= 7_000.0 {
        0.244_063 + (99.11 + (2.967_8e6 - 4.607e9 / t) / t) / t
    } else {
        0.237_04 + (247.48 + (1.901_8e6 - 2.006_4e9 / t) / t) / t
    };
    Vector2::new(x, -3.0 * x * x + 2.87 * x - 0.275)
}

fn planckian_uv(t: f32) -> Vector2<f32> {
    let u = (0.860_117_76 + 1.541_182_5e-4 * t + 1.286_412e-7 * t * t)
        / (1.0 + 8.424_202e-4 * t + 7.081_451_6e-7 * t * t);
    let v = (0.317_398_73 + 4.228_062_5e-5 * t + 4.204_817e-8 * t * t)
        / (1.0 - 2.897_418_2e-5 * t + 1.614_560_5e-7 * t * t);
    Vector2::new(u, v)
}

/// Beside the Planckian locus by a tint.
fn isothermal_uv(t: f32, tint: f32) -> Vector2<f32> {
    let square = |value: f32| value * value;
    let along = Vector2::new(
        (-1.137_581_2e9 - 1.916_156_2e6 * t - 1.531_77 * t * t)
            / square(1.412_139_8e6 + 1_189.62 * t + t * t),
        (1.974_715_4e9 - 705_674.0 * t - 308.607 * t * t)
            / square(6.193_636e6 - 179.456 * t + t * t),
    );
    let along = along.try_normalize(0.0).unwrap_or_else(Vector2::x);
    planckian_uv(t) + Vector2::new(-along.y, along.x) * (0.05 * tint)
}

fn xy_of_uv(uv: Vector2<f32>) -> Vector2<f32> {
    Vector2::new(3.0 * uv.x, 2.0 * uv.y) / (2.0 * uv.x - 8.0 * uv.y + 4.0)
}

fn adaptation(from: Vector2<f32>, to: Vector2<f32>) -> Matrix3<f32> {
    let xyz = |xy: Vector2<f32>| Vec3::new(xy.x / xy.y, 1.0, (1.0 - xy.x - xy.y) / xy.y);
    let (from, to) = (BRADFORD * xyz(from), BRADFORD * xyz(to));
    FROM_BRADFORD * Matrix3::from_diagonal(&to.component_div(&from)) * BRADFORD
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_change_nothing_by_day_and_by_night() {
        let of = |dim| Tone::of(&Exposure::PLAIN, dim);
        assert_eq!(of(0.0), Tone { gain: NOON_GAIN, white: None });
        assert_eq!(of(1.0).gain, NIGHT_GAIN);
    }

    #[test]
    fn a_stop_of_compensation_doubles_the_light() {
        let brighter = Exposure { compensation_ev: 1.0, ..Exposure::PLAIN };
        assert_eq!(Tone::of(&brighter, 0.0).gain, 2.0 * NOON_GAIN);
    }

    #[test]
    fn a_fixed_exposure_does_not_follow_the_light_and_a_range_bounds_it() {
        let fixed = Exposure { fixed_ev100: Some(NOON_FIXED_EV100 + 1.0), ..Exposure::PLAIN };
        let gains = [0.0, 1.0].map(|dim| Tone::of(&fixed, dim).gain);
        assert_eq!(gains, [0.5 * NOON_GAIN; 2]);
        let dark = Exposure { range_ev100: [14.0, 15.0], ..Exposure::PLAIN };
        assert_eq!(Tone::of(&dark, 0.0).gain, 0.25 * NOON_GAIN);
        let still = Exposure { range_ev100: [12.0, 12.0], ..Exposure::PLAIN };
        assert_eq!(Tone::of(&still, 1.0).gain, 0.5 * NIGHT_GAIN);
    }

    #[test]
    fn light_of_the_temperature_looks_white_and_daylight_then_looks_blue() {
        let shown = |temperature_k, tint| {
            let [red, green, blue] =
                white_balance(temperature_k, tint).map(|row| row.iter().sum::<f32>());
            [red, green, blue]
        };
        let [red, _, blue] = shown(3_000.0, 0.0);
        assert!(blue > 1.5 * red && red > 0.0, "{red} {blue}");
        let [red, _, blue] = shown(12_000.0, 0.0);
        assert!(red > 1.15 * blue, "{red} {blue}");
        let [red, green, blue] = shown(6_500.0, 0.0);
        for part in [red, green, blue] {
            assert!((part - 1.0).abs() < 0.01, "{red} {green} {blue}");
        }
        let [red, green, blue] = shown(6_500.0, 1.0);
        assert!((red - green).abs() > 0.05 && (blue - green).abs() > 0.05);
    }

    #[test]
    fn nonsense_gives_finite_light() {
        let wild = Exposure {
            fixed_ev100: Some(-1e30),
            compensation_ev: 1e30,
            temperature_k: -5.0,
            tint: 1e9,
            ..Exposure::PLAIN
        };
        let rows = Tone::of(&wild, 0.5).rows();
        assert!(rows.iter().flatten().all(|part| part.is_finite()), "{rows:?}");
    }
}
