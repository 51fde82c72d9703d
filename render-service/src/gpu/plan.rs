//! What a strip shows, as rows that know nothing of the strips beside it.

use bodies::Instance;
use raster::{Quality, SHADOW_ERROR_PX_MAX, SHADOW_SLOPE, SunView};
use schemas::{Camera, ImageKind, PictureQuality};

use crate::lamps::lamps_of;
use crate::models::levels::ShapeLevel;
use crate::models::strips::{seen_bodies, shading_bodies, sun_view, town_error_px, view_of};
use crate::occluders::occluders_of;
use crate::scene::shadow::{ShadowView, shadow_side_px};
use crate::strip::Strip;

use super::batch::CHUNK;
use super::models::Models;
use super::rows::{LampRow, OccluderRow, PlacedRow, TargetRow, ViewRow, lamp_row, occluder_row};

/// Samples of a pixel: smooth edges of lane lines and distant people.
const SAMPLES: u32 = 4;
/// Larger pictures have one sample a pixel.
const SAMPLED_PX_MAX: u32 = 1 << 22;
/// Filtered taps along each side of a soft shadow's edge.
const TAPS: u32 = 3;

/// How finely an adapter draws.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fineness {
    /// Of cameras that do not say theirs.
    pub(crate) quality: PictureQuality,
    /// Software that runs kernels: one sample, one tap, smaller maps of shadows.
    pub(crate) is_software: bool,
}

/// One strip.
pub(crate) struct Plan<'a> {
    pub(crate) strip: &'a Strip<'a>,
    pub(crate) view: ViewRow,
    /// The picture's.
    pub(crate) target: TargetRow,
    /// What it may show, but for the town.
    pub(crate) seen: Vec<PlacedRow>,
    /// For colour.
    pub(crate) shadows: Option<PlannedShadows>,
    pub(crate) lamps: Vec<LampRow>,
    pub(crate) occluders: Vec<OccluderRow>,
    /// Models of the picture and of its shadows, but for the town, and chunks of them.
    pub(crate) placed: u32,
    pub(crate) chunks: u32,
}

/// Shadows of a strip.
pub(crate) struct PlannedShadows {
    pub(crate) sun: SunView,
    pub(crate) target: TargetRow,
    /// What throws them, but for the town.
    pub(crate) shading: Vec<PlacedRow>,
}

impl Fineness {
    fn of(self, camera: &Camera) -> Quality {
        let is_low = camera.quality.unwrap_or(self.quality) == PictureQuality::Low;
        // What tells things apart and how far away they are is always as fine as can be.
        if is_low && camera.kind == ImageKind::Rgb { Quality::Low } else { Quality::High }
    }

    fn samples(self, camera: &Camera) -> u32 {
        let is_fine = camera.kind == ImageKind::Rgb
            && self.of(camera) == Quality::High
            && camera.width_px * camera.height_px <= SAMPLED_PX_MAX;
        if is_fine && !self.is_software { SAMPLES } else { 1 }
    }

    fn shadow_side_px(self, camera: &Camera) -> u32 {
        let side_px = shadow_side_px(camera.width_px, camera.height_px, self.is_software);
        if self.of(camera) == Quality::Low { side_px / 2 } else { side_px }
    }
}

impl<'a> Plan<'a> {
    pub(crate) fn new(strip: &'a Strip<'a>, fineness: Fineness, models: &Models) -> Self {
        let camera = strip.camera();
        let quality = fineness.of(camera);
        let row =
            |level: &ShapeLevel, at: &Instance| PlacedRow::new(at, models.shape(level.number), 0);
        let mut seen = Vec::new();
        seen_bodies(strip, quality, |level, at| seen.push(row(level, at)));
        let samples = fineness.samples(camera);
        let mut target = TargetRow::new(&view_of(strip).projection(), town_error_px(quality), 0.0);
        let rows = strip.rows.end - strip.rows.start;
        target.place = [0, camera.width_px, strip.rows.start, rows];
        target.kind[0] = samples;
        let side_px = fineness.shadow_side_px(camera);
        let shadow = ShadowView::of(strip.view, &strip.light.to_light);
        let is_colour = camera.kind == ImageKind::Rgb;
        let mut view = ViewRow::new(strip, &shadow, side_px);
        let is_soft = quality == Quality::High && !fineness.is_software;
        view.shadow[3] = if is_soft { TAPS } else { 1 };
        view.samples = [0, samples, u32::from(is_colour), 0];
        let shadows = is_colour.then(|| {
            let sun = sun_view(&shadow, side_px);
            let mut target = TargetRow::new(&sun.projection(), SHADOW_ERROR_PX_MAX, SHADOW_SLOPE);
            target.place = [0, side_px, 0, side_px];
            let mut shading = Vec::new();
            let fineness = (side_px, quality);
            shading_bodies(strip, &shadow, fineness, |level, at| shading.push(row(level, at)));
            PlannedShadows { sun, target, shading }
        });
        let lamps = lamps_of(strip).iter().map(lamp_row).collect();
        // Low quality shades no ground.
        let occluders = match quality {
            Quality::High => occluders_of(strip).iter().map(occluder_row).collect(),
            Quality::Low => Vec::new(),
        };
        let shading = shadows.as_ref().map_or(&[][..], |shadows: &PlannedShadows| &shadows.shading);
        let chunks = seen.iter().chain(shading).map(|row| row.clusters().div_ceil(CHUNK)).sum();
        let placed = (seen.len() + shading.len()) as u32;
        Self { strip, view, target, seen, shadows, lamps, occluders, placed, chunks }
    }

    /// Bytes of the buffer of visible triangles.
    pub(crate) fn sample_count(&self) -> u64 {
        let [_, width, _, rows] = self.target.place;
        u64::from(width) * u64::from(rows) * u64::from(self.target.kind[0])
    }

    /// Pixels of its map of shadows.
    pub(crate) fn shadow_px(&self) -> u32 {
        self.shadows.as_ref().map_or(0, |shadows| shadows.sun.side_px * shadows.sun.side_px)
    }
}
