//! What cameras see, byte by byte as CARLA's client reads it: four bytes a pixel, blue, green, red,
//! alpha, whatever they mean.

use schemas::{DEPTH_MAX_M, Image, ImageEncoding, ImageKind, Pose, TagId};

use crate::dialect::Transform;
use crate::snapshot::header;

mod blur;
mod events;
mod film;
mod flow;
mod font;
mod glow;
mod lens;
mod linear;
mod optics;
mod sketch;

pub(crate) use events::{Event as LightEvent, Memory, Reaction};
pub(crate) use film::{Film, TextureId};
pub(crate) use flow::{Movement, Segment};
pub(crate) use optics::{Optics, Photo};
pub(crate) use sketch::{Figure, Shape, Sheet, sketch};

use film::{Texture, palette_rgb};
use flow::{View, flow};

/// The largest depth of CARLA's 24 bits.
const DEPTH_STEPS: f32 = 16_777_215.0;

/// A picture as a camera sent it, with the place of the camera.
pub(crate) struct Picture<'a> {
    pub(crate) frame_number: u64,
    pub(crate) sim_secs: f64,
    pub(crate) world_from_camera: &'a Pose,
    pub(crate) horizontal_fov_rad: f32,
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

/// The payload of one picture by itself; `None` for one of another size than it says.
pub(crate) fn encode_picture(picture: &Picture<'_>, film: Film, image: &Image) -> Option<Vec<u8>> {
    let mut out = picture.head(film, image.width_px, image.height_px);
    let pixel_count = image.width_px as usize * image.height_px as usize;
    out.reserve_exact(4 * pixel_count);
    let start = out.len();
    match image.encoding {
        _ if film == Film::Texture(Texture::Black) => {
            out.extend(std::iter::repeat_n([0, 0, 0, 255], pixel_count).flatten());
        }
        ImageEncoding::TagU8 if film == Film::Palette => put::<1>(&mut out, &image.data, painted),
        ImageEncoding::Rgba8 => put::<4>(&mut out, &image.data, |[r, g, b, a]| [b, g, r, a]),
        ImageEncoding::DepthF32 => put::<4>(&mut out, &image.data, depth),
        ImageEncoding::TagU8 => put::<1>(&mut out, &image.data, |[tag]| [0, 0, tag, 255]),
        ImageEncoding::TagIdU32 => put::<4>(&mut out, &image.data, instance),
        ImageEncoding::NormalI8 => put::<3>(&mut out, &image.data, normal),
        ImageEncoding::Jpeg => return None,
    }
    (out.len() - start == 4 * pixel_count).then_some(out)
}

/// The payload of optical flow from depth and ids; `None` for pictures of another size.
pub(crate) fn encode_flow(
    picture: &Picture<'_>,
    film: Film,
    [depths, ids]: [&Image; 2],
    before: &Pose,
    movement: &Movement,
) -> Option<Vec<u8>> {
    let moved = flow_of(picture, [depths, ids], before, movement);
    let mut out = picture.head(film, depths.width_px, depths.height_px);
    if film == Film::Flow {
        out.extend(moved.iter().flatten().flat_map(|number| number.to_le_bytes()));
    } else {
        out.extend(moved.iter().flat_map(|pixel| velocity(*pixel)));
    }
    (moved.len() == depths.width_px as usize * depths.height_px as usize).then_some(out)
}

/// How far everything in a picture moved since the camera was elsewhere, as
/// [`flow`](flow::flow) tells it.
pub(crate) fn flow_of(
    picture: &Picture<'_>,
    [depths, ids]: [&Image; 2],
    before: &Pose,
    movement: &Movement,
) -> Vec<[f32; 2]> {
    let view = View {
        world_from_camera: *picture.world_from_camera,
        world_from_camera_before: *before,
        width_px: depths.width_px,
        height_px: depths.height_px,
        horizontal_fov_rad: picture.horizontal_fov_rad,
    };
    flow(&view, movement, &depths.data, &ids.data)
}

/// The payload of a camera of events.
pub(crate) fn encode_events(
    picture: &Picture<'_>,
    image: &Image,
    events: &[LightEvent],
) -> Vec<u8> {
    let mut out = picture.head(Film::Events, image.width_px, image.height_px);
    for event in events {
        out.extend_from_slice(&event.column.to_le_bytes());
        out.extend_from_slice(&event.row.to_le_bytes());
        out.extend_from_slice(&event.at_ns.to_le_bytes());
        out.push(u8::from(event.brighter));
    }
    out
}

