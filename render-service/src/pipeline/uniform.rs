//! What a shader knows of one picture: the `View` of `common.wgsl`.

use bytemuck::{Pod, Zeroable};
use raster::{LAMPS_MAX, Lamp};
use schemas::Vec3;

use crate::scene::exposure::Tone;
use crate::scene::light::Light;
use crate::scene::shadow::{REACH_M, ShadowView};
use crate::scene::view::View;

/// A lamp as in `common.wgsl`.
type LampRow = [[f32; 4]; 4];

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
    lamps: [LampRow; LAMPS_MAX],
}

impl ViewUniform {
    pub(crate) fn new(
        view: &View,
        width_px: u32,
        (light, tone, lamps): (&Light, &Tone, &[Lamp]),
        (shadow, shadow_side_px): (&ShadowView, u32),
    ) -> Self {
        let mut rows = [LampRow::default(); LAMPS_MAX];
        rows.iter_mut().zip(lamps).for_each(|(row, lamp)| *row = lamp_row(lamp));
        let count = lamps.len().min(LAMPS_MAX);
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
            air: [light.haze_start_m, light.rain, light.rain_phase, count as f32],
            tone: tone.rows().map(|[red, green, blue]| [red, green, blue, light.haze_fall_per_m]),
            lamps: rows,
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

fn four(xyz: Vec3, w: f32) -> [f32; 4] {
    [xyz.x, xyz.y, xyz.z, w]
}
