//! The part of the world whose shadows a camera can see, and how the sun looks at it.

use nalgebra::{Matrix4, Vector4};
use schemas::Vec3;

use super::view::{View, may_overlap};

/// Half side of the square that has shadows, in metres; beyond, everything is lit.
pub(crate) const REACH_M: f32 = 56.0;
/// How far ahead of the camera the square's centre is.
const AHEAD_M: f32 = 40.0;
/// Half of the depth that the sun looks through, in metres.
const DEPTH_M: f32 = 160.0;

/// The square moves in steps of this: whole pixels of every map, so that shadows' edges do not
/// crawl when the camera moves, and cameras near each other see one square.
const CELL_M: f32 = 14.0;

/// The sun's view of the ground around a camera.
///
/// **Frame:** clip space of WebGPU, depth 0 towards the sun and 1 away from it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShadowView {
    /// World to the shadow map's clip space.
    pub clip_from_world: Matrix4<f32>,
    planes: [Vector4<f32>; 6],
}

/// Side of the shadow map for a picture: fine enough for its pixels near the camera, and no finer.
pub(crate) fn shadow_side_px(width_px: u32, height_px: u32, software: bool) -> u32 {
    let wanted = (width_px.max(height_px) * 2).next_power_of_two();
    wanted.clamp(256, if software { 1_024 } else { 4_096 })
}

impl ShadowView {
    /// Around what `view` sees first.
    pub(crate) fn of(view: &View, to_light: &Vec3) -> Self {
        let forward = view.world_from_camera.rotation * Vec3::x();
        let level = Vec3::new(forward.x, forward.y, 0.0).try_normalize(1e-3).unwrap_or_default();
        let centre = view.eye_m() + level * AHEAD_M;
        let helper = if to_light.z.abs() < 0.99 { Vec3::z() } else { Vec3::x() };
        let right = helper.cross(to_light).try_normalize(1e-6).unwrap_or_else(Vec3::x);
        let up = to_light.cross(&right);
        let snapped = |axis: &Vec3| (axis.dot(&centre) / CELL_M).round() * CELL_M;
        let (along_right, along_up) = (snapped(&right), snapped(&up));
        let row = |axis: Vec3, middle: f32, half: f32| {
            Vector4::new(axis.x / half, axis.y / half, axis.z / half, -middle / half)
        };
        let x = row(right, along_right, REACH_M);
        let y = row(up, along_up, REACH_M);
        let depth =
            row(-to_light, -snapped(to_light), 2.0 * DEPTH_M) + Vector4::new(0.0, 0.0, 0.0, 0.5);
        let w = Vector4::new(0.0, 0.0, 0.0, 1.0);
        let clip_from_world =
            Matrix4::from_rows(&[x.transpose(), y.transpose(), depth.transpose(), w.transpose()]);
        Self { clip_from_world, planes: [w + x, w - x, w + y, w - y, depth, w - depth] }
    }

    /// Whether any of a box may throw a shadow into the square.
    pub(crate) fn may_see(&self, min_m: &Vec3, max_m: &Vec3) -> bool {
        may_overlap(&self.planes, min_m, max_m)
    }
}