impl Picture<'_> {
    /// Header, size and angle.
    fn head(&self, film: Film, width_px: u32, height_px: u32) -> Vec<u8> {
        let transform = Transform::of(self.world_from_camera);
        let mut out = header(film.number(), self.frame_number, self.sim_secs, &transform);
        out.extend_from_slice(&width_px.to_le_bytes());
        out.extend_from_slice(&height_px.to_le_bytes());
        out.extend_from_slice(&self.horizontal_fov_rad.to_degrees().to_le_bytes());
        out
    }
}

/// Appends one pixel of four bytes for every `N` bytes.
fn put<const N: usize>(out: &mut Vec<u8>, data: &[u8], bgra: impl Fn([u8; N]) -> [u8; 4]) {
    let (pixels, _) = data.as_chunks::<N>();
    let start = out.len();
    out.resize(start + 4 * pixels.len(), 0);
    let (places, _) = out[start..].as_chunks_mut::<4>();
    for (place, pixel) in places.iter_mut().zip(pixels) {
        *place = bgra(*pixel);
    }
}

/// 24 bits of the farthest depth, the low byte in red.
fn depth(metres: [u8; 4]) -> [u8; 4] {
    let share = f32::from_le_bytes(metres).clamp(0.0, DEPTH_MAX_M) / DEPTH_MAX_M;
    let [low, middle, high, _] = ((share * DEPTH_STEPS).round() as u32).to_le_bytes();
    [high, middle, low, 255]
}

/// A tag in the colours of Cityscapes.
fn painted([tag]: [u8; 1]) -> [u8; 4] {
    let [red, green, blue] = palette_rgb(tag);
    [blue, green, red, 255]
}

/// Movement to the right in red and up in green; the middle is none.
fn velocity(moved: [f32; 2]) -> [u8; 4] {
    let [red, green] = moved.map(|share| (127.5 + 63.75 * share.clamp(-2.0, 2.0)).round() as u8);
    [0, green, red, 255]
}

/// The tag in red and 16 bits of the id in green and blue: those of things of the map begin where
/// those of actors end, so that programs which look for an actor's id find nothing else.
fn instance(pixel: [u8; 4]) -> [u8; 4] {
    const HALF: u32 = 1 << 15;
    let [tag, ..] = pixel;
    let id = TagId::unpack(pixel).id;
    let of_map = if id >= TagId::SCENERY { HALF } else { 0 };
    let [low, high, ..] = (of_map | (id % HALF)).to_le_bytes();
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
    use schemas::{ActorId, SemanticTag};

    use super::*;

    /// The bytes after the header of a picture of one pixel.
    fn one_pixel(kind: ImageKind, data: Vec<u8>) -> Option<Vec<u8>> {
        developed(Film::Plain(kind), kind, data)
    }

    fn developed(film: Film, kind: ImageKind, data: Vec<u8>) -> Option<Vec<u8>> {
        let encoding = encoding_of(kind);
        let image = Image { camera: 0, width_px: 1, height_px: 1, kind, encoding, data };
        let picture = Picture {
            frame_number: 5,
            sim_secs: 0.0,
            world_from_camera: &Pose::identity(),
            horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
        };
        encode_picture(&picture, film, &image).map(|bytes| bytes[48..].to_vec())
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
    fn a_thing_of_the_map_never_has_the_id_of_an_actor() {
        let actor = TagId::of_actor(SemanticTag::Car, ActorId::new(50).unwrap());
        let house = TagId::of_scenery(SemanticTag::Buildings, 50);
        let [actor, house] = [actor, house].map(|packed| {
            let pixel = one_pixel(ImageKind::Instance, packed.to_le_bytes().to_vec()).unwrap();
            (pixel[13], pixel[12])
        });
        assert_eq!(actor, (50, 0));
        assert_eq!(house, (50, 0x80));
    }

    #[test]
    fn a_normal_to_the_left_is_dark_in_the_clients_second_axis() {
        let left = one_pixel(ImageKind::Normals, vec![0, 127, 0]).unwrap();
        assert_eq!(left[12..], [128, 1, 128, 255]);
    }

    #[test]
    fn a_palette_paints_tags_and_a_missing_texture_is_black() {
        let road = developed(Film::Palette, ImageKind::Semantic, vec![1]).unwrap();
        assert_eq!(road[12..], [128, 64, 128, 255]);
        let missing = Film::Texture(Texture::Black);
        let black = developed(missing, ImageKind::Semantic, vec![1]).unwrap();
        assert_eq!(black[12..], [0, 0, 0, 255]);
    }

    #[test]
    fn a_picture_of_another_size_than_it_says_is_no_picture() {
        assert_eq!(one_pixel(ImageKind::Rgb, vec![1, 2, 3]), None);
        assert_eq!(one_pixel(ImageKind::Semantic, vec![1, 2]), None);
    }
}
