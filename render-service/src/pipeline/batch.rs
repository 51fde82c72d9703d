//! What one submission draws: for every view, the tiles and bodies that its camera may see.

use std::ops::Range;
use std::sync::Arc;

use schemas::{Camera, HiddenScenery, ImageKind, Vec3};

use crate::scene::instance::{Body, Instance};
use crate::scene::light::Light;
use crate::scene::material::Family;
use crate::scene::shadow::ShadowView;
use crate::scene::shape::{Detail, Shape};
use crate::scene::town::{Tile, TownScene};
use crate::scene::view::View;

use super::buffers::SHOTS_PER_BATCH_MAX;
use super::targets::shadow_side_px;
use super::uniform::ViewUniform;

/// Bytes of all pictures of one submission, as they are read back.
const READBACK_BYTES_MAX: u64 = 64 * 1024 * 1024;
/// Rows are read back at a multiple of this.
const ROW_BYTES_MULTIPLE: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
/// Bodies that would be smaller than this in the picture, in pixels, are left out.
const BODY_RADIUS_PX_MIN: f32 = 0.6;
/// Bodies that are smaller than this in the picture, in pixels, are drawn coarsely.
const FINE_RADIUS_PX_MIN: f32 = 44.0;

/// One picture to be drawn.
pub(crate) struct Shot<'a> {
    pub(crate) town: &'a Arc<TownScene>,
    /// Of the town.
    pub(crate) hidden: &'a HiddenScenery,
    pub(crate) bodies: &'a [Body],
    pub(crate) light: Light,
    pub(crate) camera: &'a Camera,
    pub(crate) view: View,
}

impl Shot<'_> {
    /// Whether one geometry pass gives both pictures.
    fn shares_geometry_with(&self, other: &Self) -> bool {
        let size_px = |shot: &Self| (shot.camera.width_px, shot.camera.height_px);
        self.camera.kind != ImageKind::Rgb
            && other.camera.kind != ImageKind::Rgb
            && std::ptr::eq(self.bodies, other.bodies)
            && Arc::ptr_eq(self.town, other.town)
            && size_px(self) == size_px(other)
            && self.view == other.view
            && self.camera.ignored == other.camera.ignored
    }

    fn bodies(&self) -> impl Iterator<Item = &Body> {
        let ignored = |id| self.camera.ignored.contains(&id);
        self.bodies.iter().filter(move |body| !body.actor.is_some_and(ignored))
    }
}

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
    pub(crate) shot: &'a Shot<'a>,
    /// For colour; a view without draws geometry.
    pub(crate) shadows: Option<Shadows>,
    /// Indices of the town that are in the picture, near ones first.
    pub(crate) town: Vec<(Family, Range<u32>)>,
    pub(crate) bodies: Vec<Draw>,
    /// One of colour, one or more of geometry.
    pub(crate) pictures: Vec<PlannedPicture<'a>>,
}

/// One picture of a view.
pub(crate) struct PlannedPicture<'a> {
    pub(crate) camera: &'a Camera,
    /// Its shot's place among those of the submission.
    pub(crate) place: usize,
    /// Where the picture goes in the read-back buffer.
    pub(crate) offset_bytes: u64,
    pub(crate) row_pitch_bytes: u32,
}

/// One submission.
#[derive(Default)]
pub(crate) struct Batch<'a> {
    pub(crate) planned: Vec<PlannedView<'a>>,
    /// At the places of the planned views.
    pub(crate) views: Vec<ViewUniform>,
    pub(crate) instances: Vec<Instance>,
    pub(crate) picture_count: usize,
    pub(crate) readback_bytes: u64,
}

