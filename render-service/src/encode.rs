//! From rows of pixels to what the asker of a picture wants.

use schemas::{Camera, Error, ErrorCode, Image, ImageEncoding};
use turbojpeg::{Compressor, PixelFormat, Subsamp};

/// Pixels of one picture: four bytes each, row 0 at the top, rows at a pitch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pixels<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) row_pitch_bytes: usize,
}

/// Whether the picture of a camera is its pixels without gaps.
pub(crate) fn is_packed_by(camera: &Camera) -> bool {
    camera.encoding != ImageEncoding::Jpeg
}

/// Packs pictures; kept from one to the next, it saves memory being fetched anew.
#[derive(Default)]
pub(crate) struct Encoder(Option<Compressor>);

impl Encoder {
    /// Packs the picture of a camera, of which pixels have four bytes.
    ///
    /// **Determinism:** equal pixels and cameras give equal bytes.
    ///
    /// # Errors
    /// [`ErrorCode::Internal`] when the JPEG encoder refuses.
    pub(crate) fn encode(&mut self, camera: &Camera, pixels: &Pixels<'_>) -> Result<Image, Error> {
        let data = match camera.encoding {
            ImageEncoding::Rgba8 | ImageEncoding::DepthF32 | ImageEncoding::TagIdU32 => {
                packed::<4>(camera, pixels)
            }
            ImageEncoding::TagU8 => packed::<1>(camera, pixels),
            ImageEncoding::NormalI8 => packed::<3>(camera, pixels),
            ImageEncoding::Jpeg => self.jpeg(camera, pixels).map_err(|cause| {
                // What has refused once is not asked again.
                self.0 = None;
                Error::new(ErrorCode::Internal, format!("camera {}: no JPEG: {cause}", camera.id))
            })?,
        };
        Ok(image(camera, data))
    }

    /// Baseline, 4:2:0.
    fn jpeg(&mut self, camera: &Camera, pixels: &Pixels<'_>) -> Result<Vec<u8>, turbojpeg::Error> {
        let compressor = match &mut self.0 {
            Some(compressor) => compressor,
            none => none.insert(Compressor::new()?),
        };
        compressor.set_quality(i32::from(camera.jpeg_quality.clamp(1, 100)))?;
        compressor.set_subsamp(Subsamp::Sub2x2)?;
        compressor.compress_to_vec(turbojpeg::Image {
            pixels: pixels.bytes,
            width: camera.width_px as usize,
            pitch: pixels.row_pitch_bytes,
            height: camera.height_px as usize,
            format: PixelFormat::RGBX,
        })
    }
}

/// As [`Encoder::encode`], once.
///
/// # Errors
/// As it.
pub(crate) fn encode(camera: &Camera, pixels: &Pixels<'_>) -> Result<Image, Error> {
    Encoder::default().encode(camera, pixels)
}

/// The picture of a camera of which this is the data.
pub(crate) fn image(camera: &Camera, data: Vec<u8>) -> Image {
    Image {
        camera: camera.id,
        width_px: camera.width_px,
        height_px: camera.height_px,
        kind: camera.kind,
        encoding: camera.encoding,
        data,
    }
}

/// The first bytes of every pixel, without gaps.
fn packed<const BYTES: usize>(camera: &Camera, pixels: &Pixels<'_>) -> Vec<u8> {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let mut data = Vec::with_capacity(width * height * BYTES);
    for row in pixels.bytes.chunks(pixels.row_pitch_bytes).take(height) {
        if BYTES == 4 {
            data.extend_from_slice(row.get(..width * 4).unwrap_or(row));
        } else {
            let (row, _) = row.as_chunks::<4>();
            let parts = row.iter().take(width).filter_map(|pixel| pixel.first_chunk::<BYTES>());
            data.extend(parts.flatten());
        }
    }
    data
}
