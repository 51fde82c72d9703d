//! Rows of the buffers that the kernels read: same fields in the same order as in `layout.wgsl` and
//! `light.wgsl`.

use bodies::Instance;
use bytemuck::{Pod, Zeroable};
use raster::{ClusterFacts, Corner, Lamp, Occluder, Projection};
use schemas::Vec3;

use crate::models::strips::stretch_of;
use crate::scene::exposure::Tone;
use crate::scene::light::Light;
use crate::scene::material::{Family, table};
use crate::scene::shadow::{REACH_M, ShadowView};
use crate::strip::Strip;

/// In the place of a pixel: nobody wants it.
pub(crate) const NOWHERE: u32 = u32::MAX;
/// In the place of an error that nothing exceeds.
const ENDLESS_M: f32 = 1e30;

/// Who looks.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TargetRow {
    x: [f32; 4],
    y: [f32; 4],
    w: [f32; 4],
    nearness: [f32; 4],
    lens: [f32; 4],
    size: [f32; 4],
    reach: [f32; 4],
    eye: [f32; 4],
    /// First sample or pixel, pixels of a row, first row, rows.
    pub(crate) place: [u32; 4],
    /// Samples of a pixel, first word of hidden things, how many words, unused.
    pub(crate) kind: [u32; 4],
}

impl TargetRow {
    /// Levels may be off by so many pixels, and everything is put back by so much of its steepest
    /// change in a pixel.
    pub(crate) fn new(projection: &Projection, error_px: f32, slope: f32) -> Self {
        let Projection { x, y, w, nearness, near_m, is_sun, centre_px, .. } = *projection;
        let Projection { limits, norms, eye_m, focal_px, .. } = *projection;
        let per_error = focal_px[0].max(focal_px[1]) / error_px;
        Self {
            x,
            y,
            w,
            nearness,
            lens: [near_m, f32::from(u8::from(is_sun)), centre_px[0], centre_px[1]],
            size: [limits[0], limits[1], focal_px[0], focal_px[1]],
            reach: [norms[0], norms[1], norms[2], per_error],
            eye: [eye_m[0], eye_m[1], eye_m[2], slope],
            place: [0; 4],
            kind: [1, 0, 0, 0],
        }
    }
}

/// A model's place in the buffers of all models.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ModelPlace {
    pub(crate) corner: u32,
    pub(crate) triangle: u32,
    pub(crate) cluster: u32,
    pub(crate) clusters: u32,
}

/// A model where a target sees it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PlacedRow {
    world_from_model: [[f32; 4]; 3],
    tints: [[u8; 4]; 4],
    parts: [u32; 4],
    /// The target, clusters, the stretch, unused.
    seen: [u32; 4],
}

impl PlacedRow {
    pub(crate) fn new(at: &Instance, model: ModelPlace, target: u32) -> Self {
        let stretch = stretch_of(&at.world_from_shape).max();
        Self {
            world_from_model: at.world_from_shape,
            tints: at.tints,
            parts: [at.label, model.corner, model.triangle, model.cluster],
            seen: [target, model.clusters, stretch.to_bits(), 0],
        }
    }

    /// The same for a target of this number.
    pub(crate) fn seen_by(mut self, target: u32) -> Self {
        self.seen[0] = target;
        self
    }

