//! What one submission draws: for every view, the tiles and bodies that its camera may see.

use std::ops::Range;

use bodies::{Detail, Instance, Shape};
use schemas::{Camera, ImageKind, Vec3};

use crate::lamps::lamps_of;
use crate::occluders::occluders_of;
use crate::scene::exposure::Tone;
use crate::scene::instance::Body;
use crate::scene::material::Family;
use crate::scene::shadow::{ShadowView, shadow_side_px};
use crate::scene::town::Tile;
use crate::strip::{Strip, row_pitch_bytes};

use super::buffers::VIEWS_PER_BATCH_MAX;
use super::uniform::{Around, ViewUniform};

/// Bytes of all pictures of one submission, as they are read back.
const READBACK_BYTES_MAX: u64 = 64 * 1024 * 1024;
/// Bodies that would be smaller than this in the picture, in pixels, are left out.
const BODY_RADIUS_PX_MIN: f32 = 0.6;
/// Bodies that are smaller than this in the picture, in pixels, are drawn coarsely.
const FINE_RADIUS_PX_MIN: f32 = 44.0;

/// Instances of one shape at one detail.
pub(crate) type Draw = ((Shape, Detail), Range<u32>);

/// What throws shadows into a view.
pub(crate) struct Shadows {
    pub(crate) side_px: u32,
    /// Indices of the town.
    pub(crate) town: Vec<Range<u32>>,
    pub(crate) bodies: Vec<Draw>,
}

/// What one camera pose sees, as draw calls, and the pictures that come of it.
pub(crate) struct PlannedView<'a> {
    pub(crate) strip: &'a Strip<'a>,
    /// For colour; a view without draws geometry.
    pub(crate) shadows: Option<Shadows>,
    /// Indices of the town that are in the picture, near ones first.
    pub(crate) town: Vec<(Family, Range<u32>)>,
    pub(crate) bodies: Vec<Draw>,
    /// One of colour, one or more of geometry.
    pub(crate) pictures: Vec<PlannedPicture<'a>>,
}

/// Rows of one picture of a view.
#[derive(Clone, Copy)]
pub(crate) struct PlannedPicture<'a> {
    pub(crate) camera: &'a Camera,
    /// Whether it has all rows.
    pub(crate) is_whole: bool,
    /// Where the rows go in the read-back buffer.
    pub(crate) offset_bytes: u64,
    pub(crate) row_pitch_bytes: u32,
    pub(crate) row_count: u32,
}

/// One submission.
#[derive(Default)]
pub(crate) struct Batch<'a> {
    pub(crate) planned: Vec<PlannedView<'a>>,
    /// At the places of the planned views.
    pub(crate) views: Vec<ViewUniform>,
    pub(crate) instances: Vec<Instance>,
    pub(crate) readback_bytes: u64,
}

