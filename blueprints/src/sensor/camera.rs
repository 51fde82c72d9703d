//! Cameras and what can be set of them.

use super::AttributeKind::{Bool, Float, Int, String as Text};
use super::{Row, SIDES, SensorClass, TICK, blueprint};
use crate::Blueprint;

pub(super) fn blueprints() -> impl Iterator<Item = Blueprint> {
    use SensorClass::{
        CameraCosmos, CameraDepth, CameraDvs, CameraInstanceSegmentation, CameraNormals,
        CameraOpticalFlow, CameraRgb, CameraSemanticSegmentation,
    };
    let cameras: [(&str, SensorClass, &[&[Row]]); 8] = [
        ("camera.cosmos_visualization", CameraCosmos, &[TICK, LENS]),
        ("camera.depth", CameraDepth, &[TICK, LENS]),
        ("camera.dvs", CameraDvs, &[TICK, LENS, FILM, EVENTS]),
        ("camera.instance_segmentation", CameraInstanceSegmentation, &[TICK, LENS]),
        ("camera.normals", CameraNormals, &[TICK, LENS]),
        ("camera.optical_flow", CameraOpticalFlow, &[TICK, LENS]),
        ("camera.rgb", CameraRgb, &[TICK, LENS, FILM, QUALITY]),
        ("camera.semantic_segmentation", CameraSemanticSegmentation, &[TICK, LENS]),
    ];
    cameras.into_iter().map(|(name, class, tables)| blueprint(name, class, &SIDES, tables))
}

const LENS: &[Row] = &[
    ("image_size_x", Int, &["800"]),
    ("image_size_y", Int, &["600"]),
    ("fov", Float, &["90.0"]),
    ("lens_circle_falloff", Float, &["5.0"]),
    ("lens_circle_multiplier", Float, &["0.0"]),
    ("lens_k", Float, &["-1.0"]),
    ("lens_kcube", Float, &["0.0"]),
    ("lens_x_size", Float, &["0.08"]),
    ("lens_y_size", Float, &["0.08"]),
];

const FILM: &[Row] = &[
    ("exposure_mode", Text, &["histogram", "manual"]),
    ("exposure_compensation", Float, &["0.0"]),
    ("shutter_speed", Float, &["200.0"]),
    ("iso", Float, &["100.0"]),
    ("fstop", Float, &["1.4"]),
    ("enable_postprocess_effects", Bool, &["true"]),
    ("gamma", Float, &["2.2"]),
    ("motion_blur_intensity", Float, &["0.45"]),
    ("motion_blur_max_distortion", Float, &["0.35"]),
    ("motion_blur_min_object_screen_size", Float, &["0.1"]),
    ("lens_flare_intensity", Float, &["0.1"]),
    ("bloom_intensity", Float, &["0.675"]),
    ("exposure_min_bright", Float, &["10.0"]),
    ("exposure_max_bright", Float, &["12.0"]),
    ("exposure_speed_up", Float, &["3.0"]),
    ("exposure_speed_down", Float, &["1.0"]),
    ("calibration_constant", Float, &["16.0"]),
    ("focal_distance", Float, &["1000.0"]),
    ("min_fstop", Float, &["1.2"]),
    ("blade_count", Int, &["5"]),
    ("blur_amount", Float, &["1.0"]),
    ("blur_radius", Float, &["0.0"]),
    ("slope", Float, &["0.88"]),
    ("toe", Float, &["0.55"]),
    ("shoulder", Float, &["0.26"]),
    ("black_clip", Float, &["0.0"]),
    ("white_clip", Float, &["0.04"]),
    ("temp", Float, &["6500.0"]),
    ("tint", Float, &["0.0"]),
    ("chromatic_aberration_intensity", Float, &["0.0"]),
    ("chromatic_aberration_offset", Float, &["0.0"]),
];

/// Ours: how finely colours are drawn; `site` as the renderer was told.
const QUALITY: &[Row] = &[("picture_quality", Text, &["site", "low", "high"])];

const EVENTS: &[Row] = &[
    ("positive_threshold", Float, &["0.3"]),
    ("negative_threshold", Float, &["0.3"]),
    ("sigma_positive_threshold", Float, &["0.0"]),
    ("sigma_negative_threshold", Float, &["0.0"]),
    ("refractory_period_ns", Int, &["0"]),
    ("use_log", Bool, &["true"]),
    ("log_eps", Float, &["0.001"]),
];