    /// Clusters of its model.
    pub(crate) fn clusters(&self) -> u32 {
        self.seen[1]
    }
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ClusterRow {
    ball: [f32; 4],
    cone: [f32; 4],
    level_ball: [f32; 4],
    errors_m: [f32; 2],
    first: u32,
    count: u32,
}

impl From<ClusterFacts> for ClusterRow {
    fn from(facts: ClusterFacts) -> Self {
        Self {
            ball: facts.ball,
            cone: facts.cone,
            level_ball: facts.level_ball,
            errors_m: facts.errors_m.map(|error_m| error_m.min(ENDLESS_M)),
            first: facts.triangles.start as u32,
            count: facts.triangles.len() as u32,
        }
    }
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CornerRow {
    position: [f32; 3],
    normal_xy: u32,
    normal_z_looks: u32,
    facade_m: [f32; 2],
    label: u32,
}

impl From<&Corner> for CornerRow {
    fn from(corner: &Corner) -> Self {
        let [x, y, z] = corner.normal.map(|part| {
            let whole = (part * f32::from(i16::MAX)).round() as i16;
            u32::from(whole as u16)
        });
        let looks = u32::from(corner.material) | u32::from(corner.variant) << 8;
        Self {
            position: corner.position,
            normal_xy: x | y << 16,
            normal_z_looks: z | looks << 16,
            facade_m: corner.facade_m,
            label: corner.label,
        }
    }
}

pub(crate) type LampRow = [[f32; 4]; 4];
pub(crate) type OccluderRow = [[f32; 4]; 3];

pub(crate) fn lamp_row(lamp: &Lamp) -> LampRow {
    let with = |[x, y, z]: [f32; 3], w: f32| [x, y, z, w];
    let reach_m = if lamp.is_round { -lamp.reach_m } else { lamp.reach_m };
    let [wide, tall] = lamp.narrow;
    [
        with(lamp.place_m, reach_m),
        with(lamp.colour, lamp.cut),
        with(lamp.ahead, wide),
        with(lamp.left, tall),
    ]
}

pub(crate) fn occluder_row(occluder: &Occluder) -> OccluderRow {
    let ([x, y, z], [ahead_x, ahead_y]) = (occluder.place_m, occluder.ahead);
    let [half_length_m, half_width_m] = occluder.half_m;
    let [red, green, blue] = occluder.colour;
    [
        [x, y, z, occluder.height_m],
        [ahead_x, ahead_y, half_length_m, half_width_m],
        [red, green, blue, occluder.tall_m],
    ]
}

/// Colour and gloss, then pattern, tint and family of all materials.
pub(crate) fn material_rows() -> Vec<[[f32; 4]; 2]> {
    let rows = bodies::Material::ALL.into_iter().zip(table());
    rows.map(|(material, row)| {
        let [pattern, tint, ..] = row.pattern_tint;
        let family = match Family::of(material) {
            Family::Ground => 0.0,
            Family::Facade => 1.0,
            Family::Body => 2.0,
        };
        [row.colour_gloss, [pattern, tint, family, 0.0]]
    })
    .collect()
}

/// What shading knows of a view.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewRow {
    forward: [f32; 4],
    left: [f32; 4],
    up: [f32; 4],
    eye: [f32; 4],
    to_light: [f32; 4],
    direct: [f32; 4],
    zenith: [f32; 4],
    horizon: [f32; 4],
    bounce: [f32; 4],
    air: [f32; 4],
    tone: [[f32; 4]; 3],
    sun: [[f32; 4]; 3],
    /// First lamp, lamps, first occluder, occluders.
    pub(crate) lists: [u32; 4],
    /// First pixel of the town's and of the bodies' map of shadows, side of both, taps.
    pub(crate) shadow: [u32; 4],
    /// First sample, samples of a pixel, 1 for colour, unused.
    pub(crate) samples: [u32; 4],
    size: [u32; 4],
    /// Where colour or depth, labels and normals go.
    pub(crate) outs: [u32; 4],
}

impl ViewRow {
    /// Of a strip, whose map of shadows has such a side.
    pub(crate) fn new(strip: &Strip<'_>, shadow: &ShadowView, shadow_side_px: u32) -> Self {
        let (light, view, camera): (&Light, _, _) = (strip.light, strip.view, strip.camera());
        let tone = Tone::of(&camera.exposure, light.dim);
        let turn = view.world_from_camera.rotation;
        let [half_width, half_height] = view.half_extent;
        let pixel = 2.0 * half_width / camera.width_px as f32;
        let row = |at: usize| {
            let row = shadow.clip_from_world.row(at);
            [row[0], row[1], row[2], row[3]]
        };
        Self {
            forward: four(turn * Vec3::x(), 0.0),
            left: four(turn * Vec3::y() * half_width, pixel),
            up: four(turn * Vec3::z() * half_height, 0.0),
            eye: four(view.eye_m(), light.haze_per_m),
            to_light: four(light.to_light, light.disc),
            direct: four(light.direct, light.night),
            zenith: four(light.zenith, light.cloud),
            horizon: four(light.horizon, light.wet),
            bounce: four(light.bounce, 2.0 * REACH_M / shadow_side_px.max(1) as f32),
            air: [light.haze_start_m, light.rain, light.rain_phase, 0.0],
            tone: tone.rows().map(|[red, green, blue]| [red, green, blue, light.haze_fall_per_m]),
            sun: [row(0), row(1), row(2)],
            lists: [0; 4],
            shadow: [0, 0, shadow_side_px, 1],
            samples: [0, 1, 0, 0],
            size: [
                camera.width_px,
                camera.height_px,
                strip.rows.start,
                strip.rows.end - strip.rows.start,
            ],
            outs: [NOWHERE; 4],
        }
    }
}

fn four(xyz: Vec3, w: f32) -> [f32; 4] {
    [xyz.x, xyz.y, xyz.z, w]
}
