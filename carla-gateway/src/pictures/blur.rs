//! What is out of focus, and what moves while the shutter is open.

use super::linear;
use super::optics::positive;
use crate::dialect::Actor;
use crate::rpc::Refusal;

/// CARLA's defaults.
const FOCAL_CM: f32 = 1_000.0;
const FSTOP: f32 = 1.4;
const BLUR_KM: f32 = 1.0;
const INTENSITY: f32 = 0.45;
const DISTORTION_PERCENT: f32 = 0.35;

/// Width of Unreal Engine's sensor.
const SENSOR_M: f32 = 0.024_576;
/// Width of the picture that `blur_radius` is told for.
const REFERENCE_PX: f32 = 1_920.0;
/// Widest blur, as a radius.
const RADIUS_PX_MAX: f32 = 24.0;
/// Less than this is sharp.
const RADIUS_PX_MIN: f32 = 0.6;
/// Places of the lens that are looked through.
const TAPS: usize = 32;
/// Moments while the shutter is open.
const MOMENTS: usize = 9;

/// How a lens is focused.
///
/// **Source:** the thin lens: a point at a distance d is a disc of diameter
/// A f |d − s| / (d (s − f)) on the sensor, with focal length f, aperture A = f / N, focused at s;
/// and Unreal Engine's blur of far things by the air, `blur_radius` (1 − 2^(−d / `blur_amount`)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Focus {
    distance_m: f32,
    stop: f32,
    air_px: f32,
    air_m: f32,
}

impl Focus {
    /// As a camera's attributes ask for it; `None` for CARLA's defaults, which blur little at usual
    /// fields of view, and where focus is switched off by a distance of 0.
    pub(super) fn of(actor: &Actor) -> Result<Option<Self>, Refusal> {
        let cm = actor.number("focal_distance", FOCAL_CM)?;
        let stop = positive(actor, "fstop", FSTOP)?;
        let km = actor.number("blur_amount", BLUR_KM)?;
        let by_air = actor.number("blur_radius", 0.0)?.clamp(0.0, 1_000.0);
        let (air_px, air_m) = if km > 0.0 { (by_air, 1_000.0 * km) } else { (0.0, 1.0) };
        let is_plain = cm <= 0.0 || (cm == FOCAL_CM && air_px == 0.0 && stop >= 1.0);
        Ok((!is_plain).then_some(Self { distance_m: cm / 100.0, stop, air_px, air_m }))
    }

    /// Radius of the disc that a point becomes.
    fn radius_px(&self, depth_m: f32, width_px: u32, horizontal_fov_rad: f32) -> f32 {
        let width_px = width_px as f32;
        let focal_m = SENSOR_M / 2.0 / (horizontal_fov_rad / 2.0).tan();
        let aperture_m = focal_m / self.stop;
        let off = (depth_m - self.distance_m).abs() / depth_m.max(1e-3);
        let disc_m = aperture_m * focal_m * off / (self.distance_m - focal_m).max(1e-3);
        let by_air = self.air_px * width_px / REFERENCE_PX * (1.0 - (-depth_m / self.air_m).exp2());
        (disc_m / SENSOR_M * width_px / 2.0).max(by_air).min(RADIUS_PX_MAX)
    }

    /// Blurs what is out of focus; sharp things do not run into it.
    pub(super) fn blur(
        &self,
        data: &mut [u8],
        depths: &[u8],
        [width_px, height_px]: [u32; 2],
        horizontal_fov_rad: f32,
    ) {
        let (depths, _) = depths.as_chunks::<4>();
        let depths: Vec<f32> = depths.iter().map(|raw| f32::from_le_bytes(*raw)).collect();
        let radii: Vec<f32> = depths
            .iter()
            .map(|depth_m| self.radius_px(*depth_m, width_px, horizontal_fov_rad))
            .collect();
        let sharp = data.to_vec();
        let (sharp, _) = sharp.as_chunks::<4>();
        let (pixels, _) = data.as_chunks_mut::<4>();
        let around = spiral();
        let about = pixels.iter_mut().zip(radii.iter().zip(&depths)).enumerate();
        for (index, (pixel, (radius, depth_m))) in about {
            if *radius < RADIUS_PX_MIN {
                continue;
            }
            let (column, row) = (index as u32 % width_px, index as u32 / width_px);
            let (mut sum, mut weight) = (linear::light(*pixel), 1.0);
            for [x, y] in around {
                let across = (column as f32 + 0.5 + x * radius).clamp(0.0, width_px as f32 - 1.0);
                let down = (row as f32 + 0.5 + y * radius).clamp(0.0, height_px as f32 - 1.0);
                let at = (down as u32 * width_px + across as u32) as usize;
                let (Some(tap), Some(tap_px), Some(tap_m)) =
                    (sharp.get(at), radii.get(at), depths.get(at))
                else {
                    continue;
                };
                let away_px = radius * (x * x + y * y).sqrt();
                if *tap_px < away_px.min(*radius) * 0.8 && tap_m < depth_m {
                    continue;
                }
                sum.iter_mut().zip(linear::light(*tap)).for_each(|(sum, part)| *sum += part);
                weight += 1.0;
            }
            *pixel = linear::pixel(sum.map(|part| part / weight));
        }
    }
}

/// Places all over a disc of radius 1, by the golden angle.
fn spiral() -> [[f32; 2]; TAPS] {
    std::array::from_fn(|tap| {
        let radius = ((tap as f32 + 0.5) / TAPS as f32).sqrt();
        let angle = tap as f32 * 2.399_963;
        [radius * angle.cos(), radius * angle.sin()]
    })
}

