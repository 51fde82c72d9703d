//! What a shader knows of one picture: the `View` of `common.wgsl`.

use bytemuck::{Pod, Zeroable};
use schemas::Vec3;

use crate::scene::light::Light;
use crate::scene::shadow::{REACH_M, ShadowView};
use crate::scene::view::View;

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
}

impl ViewUniform {
    pub(crate) fn new(
        view: &View,
        width_px: u32,
        light: &Light,
        shadow: &ShadowView,
        shadow_side_px: u32,
    ) -> Self {
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
        }
    }
}

fn four(xyz: Vec3, w: f32) -> [f32; 4] {
    [xyz.x, xyz.y, xyz.z, w]
}
