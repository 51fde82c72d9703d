//! Pictures as messages, and what is known of the camera that took them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{Matrix3, Rotation3};
use schemas::{Camera, Frame, Image, ImageEncoding, Pose, UnitQuaternion};
use serde_json::{Value, json};

use crate::convert::time;
use crate::names::Part;
use crate::schema;

/// What one camera of an export is called, and what it sees.
#[derive(Clone, Debug)]
pub struct View {
    /// Of its topics and its frame, in `/`-separated words, unless the file has other names.
    pub name: String,
    /// How it is carried, and its pinhole.
    pub camera: Camera,
}

impl View {
    /// Where the frame of its pictures is: x right, y down, z along the view, as ROS and Foxglove
    /// have it; `None` without its carrier.
    pub(crate) fn world_from_optical(&self, frame: &Frame) -> Option<Pose> {
        let world_from_carrier = match self.camera.carrier {
            Some(carrier) => frame.actor(carrier)?.world_from_actor,
            None => Pose::identity(),
        };
        Some(world_from_carrier * self.camera.carrier_from_camera * camera_from_optical())
    }

    /// The schema of its pictures by name, encoded as JSON.
    pub(crate) fn schema(&self) -> (Part, &'static str, Value) {
        match self.camera.encoding {
            ImageEncoding::Jpeg => {
                (Part::Compressed, "foxglove.CompressedImage", schema::compressed_image())
            }
            _ => (Part::Raw, "foxglove.RawImage", schema::raw_image()),
        }
    }

    /// A pinhole without distortion.
    pub(crate) fn calibration(&self, frame_id: &str, now: u64) -> Value {
        let Camera { width_px, height_px, horizontal_fov_rad, .. } = self.camera;
        let [across, down] = [width_px, height_px].map(|pixels| f64::from(pixels) / 2.0);
        let focal = across / (f64::from(horizontal_fov_rad) / 2.0).tan();
        json!({
            "timestamp": time(now),
            "frame_id": frame_id,
            "width": width_px,
            "height": height_px,
            "distortion_model": "plumb_bob",
            "D": [0.0, 0.0, 0.0, 0.0, 0.0],
            "K": [focal, 0.0, across, 0.0, focal, down, 0.0, 0.0, 1.0],
            "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            "P": [focal, 0.0, across, 0.0, 0.0, focal, down, 0.0, 0.0, 0.0, 1.0, 0.0],
        })
    }

    pub(crate) fn message(&self, image: &Image, frame_id: &str, now: u64) -> Value {
        let data = STANDARD.encode(&image.data);
        let (encoding, pixel_bytes) = match image.encoding {
            ImageEncoding::Jpeg => {
                return json!({
                    "timestamp": time(now),
                    "frame_id": frame_id,
                    "data": data,
                    "format": "jpeg",
                });
            }
            ImageEncoding::Rgba8 => ("rgba8", 4),
            ImageEncoding::DepthF32 => ("32FC1", 4),
            ImageEncoding::TagU8 => ("mono8", 1),
            ImageEncoding::TagIdU32 => ("32SC1", 4),
            ImageEncoding::NormalI8 => ("8SC3", 3),
        };
        json!({
            "timestamp": time(now),
            "frame_id": frame_id,
            "width": image.width_px,
            "height": image.height_px,
            "encoding": encoding,
            "step": image.width_px * pixel_bytes,
            "data": data,
        })
    }
}

/// The inverse of what takes ISO 8855 (x along the view, y left, z up) there.
pub(crate) fn optical_from_camera() -> Pose {
    camera_from_optical().inverse()
}

/// From ISO 8855 (x along the view, y left, z up).
fn camera_from_optical() -> Pose {
    let axes = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Pose::from_parts(schemas::Translation3::identity(), turn)
}

#[cfg(test)]
mod tests {
    use schemas::{ImageKind, Vec3};

    use super::*;

    fn view() -> View {
        let camera = Camera {
            id: 0,
            carrier: None,
            carrier_from_camera: Pose::translation(1.0, 2.0, 3.0),
            width_px: 640,
            height_px: 360,
            horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
            kind: ImageKind::Depth,
            encoding: ImageEncoding::DepthF32,
            jpeg_quality: 90,
            quality: None,
            ignored: Vec::new(),
            exposure: schemas::Exposure::PLAIN,
        };
        View { name: "ego/top".to_owned(), camera }
    }

    #[test]
    fn pictures_look_along_the_z_axis_of_their_frame_with_y_down() {
        let turn = camera_from_optical().rotation;
        for (optical, camera) in
            [(Vec3::z(), Vec3::x()), (Vec3::x(), -Vec3::y()), (Vec3::y(), -Vec3::z())]
        {
            assert!((turn * optical - camera).norm() < 1e-6, "{optical} {camera}");
        }
    }

    #[test]
    fn a_quarter_circle_has_the_focal_length_of_half_its_width() {
        let told = view().calibration("ego/top_optical", 0);
        assert!((told["K"][0].as_f64().unwrap() - 320.0).abs() < 1e-3);
        assert_eq!((&told["K"][2], &told["K"][5]), (&json!(320.0), &json!(180.0)));
        assert_eq!(told["frame_id"], "ego/top_optical");
    }

    #[test]
    fn raw_pictures_tell_their_encoding_and_how_long_a_row_is() {
        let image = Image {
            camera: 0,
            width_px: 2,
            height_px: 1,
            kind: ImageKind::Depth,
            encoding: ImageEncoding::DepthF32,
            data: vec![0, 0, 128, 63, 0, 0, 0, 64],
        };
        let told = view().message(&image, "ego/top_optical", 1_500_000_000);
        assert_eq!((&told["encoding"], &told["step"]), (&json!("32FC1"), &json!(8)));
        assert_eq!(STANDARD.decode(told["data"].as_str().unwrap()).unwrap(), image.data);
        assert_eq!(told["timestamp"], json!({"sec": 1, "nsec": 500_000_000}));
    }
}
