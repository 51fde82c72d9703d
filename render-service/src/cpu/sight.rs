//! What of a scene a strip shows, found once for all of its bands, and its pixels.

use std::ops::Range;
use std::sync::OnceLock;

use raster::{
    Canvas, Lamp, Level, Material, Occluder, Placed, Prospect, Quality, Scene, ShadowMap, View,
};
use schemas::{Camera, DEPTH_MAX_M, ImageKind, PictureQuality, SemanticTag};

use crate::lamps::lamps_of;
use crate::models::strips::{
    light_of, placed, placed_town, seen_bodies, shading_bodies, sun_view, town_error_px, view_of,
};
use crate::models::towns::Models;
use crate::occluders::occluders_of;
use crate::scene::shadow::ShadowView;
use crate::strip::Strip;

use super::shadows::{ShadowPool, TownShadows, shadow_side_px};

/// What a strip may show.
struct Seen<'a> {
    placed: Vec<Placed<'a>>,
    lamps: Vec<Lamp>,
    occluders: Vec<Occluder>,
    prospect: Prospect,
}

/// A strip that is drawn.
pub(crate) struct Sight<'a> {
    pub(crate) strip: &'a Strip<'a>,
    models: &'a Models,
    view: View,
    scene: OnceLock<Seen<'a>>,
    shadow: OnceLock<ShadowMap>,
}

/// What all threads that draw share.
pub(crate) struct Painter<'a> {
    pub(crate) level: Level,
    pub(crate) materials: &'a [Material],
    pub(crate) shadows: &'a TownShadows,
    pub(crate) pool: &'a ShadowPool,
    /// Of cameras that do not say theirs.
    pub(crate) quality: PictureQuality,
}

impl<'a> Sight<'a> {
    pub(crate) fn new(strip: &'a Strip<'a>, models: &'a Models) -> Self {
        let view = view_of(strip);
        Self { strip, models, view, scene: OnceLock::new(), shadow: OnceLock::new() }
    }

    /// The map of its shadows, if anybody needed one.
    pub(crate) fn into_shadow(self) -> Option<ShadowMap> {
        self.shadow.into_inner()
    }

    /// What may be seen.
    fn scene(&self, painter: &Painter<'_>) -> &Seen<'a> {
        self.scene.get_or_init(|| {
            let mut all: Vec<_> = self.models.each_ref().map(placed_town).into();
            let quality = painter.quality_of(self.strip.camera());
            seen_bodies(self.strip, quality, |level, at| all.push(placed(level, at)));
            let placed = all;
            let (lamps, occluders) = (lamps_of(self.strip), occluders_of(self.strip));
            let scene = Scene { placed: &placed, ..Scene::EMPTY };
            let error_px = town_error_px(quality);
            let prospect = Prospect::of(painter.level, &self.view, &scene, error_px);
            Seen { placed, lamps, occluders, prospect }
        })
    }

    /// Its shadows: its town's, and those of bodies.
    pub(crate) fn shadow(&self, painter: &Painter<'_>) -> &ShadowMap {
        self.shadow.get_or_init(|| {
            let strip = self.strip;
            let quality = painter.quality_of(strip.camera());
            let side_px = shadow_side_px(strip.camera(), quality);
            let sun = ShadowView::of(strip.view, &strip.light.to_light);
            let view = sun_view(&sun, side_px);
            let town = (strip.town.digest(), strip.hidden);
            let [_, standing] = self.models;
            let slot = painter.shadows.get(painter.level, town, &placed_town(standing), &view);
            let mut map = painter.pool.take(&view);
            if let Some(of_town) = slot.get() {
                map.copy_from(of_town);
            }
            let mut bodies = Vec::new();
            shading_bodies(strip, &sun, (side_px, quality), |level, at| {
                bodies.push(placed(level, at));
            });
            map.add(painter.level, &bodies, None);
            map
        })
    }
}

impl Painter<'_> {
    /// How finely the pictures of a camera are drawn. What tells things apart and how far away they
    /// are is always as fine as can be.
    fn quality_of(&self, camera: &Camera) -> Quality {
        let is_low = camera.quality.unwrap_or(self.quality) == PictureQuality::Low;
        if is_low && camera.kind == ImageKind::Rgb { Quality::Low } else { Quality::High }
    }

    /// Finds out what some rows of a strip show.
    pub(crate) fn look(&self, canvas: &mut Canvas, sight: &Sight<'_>, rows: Range<u32>) {
        self.with_scene(sight, |scene, prospect| {
            canvas.look(self.level, &sight.view, rows, (scene, prospect));
        });
    }

    /// Writes the rows that were looked at, as a camera wants them.
    pub(crate) fn paint(
        &self,
        canvas: &mut Canvas,
        sight: &Sight<'_>,
        camera: &Camera,
        out: &mut [u8],
    ) {
        let Sight { strip, view, .. } = sight;
        let pixel_bytes = strip.pixel_bytes(camera);
        let out = (out, strip.pitch_bytes(camera));
        self.with_scene(sight, |scene, _| match camera.kind {
            ImageKind::Rgb => {
                let light = light_of(strip);
                let light = (&light, sight.shadow(self), self.quality_of(camera));
                canvas.colour(self.level, view, scene, light, out);
            }
            ImageKind::Depth => canvas.depth(self.level, DEPTH_MAX_M, out),
            ImageKind::Semantic | ImageKind::Instance => {
                let sky = u32::from(SemanticTag::Sky.number());
                canvas.labels(scene, sky, pixel_bytes, out);
            }
            ImageKind::Normals => canvas.normals(self.level, view, scene, pixel_bytes, out),
        });
    }

    fn with_scene(&self, sight: &Sight<'_>, then: impl FnOnce(&Scene<'_>, &Prospect)) {
        let Seen { placed, lamps, occluders, prospect } = sight.scene(self);
        let hidden = sight.strip.hidden;
        let is_hidden = |thing: u32| hidden.contains(thing);
        let is_hidden: &(dyn Fn(u32) -> bool + Sync) = &is_hidden;
        let is_hidden = (!hidden.is_none()).then_some(is_hidden);
        let materials = self.materials;
        let coats = sight.strip.coats;
        then(&Scene { placed, is_hidden, materials, lamps, occluders, coats }, prospect);
    }
}
