//! Cameras, the pictures they take, and the job that asks a renderer for them.

use crate::{ActorId, Exposure, Frame, Pose, Staging, Tenant};

/// Depth of the sky and of all that is further away, in metres.
pub const DEPTH_MAX_M: f32 = 1_000.0;

/// What a pixel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageKind {
    /// Colour as a person sees it.
    Rgb,
    /// Distance along the view.
    Depth,
    /// What a thing is: a [`SemanticTag`](crate::SemanticTag).
    Semantic,
    /// What a thing is, and which one.
    Instance,
    /// Where a surface faces.
    Normals,
}

/// How pixels are packed: rows tightly, row 0 at the top, numbers little endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageEncoding {
    /// Baseline JPEG, 4:2:0.
    Jpeg,
    /// Four bytes a pixel: red, green, blue in sRGB, then 255.
    Rgba8,
    /// One float a pixel: metres from the camera along its x axis, not along the ray; at most
    /// [`DEPTH_MAX_M`], which is also what the sky has.
    DepthF32,
    /// One byte a pixel: a [`SemanticTag`](crate::SemanticTag).
    TagU8,
    /// Four bytes a pixel, a [`TagId`](crate::TagId).
    TagIdU32,
    /// Three signed bytes a pixel: the unit normal in the camera's axes (x along the view, y left,
    /// z up) times 127; zeros for the sky.
    NormalI8,
}

/// How much work a picture in colour is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PictureQuality {
    /// For whoever needs many pictures: coarser light, shapes and patterns.
    Low,
    /// All that the renderer can.
    High,
}

impl ImageKind {
    /// The encodings that can carry it.
    pub const fn encodings(self) -> &'static [ImageEncoding] {
        match self {
            Self::Rgb => &[ImageEncoding::Jpeg, ImageEncoding::Rgba8],
            Self::Depth => &[ImageEncoding::DepthF32],
            Self::Semantic => &[ImageEncoding::TagU8],
            Self::Instance => &[ImageEncoding::TagIdU32],
            Self::Normals => &[ImageEncoding::NormalI8],
        }
    }
}

/// A pinhole camera. Its axes follow ISO 8855: x along the view, y left, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Chosen by the asker, returned with the image.
    pub id: u32,
    /// The actor that carries the camera, or none for one fixed in the world.
    pub carrier: Option<ActorId>,
    /// Pose in the carrier's frame, or in the world without a carrier.
    pub carrier_from_camera: Pose,
    /// 1 to [`IMAGE_SIDE_PX_MAX`](crate::limits::IMAGE_SIDE_PX_MAX).
    pub width_px: u32,
    /// 1 to [`IMAGE_SIDE_PX_MAX`](crate::limits::IMAGE_SIDE_PX_MAX).
    pub height_px: u32,
    /// More than 0, at most [`FIELD_OF_VIEW_DEG_MAX`](crate::limits::FIELD_OF_VIEW_DEG_MAX).
    pub horizontal_fov_rad: f32,
    /// What a pixel holds.
    pub kind: ImageKind,
    /// How pixels are packed; one of [`ImageKind::encodings`].
    pub encoding: ImageEncoding,
    /// 1 to 100, for JPEG.
    pub jpeg_quality: u8,
    /// Actors that are not in the picture, and throw no shadow into it; at most
    /// [`IGNORED_VEHICLES_MAX`](crate::limits::IGNORED_VEHICLES_MAX).
    pub ignored: Vec<ActorId>,
    /// `None` as the renderer was told.
    pub quality: Option<PictureQuality>,
    /// Of colour pictures.
    pub exposure: Exposure,
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The asker's id of the camera.
    pub camera: u32,
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// What a pixel holds.
    pub kind: ImageKind,
    /// How pixels are packed.
    pub encoding: ImageEncoding,
    /// The packed pixels.
    pub data: Vec<u8>,
}

/// Everything a renderer needs for all cameras of one frame. Who asks has the frame as it came
/// ([`SharedFrame`](crate::SharedFrame)), so that its bytes are only copied.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderJob<F = Frame> {
    /// Whose job it is, for a fair share.
    pub tenant: Tenant,
    /// What to draw.
    pub frame: F,
    /// Drawn in this order.
    pub cameras: Vec<Camera>,
    /// What no frame tells of.
    pub staging: Staging,
}
