//! The lamps that a picture shows the light of.

use raster::{LAMPS_MAX, Lamp};
use schemas::{ImageKind, Vec3};

use crate::strip::Strip;

/// Lamps whose light ends further from the camera than this are left out, in metres.
const AWAY_MAX_M: f32 = 150.0;
/// By less darkness than this, from 0 by day to 1 by night, lamps light nothing.
const NIGHT_MIN: f32 = 0.02;

/// Lamps that may light something in a strip's colour picture, those whose light comes nearest to
/// the camera first. They are the same for all rows of it. By day none: the sun outshines them.
pub(crate) fn lamps_of(strip: &Strip<'_>) -> Vec<Lamp> {
    let night = strip.light.night;
    if night < NIGHT_MIN || strip.camera().kind != ImageKind::Rgb {
        return Vec::new();
    }
    let height_px = strip.camera().height_px;
    let shown = strip.view.rows(&(0..height_px), height_px);
    let eye_m = strip.view.eye_m();
    let mut lamps: Vec<(f32, Lamp)> = Vec::new();
    for lamp in strip.bodies().flat_map(|body| &body.lamps) {
        let (place_m, reach) = (Vec3::from(lamp.place_m), Vec3::repeat(lamp.reach_m));
        let away_m = ((place_m - eye_m).norm() - lamp.reach_m).max(0.0);
        if away_m < AWAY_MAX_M && shown.may_see(&(place_m - reach), &(place_m + reach)) {
            lamps.push((away_m, Lamp { colour: lamp.colour.map(|part| part * night), ..*lamp }));
        }
    }
    // Stable: equal jobs are drawn with equal lamps.
    lamps.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    lamps.into_iter().take(LAMPS_MAX).map(|(_, lamp)| lamp).collect()
}
