//! What stands on the ground that a picture shows, and darkens it.

use nalgebra::Vector2;
use raster::{OCCLUDERS_MAX, Occluder};
use schemas::{ImageKind, Vec3};

use crate::strip::Strip;

/// Where pictures are as wide as they are far away, in metres: what is smaller than there darkens
/// hardly a pixel.
const AWAY_MAX_M: f32 = 60.0;

/// Vehicles, people and houses that stand on what a strip's colour picture shows, the nearest
/// first. They are the same for all rows of it.
pub(crate) fn occluders_of(strip: &Strip<'_>) -> Vec<Occluder> {
    if strip.camera().kind != ImageKind::Rgb {
        return Vec::new();
    }
    let height_px = strip.camera().height_px;
    let shown = strip.view.rows(&(0..height_px), height_px);
    let eye_m = strip.view.eye_m();
    let mut found: Vec<(f32, Occluder)> = Vec::new();
    let of_bodies = strip.bodies().filter_map(|body| body.occluder);
    for occluder in of_bodies.chain(strip.town.buildings.around(&eye_m, strip.hidden)) {
        let (place_m, reach) = (Vec3::from(occluder.place_m), Vec3::repeat(occluder.reach_m()));
        let size_m = Vector2::from(occluder.half_m).norm();
        let away_m = ((place_m - eye_m).norm() - size_m) * strip.view.half_extent[0];
        if away_m < AWAY_MAX_M && shown.may_see(&(place_m - reach), &(place_m + reach)) {
            found.push((away_m, occluder));
        }
    }
    // Stable: equal jobs are drawn with equal occluders.
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    found.into_iter().take(OCCLUDERS_MAX).map(|(_, occluder)| occluder).collect()
}
