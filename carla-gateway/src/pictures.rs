//! What cameras see, byte by byte as CARLA's client reads it: four bytes a pixel, blue, green, red,
//! alpha, whatever they mean.

use schemas::{DEPTH_MAX_M, Image, ImageEncoding, ImageKind, Pose, TagId};

use crate::dialect::Transform;
use crate::snapshot::header;

/// The largest depth of CARLA's 24 bits.
const DEPTH_STEPS: f32 = 16_777_215.0;

/// A picture as a camera sent it, with the place of the camera.
pub(crate) struct Picture<'a> {
    pub(crate) frame_number: u64,
    pub(crate) sim_secs: f64,
    pub(crate) world_from_camera: &'a Pose,
    pub(crate) horizontal_fov_rad: f32,
}

/// What a camera's pixels hold, for those that can be drawn.
pub(crate) fn image_kind(blueprint: &str) -> Option<ImageKind> {
    match blueprint {
        "sensor.camera.rgb" => Some(ImageKind::Rgb),
        "sensor.camera.depth" => Some(ImageKind::Depth),
        "sensor.camera.semantic_segmentation" => Some(ImageKind::Semantic),
        "sensor.camera.instance_segmentation" => Some(ImageKind::Instance),
        "sensor.camera.normals" => Some(ImageKind::Normals),
        _ => None,
    }
}

/// The raw encoding of a kind of picture.
pub(crate) fn encoding_of(kind: ImageKind) -> ImageEncoding {
    match kind {
        ImageKind::Rgb => ImageEncoding::Rgba8,
        ImageKind::Depth => ImageEncoding::DepthF32,
        ImageKind::Semantic => ImageEncoding::TagU8,
        ImageKind::Instance => ImageEncoding::TagIdU32,
        ImageKind::Normals => ImageEncoding::NormalI8,
    }
}

/// Number of the sensor in the header: its position in a list inside the client.
fn sensor_number(kind: ImageKind) -> u64 {
    match kind {
        ImageKind::Depth => 1,
        ImageKind::Normals => 2,
        ImageKind::Rgb => 13,
        ImageKind::Semantic => 14,
        ImageKind::Instance => 15,
    }
}

/// The payload of one picture; `None` for one of another size than it says.
pub(crate) fn encode_picture(picture: &Picture<'_>, image: &Image) -> Option<Vec<u8>> {
    let transform = Transform::of(picture.world_from_camera);
    let number = sensor_number(image.kind);
    let mut out = header(number, picture.frame_number, picture.sim_secs, &transform);
    let pixel_count = image.width_px as usize * image.height_px as usize;
    out.reserve_exact(12 + 4 * pixel_count);
    out.extend_from_slice(&image.width_px.to_le_bytes());
    out.extend_from_slice(&image.height_px.to_le_bytes());
    out.extend_from_slice(&picture.horizontal_fov_rad.to_degrees().to_le_bytes());
    let start = out.len();
    match image.encoding {
        ImageEncoding::Rgba8 => put::<4>(&mut out, &image.data, |[r, g, b, a]| [b, g, r, a]),
        ImageEncoding::DepthF32 => put::<4>(&mut out, &image.data, depth),
        ImageEncoding::TagU8 => put::<1>(&mut out, &image.data, |[tag]| [0, 0, tag, 255]),
        ImageEncoding::TagIdU32 => put::<4>(&mut out, &image.data, instance),
        ImageEncoding::NormalI8 => put::<3>(&mut out, &image.data, normal),
        ImageEncoding::Jpeg => return None,
    }
    (out.len() - start == 4 * pixel_count).then_some(out)
}

/// Appends one pixel of four bytes for every `N` bytes.
fn put<const N: usize>(out: &mut Vec<u8>, data: &[u8], bgra: impl Fn([u8; N]) -> [u8; 4]) {
    let (pixels, _) = data.as_chunks::<N>();
    out.extend(pixels.iter().flat_map(|pixel| bgra(*pixel)));
}

/// 24 bits of the farthest depth, the low byte in red.
fn depth(metres: [u8; 4]) -> [u8; 4] {
    let share = f32::from_le_bytes(metres).clamp(0.0, DEPTH_MAX_M) / DEPTH_MAX_M;
    let [low, middle, high, _] = ((share * DEPTH_STEPS).round() as u32).to_le_bytes();
    [high, middle, low, 255]
}

/// The tag in red and the lower 16 bits of the id in green and blue.
fn instance(pixel: [u8; 4]) -> [u8; 4] {
    let [tag, ..] = pixel;
    let [low, high, ..] = TagId::unpack(pixel).id.to_le_bytes();
    [high, low, tag, 255]
}

/// The normal in the client's axes, -1 to 1 as 0 to 255.
fn normal(axes: [u8; 3]) -> [u8; 4] {
    let [x, y, z] = axes.map(|byte| i32::from(byte.cast_signed()));
    let [r, g, b] = [x, -y, z].map(|value| (value + 128).clamp(0, 255) as u8);
    [b, g, r, 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes after the header of a picture of one pixel.
    fn one_pixel(kind: ImageKind, data: Vec<u8>) -> Option<Vec<u8>> {
        let encoding = encoding_of(kind);
        let image = Image { camera: 0, width_px: 1, height_px: 1, kind, encoding, data };
        let picture = Picture {
            frame_number: 5,
            sim_secs: 0.0,
            world_from_camera: &Pose::identity(),
            horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
        };
        encode_picture(&picture, &image).map(|bytes| bytes[48..].to_vec())
    }

    #[test]
    fn a_picture_tells_its_size_and_angle_and_is_blue_green_red() {
        let bytes = one_pixel(ImageKind::Rgb, vec![1, 2, 3, 255]).unwrap();
        assert_eq!(bytes[..8], [1, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(bytes[8..12], 90.0f32.to_le_bytes());
        assert_eq!(bytes[12..], [3, 2, 1, 255]);
    }

    #[test]
    fn depth_has_its_low_byte_in_red_and_its_high_byte_in_blue() {
        let metres = 1_000.0 * 0x01_02_03 as f32 / DEPTH_STEPS;
        let bytes = one_pixel(ImageKind::Depth, metres.to_le_bytes().to_vec()).unwrap();
        assert_eq!(bytes[12..], [1, 2, 3, 255]);
        let far = one_pixel(ImageKind::Depth, 1.0e6f32.to_le_bytes().to_vec()).unwrap();
        assert_eq!(far[12..], [255, 255, 255, 255]);
    }

    #[test]
    fn tags_are_in_red_and_ids_in_green_and_blue() {
        assert_eq!(one_pixel(ImageKind::Semantic, vec![14]).unwrap()[12..], [0, 0, 14, 255]);
        let packed = (0x0201u32 << 8 | 14).to_le_bytes().to_vec();
        assert_eq!(one_pixel(ImageKind::Instance, packed).unwrap()[12..], [2, 1, 14, 255]);
    }

    #[test]
    fn a_normal_to_the_left_is_dark_in_the_clients_second_axis() {
        let left = one_pixel(ImageKind::Normals, vec![0, 127, 0]).unwrap();
        assert_eq!(left[12..], [128, 1, 128, 255]);
    }

    #[test]
    fn a_picture_of_another_size_than_it_says_is_no_picture() {
        assert_eq!(one_pixel(ImageKind::Rgb, vec![1, 2, 3]), None);
        assert_eq!(one_pixel(ImageKind::Semantic, vec![1, 2]), None);
    }
}
