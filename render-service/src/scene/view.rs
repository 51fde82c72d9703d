//! What a camera sees: checked, and as planes.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};
use schemas::limits::{COORDINATE_M_MAX, FIELD_OF_VIEW_DEG_MAX, IMAGE_SIDE_PX_MAX};
use schemas::{Camera, Error, ErrorCode, Frame, ImageEncoding, Pose, Vec3};

/// Nothing nearer than this is drawn, in metres.
pub(crate) const NEAR_M: f32 = 0.08;

/// A valid camera at its place in the world.
///
/// **Frame:** the camera's x along the view, y left, z up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct View {
    /// The camera in the world.
    pub world_from_camera: Pose,
    /// Half width and half height of the picture at distance 1.
    pub half_extent: [f32; 2],
    /// Inward normals and offsets of near, left, right, lower and upper plane.
    planes: [Vector4<f32>; 5],
}

impl View {
    /// Places `camera` in `frame`.
    ///
    /// # Errors
    /// [`ErrorCode::InvalidArgument`] for a size, field of view or pose outside the limits or an
    /// encoding that cannot carry the kind,
    /// [`ErrorCode::UnknownActor`] for a carrier that is not in the frame.
    pub(crate) fn of(camera: &Camera, frame: &Frame) -> Result<Self, Error> {
        check_lens(camera)?;
        let world_from_camera = match camera.carrier {
            None => camera.carrier_from_camera,
            Some(carrier) => {
                let actor = frame.actor(carrier).ok_or_else(|| {
                    Error::new(
                        ErrorCode::UnknownActor,
                        format!("camera {}: no such carrier", camera.id),
                    )
                    .wanted(format_args!("an actor of {} at {}", frame.world, frame.tick))
                    .found(carrier)
                })?;
                actor.world_from_actor * camera.carrier_from_camera
            }
        };
        check_pose(camera.id, &world_from_camera)?;
        let half_width = (camera.horizontal_fov_rad / 2.0).tan();
        let half_height = half_width * camera.height_px as f32 / camera.width_px as f32;
        Ok(Self::new(world_from_camera, [half_width, half_height]))
    }

    fn new(world_from_camera: Pose, [half_width, half_height]: [f32; 2]) -> Self {
        let (sx, sy) = (1.0 / half_width, 1.0 / half_height);
        #[rustfmt::skip]
        let clip_from_camera = Matrix4::new(
            0.0, -sx, 0.0, 0.0,
            0.0, 0.0, sy, 0.0,
            0.0, 0.0, 0.0, NEAR_M,
            1.0, 0.0, 0.0, 0.0,
        );
        let clip_from_world = clip_from_camera * world_from_camera.inverse().to_homogeneous();
        let row = |at: usize| clip_from_world.row(at).transpose();
        let (x, y, z, w) = (row(0), row(1), row(2), row(3));
        Self {
            world_from_camera,
            half_extent: [half_width, half_height],
            planes: [w - z, w + x, w - x, w + y, w - y],
        }
    }

    /// Where the camera is in the world.
    pub(crate) fn eye_m(&self) -> Vec3 {
        self.world_from_camera.translation.vector
    }

    /// What is seen in some rows of a picture of so many, with one more above and below.
    pub(crate) fn rows(&self, rows: &Range<u32>, height_px: u32) -> SeenRows {
        let [near, left, right, lower, upper] = self.planes;
        let (y, w) = ((lower - upper) / 2.0, (lower + upper) / 2.0);
        let clip_y = |row: f32| 1.0 - 2.0 * row / height_px as f32;
        let (top, bottom) = (rows.start as f32 - 1.0, rows.end as f32 + 1.0);
        SeenRows { planes: [near, left, right, y - w * clip_y(bottom), w * clip_y(top) - y] }
    }
}

/// What is seen in some rows of a picture.
pub(crate) struct SeenRows {
    /// As those of [`View`].
    planes: [Vector4<f32>; 5],
}