/// How long what moves is drawn out.
///
/// **Source:** Unreal Engine's motion blur: the way between two frames times the intensity, at most
/// a percentage of the picture's width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Streaks {
    intensity: f32,
    most: f32,
}

impl Streaks {
    /// As a camera's attributes ask for it; `None` for CARLA's defaults, whose streaks of at most
    /// 0.35 % of the width plain pictures are spared, and for none.
    pub(super) fn of(actor: &Actor) -> Result<Option<Self>, Refusal> {
        let intensity = actor.number("motion_blur_intensity", INTENSITY)?.clamp(0.0, 1.0);
        let percent =
            actor.number("motion_blur_max_distortion", DISTORTION_PERCENT)?.clamp(0.0, 100.0);
        let is_plain = intensity == INTENSITY && percent == DISTORTION_PERCENT;
        let is_none = intensity == 0.0 || percent == 0.0;
        Ok((!is_plain && !is_none).then_some(Self { intensity, most: percent / 100.0 }))
    }

    /// Draws pixels out along the way they came; ways are to the right and up, in a picture that is
    /// 2 wide and 2 high.
    pub(super) fn blur(&self, data: &mut [u8], flow: &[[f32; 2]], [width_px, height_px]: [u32; 2]) {
        let sharp = data.to_vec();
        let (sharp, _) = sharp.as_chunks::<4>();
        let (pixels, _) = data.as_chunks_mut::<4>();
        let (width, height) = (width_px as f32, height_px as f32);
        for (index, (pixel, [right, up])) in pixels.iter_mut().zip(flow).enumerate() {
            let way = [right * width / 2.0 * self.intensity, -up * height / 2.0 * self.intensity];
            let long_px = (way[0] * way[0] + way[1] * way[1]).sqrt();
            if long_px.is_nan() || long_px < 1.0 {
                continue;
            }
            let shorter = (self.most * width / long_px).min(1.0);
            let (column, row) = (index as u32 % width_px, index as u32 / width_px);
            let mut sum = [0.0f32; 3];
            for moment in 0..MOMENTS {
                let part = (moment as f32 / (MOMENTS - 1) as f32 - 0.5) * shorter;
                let across = (column as f32 + 0.5 + way[0] * part).clamp(0.0, width - 1.0);
                let down = (row as f32 + 0.5 + way[1] * part).clamp(0.0, height - 1.0);
                let at = (down as u32 * width_px + across as u32) as usize;
                let light = sharp.get(at).copied().map_or([0.0; 3], linear::light);
                sum.iter_mut().zip(light).for_each(|(sum, part)| *sum += part);
            }
            *pixel = linear::pixel(sum.map(|part| part / MOMENTS as f32));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [64, 32];

    /// White left of the middle, black right of it.
    fn edge() -> Vec<u8> {
        let [width, height] = SIZE;
        let byte = |index: u32| if index % width < width / 2 { 255 } else { 0 };
        (0..width * height).flat_map(|index| [byte(index), byte(index), byte(index), 255]).collect()
    }

    /// Columns of a row that are neither black nor white.
    fn grey(data: &[u8]) -> usize {
        let (pixels, _) = data.as_chunks::<4>();
        let row = &pixels[16 * SIZE[0] as usize..17 * SIZE[0] as usize];
        row.iter().filter(|pixel| (1..255).contains(&pixel[0])).count()
    }

    fn depths(depth_m: f32) -> Vec<u8> {
        depth_m.to_le_bytes().repeat((SIZE[0] * SIZE[1]) as usize)
    }

    #[test]
    fn what_is_in_focus_is_sharp_and_what_is_near_or_far_is_not() {
        let focus = Focus { distance_m: 2.0, stop: 0.5, air_px: 0.0, air_m: 1e3 };
        let blurred = |depth_m: f32| {
            let mut data = edge();
            focus.blur(&mut data, &depths(depth_m), SIZE, 0.2);
            grey(&data)
        };
        assert_eq!(blurred(2.0), 0);
        assert!(blurred(50.0) > 4 && blurred(0.8) > 4, "{} {}", blurred(50.0), blurred(0.8));
        assert!(blurred(50.0) > blurred(3.0));
    }

    #[test]
    fn the_disc_is_that_of_a_thin_lens() {
        let focus = Focus { distance_m: 10.0, stop: 1.4, air_px: 0.0, air_m: 1e3 };
        // f = 12.288 mm at 90°: 8.777 mm × 12.288 mm × 8 m / (2 m × 9.988 m) = 0.0432 mm.
        let radius_px = focus.radius_px(2.0, 800, std::f32::consts::FRAC_PI_2);
        assert!((radius_px - 0.0432 / 24.576 * 400.0).abs() < 0.01, "{radius_px}");
    }

    #[test]
    fn what_moves_across_an_edge_is_drawn_out_and_what_moves_along_it_is_not() {
        let streaks = Streaks { intensity: 1.0, most: 0.5 };
        let drawn = |way: [f32; 2]| {
            let mut data = edge();
            streaks.blur(&mut data, &vec![way; (SIZE[0] * SIZE[1]) as usize], SIZE);
            grey(&data)
        };
        assert!(drawn([0.5, 0.0]) >= 10, "{}", drawn([0.5, 0.0]));
        assert_eq!([drawn([0.0, 0.5]), drawn([0.0, 0.0]), drawn([f32::NAN, 0.0])], [0; 3]);
        let short = Streaks { intensity: 1.0, most: 0.05 };
        let mut data = edge();
        short.blur(&mut data, &vec![[0.5, 0.0]; (SIZE[0] * SIZE[1]) as usize], SIZE);
        assert!(grey(&data) < 6, "{}", grey(&data));
    }
}
