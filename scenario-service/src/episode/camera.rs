//! The ego's front camera.

use schemas::{ActorId, Camera, ImageEncoding, ImageKind, Pose, Vec3, level_pose};

use crate::scenario::Common;

/// Forward of and above the ego's origin.
const EGO_FROM_CAMERA_M: [f32; 3] = [2.5, 0.0, 1.0];

/// The front camera with the scenario's resolution and field of view.
pub(super) fn front(ego: ActorId, common: &Common) -> Camera {
    Camera {
        id: 0,
        carrier: Some(ego),
        carrier_from_camera: ego_from_camera(),
        width_px: common.camera_width,
        height_px: common.camera_height,
        horizontal_fov_rad: common.camera_fov.to_radians(),
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Jpeg,
        jpeg_quality: common.jpeg_quality,
        quality: common.camera_quality,
        ignored: Vec::new(),
        exposure: schemas::Exposure::PLAIN,
    }
}

fn ego_from_camera() -> Pose {
    level_pose(Vec3::from(EGO_FROM_CAMERA_M), 0.0)
}