impl SeenRows {
    /// Whether any of a box in the world may be in these rows.
    pub(crate) fn may_see(&self, min_m: &Vec3, max_m: &Vec3) -> bool {
        may_overlap(&self.planes, min_m, max_m)
    }
}

/// Whether a box may have a point on the inner side of all planes.
pub(crate) fn may_overlap(planes: &[Vector4<f32>], min_m: &Vec3, max_m: &Vec3) -> bool {
    planes.iter().all(|plane| {
        let normal = plane.xyz();
        let furthest =
            normal.zip_zip_map(min_m, max_m, |n, min, max| if n > 0.0 { n * max } else { n * min });
        furthest.sum() + plane.w >= 0.0
    })
}

fn check_lens(camera: &Camera) -> Result<(), Error> {
    let refuse = |what: &str| {
        Error::new(ErrorCode::InvalidArgument, format!("camera {}: no such {what}", camera.id))
    };
    let side = 1..=IMAGE_SIDE_PX_MAX;
    if !side.contains(&camera.width_px) || !side.contains(&camera.height_px) {
        return Err(refuse("picture size")
            .wanted(format_args!("1 to {IMAGE_SIDE_PX_MAX} pixels a side"))
            .found(format_args!("{} × {}", camera.width_px, camera.height_px)));
    }
    let fov_deg = camera.horizontal_fov_rad.to_degrees();
    // The rounding of radians must not refuse the limit itself.
    if !(fov_deg > 0.0 && fov_deg <= FIELD_OF_VIEW_DEG_MAX + 1e-3) {
        return Err(refuse("field of view")
            .wanted(format_args!("more than 0 and at most {FIELD_OF_VIEW_DEG_MAX} degrees"))
            .found(format_args!("{fov_deg} degrees")));
    }
    let encodings = camera.kind.encodings();
    if !encodings.contains(&camera.encoding) {
        return Err(refuse("encoding of this kind of picture")
            .wanted(format_args!("{encodings:?} for {:?}", camera.kind))
            .found(format_args!("{:?}", camera.encoding)));
    }
    if camera.encoding == ImageEncoding::Jpeg && !(1..=100).contains(&camera.jpeg_quality) {
        return Err(refuse("JPEG quality").wanted("1 to 100").found(camera.jpeg_quality));
    }
    Ok(())
}

fn check_pose(camera: u32, pose: &Pose) -> Result<(), Error> {
    let at = pose.translation.vector;
    let turn = pose.rotation.coords;
    let inside = at.iter().all(|part| part.abs() <= COORDINATE_M_MAX);
    if inside && (turn.norm_squared() - 1.0).abs() < 1e-2 {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, format!("camera {camera}: no such pose"))
        .wanted(format_args!("a unit quaternion and coordinates within ±{COORDINATE_M_MAX} m"))
        .found(format_args!("position {:?}, quaternion {:?}", at.as_slice(), turn.as_slice())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        View::new(Pose::identity(), [1.0, 0.5])
    }

    #[test]
    fn a_box_is_left_out_only_where_no_pixel_shows_it() {
        let sees = |x: f32, y: f32, z: f32| {
            let half = Vec3::repeat(0.5);
            let centre = Vec3::new(x, y, z);
            let sees = |rows| view().rows(&rows, 1_000).may_see(&(centre - half), &(centre + half));
            [sees(0..1_000), sees(0..500), sees(500..1_000)]
        };
        for (x, y, z) in [(10.0, 0.0, 0.0), (10.0, 10.4, 0.0), (1e5, 0.0, 0.0)] {
            assert_eq!(sees(x, y, z), [true; 3]);
        }
        for (x, y, z) in [(-10.0, 0.0, 0.0), (10.0, 12.0, 0.0), (10.0, 0.0, 7.0)] {
            assert_eq!(sees(x, y, z), [false; 3]);
        }
        assert_eq!(sees(10.0, 0.0, 2.0), [true, true, false]);
        assert_eq!(sees(10.0, 0.0, -2.0), [true, false, true]);
    }
}