impl<'a> Batch<'a> {
    /// As many of the strips as fit into one submission, at least one.
    pub(crate) fn of(strips: &'a [Strip<'a>], software: bool) -> Self {
        // Instance 0 is where towns already are.
        let mut batch = Self { instances: vec![Instance::IN_PLACE], ..Self::default() };
        for strip in strips.iter().take(VIEWS_PER_BATCH_MAX) {
            let bytes = readback_bytes(strip);
            if batch.readback_bytes > 0 && batch.readback_bytes + bytes > READBACK_BYTES_MAX {
                break;
            }
            batch.add(strip, software);
        }
        batch
    }

    fn add(&mut self, strip: &'a Strip<'a>, software: bool) {
        let Camera { width_px, height_px, kind, .. } = *strip.camera();
        let side_px = shadow_side_px(width_px, height_px, software);
        let shadow = ShadowView::of(strip.view, &strip.light.to_light);
        let bodies = self.place_seen(strip);
        let shadows = (kind == ImageKind::Rgb).then(|| Shadows {
            side_px,
            town: shading_town(strip, &shadow),
            bodies: self.place_shading(strip, &shadow),
        });
        let tone = Tone::of(&strip.camera().exposure, strip.light.dim);
        let around = Around { lamps: &lamps_of(strip), occluders: &occluders_of(strip) };
        let light = (strip.light, &tone, &around);
        self.views.push(ViewUniform::new(strip.view, width_px, light, (&shadow, side_px)));
        let pictures = strip.cameras.iter().map(|camera| self.place_picture(camera, strip));
        let pictures = pictures.collect();
        self.planned.push(PlannedView {
            strip,
            shadows,
            town: visible_town(strip),
            bodies,
            pictures,
        });
    }

    fn place_picture(&mut self, camera: &'a Camera, strip: &Strip<'_>) -> PlannedPicture<'a> {
        let offset_bytes = self.readback_bytes;
        self.readback_bytes += picture_bytes(camera, &strip.rows);
        PlannedPicture {
            camera,
            is_whole: strip.is_whole(),
            offset_bytes,
            row_pitch_bytes: row_pitch_bytes(camera.width_px),
            row_count: strip.rows.len() as u32,
        }
    }

    /// Appends the bodies in the picture, small ones coarsely.
    fn place_seen(&mut self, strip: &Strip<'_>) -> Vec<Draw> {
        let pixel = 2.0 * strip.view.half_extent[0] / strip.camera().width_px as f32;
        let eye_m = strip.view.eye_m();
        let shown = strip.view.rows(&strip.rows, strip.camera().height_px);
        let radius_px =
            |body: &Body| body.radius_m / (pixel * (body.centre_m - eye_m).norm().max(0.1));
        let seen = |body: &&Body| {
            radius_px(body) > BODY_RADIUS_PX_MIN
                && within(body, |min_m, max_m| shown.may_see(min_m, max_m))
        };
        let detail_of = |body: &Body| {
            if radius_px(body) < FINE_RADIUS_PX_MIN { Detail::Coarse } else { Detail::Fine }
        };
        self.place(strip.bodies().filter(seen), detail_of)
    }

    /// Appends the bodies that throw shadows into the picture.
    fn place_shading(&mut self, strip: &Strip<'_>, shadow: &ShadowView) -> Vec<Draw> {
        let shading = |body: &&Body| within(body, |min_m, max_m| shadow.may_see(min_m, max_m));
        self.place(strip.bodies().filter(shading), |_| Detail::Coarse)
    }

    /// Appends the parts of bodies, shape by shape.
    fn place<'b>(
        &mut self,
        bodies: impl Iterator<Item = &'b Body>,
        detail_of: impl Fn(&Body) -> Detail,
    ) -> Vec<Draw> {
        let parts_of = |body: &'b Body| {
            let detail = detail_of(body);
            body.parts.iter().map(move |part| ((part.shape, detail), part.instance))
        };
        let mut parts: Vec<((Shape, Detail), Instance)> = bodies.flat_map(parts_of).collect();
        // Stable: equal jobs are drawn in equal order.
        parts.sort_by_key(|(mesh, _)| *mesh);
        let mut draws: Vec<Draw> = Vec::new();
        for (mesh, instance) in parts {
            let at = self.instances.len() as u32;
            self.instances.push(instance);
            match draws.last_mut() {
                Some((last, range)) if *last == mesh => range.end = at + 1,
                _ => draws.push((mesh, at..at + 1)),
            }
        }
        draws
    }
}

fn within(body: &Body, test: impl Fn(&Vec3, &Vec3) -> bool) -> bool {
    let reach = Vec3::repeat(body.radius_m);
    test(&(body.centre_m - reach), &(body.centre_m + reach))
}

/// What is near comes first, so that what it hides is not shaded.
fn visible_town(strip: &Strip<'_>) -> Vec<(Family, Range<u32>)> {
    let eye_m = strip.view.eye_m();
    let shown = strip.view.rows(&strip.rows, strip.camera().height_px);
    let in_view = |tile: &&Tile| shown.may_see(&tile.min_m, &tile.max_m);
    let mut tiles: Vec<&Tile> = strip.town.tiles.iter().filter(in_view).collect();
    tiles.sort_by(|a, b| a.distance_squared(&eye_m).total_cmp(&b.distance_squared(&eye_m)));
    let mut ranges = Vec::with_capacity(tiles.len());
    for tile in tiles {
        for (family, range) in &tile.indices_of {
            tile.shown(range, strip.hidden, |part| ranges.push((*family, part)));
        }
    }
    ranges
}

/// Walls and trees throw shadows; what lies on the ground throws none that anyone sees.
fn shading_town(strip: &Strip<'_>, shadow: &ShadowView) -> Vec<Range<u32>> {
    let casts = |tile: &&Tile| shadow.may_see(&tile.min_m, &tile.max_m);
    let mut ranges = Vec::new();
    for tile in strip.town.tiles.iter().filter(casts) {
        for (_, range) in tile.indices_of.iter().filter(|(family, _)| *family != Family::Ground) {
            tile.shown(range, strip.hidden, |part| ranges.push(part));
        }
    }
    ranges
}

fn readback_bytes(strip: &Strip<'_>) -> u64 {
    strip.cameras.iter().map(|camera| picture_bytes(camera, &strip.rows)).sum()
}

fn picture_bytes(camera: &Camera, rows: &Range<u32>) -> u64 {
    u64::from(row_pitch_bytes(camera.width_px)) * rows.len() as u64
}