impl<'a> Batch<'a> {
    /// As many of the shots as fit into one submission, at least one.
    pub(crate) fn of(shots: &'a [Shot<'a>], software: bool) -> Self {
        // Instance 0 is where towns already are.
        let mut batch = Self { instances: vec![Instance::IN_PLACE], ..Self::default() };
        for shot in shots.iter().take(SHOTS_PER_BATCH_MAX) {
            let bytes = picture_bytes(shot.camera);
            if batch.readback_bytes > 0 && batch.readback_bytes + bytes > READBACK_BYTES_MAX {
                break;
            }
            batch.add(shot, software);
        }
        batch
    }

    fn add(&mut self, shot: &'a Shot<'a>, software: bool) {
        let picture = PlannedPicture {
            camera: shot.camera,
            place: self.picture_count,
            offset_bytes: self.readback_bytes,
            row_pitch_bytes: row_pitch_bytes(shot.camera),
        };
        self.picture_count += 1;
        self.readback_bytes += picture_bytes(shot.camera);
        match self.planned.iter_mut().find(|planned| planned.shot.shares_geometry_with(shot)) {
            Some(planned) => planned.pictures.push(picture),
            None => self.add_view(shot, picture, software),
        }
    }

    fn add_view(&mut self, shot: &'a Shot<'a>, picture: PlannedPicture<'a>, software: bool) {
        let Camera { width_px, height_px, kind, .. } = *shot.camera;
        let side_px = shadow_side_px(width_px, height_px, software);
        let shadow = ShadowView::of(&shot.view, &shot.light.to_light, side_px);
        let bodies = self.place_seen(shot);
        let shadows = (kind == ImageKind::Rgb).then(|| Shadows {
            side_px,
            town: shading_town(shot, &shadow),
            bodies: self.place_shading(shot, &shadow),
        });
        self.views.push(ViewUniform::new(&shot.view, width_px, &shot.light, &shadow, side_px));
        let town = visible_town(shot);
        let pictures = vec![picture];
        self.planned.push(PlannedView { shot, shadows, town, bodies, pictures });
    }

    /// Appends the bodies in the picture, small ones coarsely.
    fn place_seen(&mut self, shot: &Shot<'_>) -> Vec<Draw> {
        let pixel = 2.0 * shot.view.half_extent[0] / shot.camera.width_px as f32;
        let eye_m = shot.view.eye_m();
        let radius_px =
            |body: &Body| body.radius_m / (pixel * (body.centre_m - eye_m).norm().max(0.1));
        let seen = |body: &&Body| {
            radius_px(body) > BODY_RADIUS_PX_MIN
                && within(body, |min_m, max_m| shot.view.may_see(min_m, max_m))
        };
        let detail_of = |body: &Body| {
            if radius_px(body) < FINE_RADIUS_PX_MIN { Detail::Coarse } else { Detail::Fine }
        };
        self.place(shot.bodies().filter(seen), detail_of)
    }

    /// Appends the bodies that throw shadows into the picture.
    fn place_shading(&mut self, shot: &Shot<'_>, shadow: &ShadowView) -> Vec<Draw> {
        let shading = |body: &&Body| within(body, |min_m, max_m| shadow.may_see(min_m, max_m));
        self.place(shot.bodies().filter(shading), |_| Detail::Coarse)
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
fn visible_town(shot: &Shot<'_>) -> Vec<(Family, Range<u32>)> {
    let eye_m = shot.view.eye_m();
    let in_view = |tile: &&Tile| shot.view.may_see(&tile.min_m, &tile.max_m);
    let mut tiles: Vec<&Tile> = shot.town.tiles.iter().filter(in_view).collect();
    tiles.sort_by(|a, b| a.distance_squared(&eye_m).total_cmp(&b.distance_squared(&eye_m)));
    let mut ranges = Vec::with_capacity(tiles.len());
    for tile in tiles {
        for (family, range) in &tile.indices_of {
            tile.shown(range, shot.hidden, |part| ranges.push((*family, part)));
        }
    }
    ranges
}

/// Walls and trees throw shadows; what lies on the ground throws none that anyone sees.
fn shading_town(shot: &Shot<'_>, shadow: &ShadowView) -> Vec<Range<u32>> {
    let casts = |tile: &&Tile| shadow.may_see(&tile.min_m, &tile.max_m);
    let mut ranges = Vec::new();
    for tile in shot.town.tiles.iter().filter(casts) {
        for (_, range) in tile.indices_of.iter().filter(|(family, _)| *family != Family::Ground) {
            tile.shown(range, shot.hidden, |part| ranges.push(part));
        }
    }
    ranges
}

fn row_pitch_bytes(camera: &Camera) -> u32 {
    (camera.width_px * 4).next_multiple_of(ROW_BYTES_MULTIPLE)
}

fn picture_bytes(camera: &Camera) -> u64 {
    u64::from(row_pitch_bytes(camera)) * u64::from(camera.height_px)
}
