//! What a shader knows of one picture: the `View` of `common.wgsl`.

use bytemuck::{Pod, Zeroable};
use raster::{LAMPS_MAX, Lamp, OCCLUDERS_MAX, Occluder};
use schemas::Vec3;

use crate::scene::exposure::Tone;
use crate::scene::light::Light;
use crate::scene::shadow::{REACH_M, ShadowView};
use crate::scene::view::View;

/// A lamp as in `common.wgsl`.
type LampRow = [[f32; 4]; 4];
/// An occluder as in `common.wgsl`.
type OccluderRow = [[f32; 4]; 2];

/// What a picture has of its surroundings, those that matter most first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around<'a> {
    pub(crate) lamps: &'a [Lamp],
    pub(crate) occluders: &'a [Occluder],
}

/// Same fields in the same order as in `common.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    clip_from_world: [[f32; 4]; 4],
    shadow_from_world: [[f32; 4]; 4],
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
    counts: [f32; 4],
    lamps: [LampRow; LAMPS_MAX],
    occluders: [OccluderRow; OCCLUDERS_MAX],
}

impl ViewUniform {
    pub(crate) fn new(
        view: &View,
        width_px: u32,
        (light, tone, around): (&Light, &Tone, &Around<'_>),
        (shadow, shadow_side_px): (&ShadowView, u32),
    ) -> Self {
        let mut lamps = [LampRow::default(); LAMPS_MAX];
        lamps.iter_mut().zip(around.lamps).for_each(|(row, lamp)| *row = lamp_row(lamp));
        let mut occluders = [OccluderRow::default(); OCCLUDERS_MAX];
        occluders.iter_mut().zip(around.occluders).for_each(|(row, one)| *row = occluder_row(one));
        let lamp_count = around.lamps.len().min(LAMPS_MAX);
        let occluder_count = around.occluders.len().min(OCCLUDERS_MAX);
        let turn = view.world_from_camera.rotation;
        let [half_width, half_height] = view.half_extent;
        Self {
            clip_from_world: view.clip_from_world.into(),
            shadow_from_world: shadow.clip_from_world.into(),
            forward: four(turn * Vec3::x(), 0.0),
            left: four(turn * Vec3::y() * half_width, 2.0 * half_width / width_px as f32),
            up: four(turn * Vec3::z() * half_height, 0.0),
            eye: four(view.eye_m(), light.haze_per_m),
            to_light: four(light.to_light, light.disc),
            direct: four(light.direct, light.night),
            zenith: four(light.zenith, light.cloud),
            horizon: four(light.horizon, light.wet),
            bounce: four(light.bounce, 2.0 * REACH_M / shadow_side_px as f32),
            air: [light.haze_start_m, light.rain, light.rain_phase, 0.0],
            counts: [lamp_count as f32, occluder_count as f32, 0.0, 0.0],
            tone: tone.rows().map(|[red, green, blue]| [red, green, blue, light.haze_fall_per_m]),
            lamps,
            occluders,
        }
    }
}

fn lamp_row(lamp: &Lamp) -> LampRow {
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

fn occluder_row(occluder: &Occluder) -> OccluderRow {
    let ([x, y, z], [ahead_x, ahead_y]) = (occluder.place_m, occluder.ahead);
    let [half_length_m, half_width_m] = occluder.half_m;
    [[x, y, z, occluder.height_m], [ahead_x, ahead_y, half_length_m, half_width_m]]
}

fn four(xyz: Vec3, w: f32) -> [f32; 4] {
    [xyz.x, xyz.y, xyz.z, w]
}
