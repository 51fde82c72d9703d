//! From rows of pixels to what the asker of a picture wants.

use schemas::{Camera, Error, ErrorCode, Image, ImageEncoding};
use turbojpeg::{Compressor, PixelFormat, Subsamp};

/// Pixels of one picture: four bytes each, row 0 at the top, rows at a pitch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pixels<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) row_pitch_bytes: usize,
}

/// Packs the picture of a camera.
///
/// **Determinism:** equal pixels and cameras give equal bytes.
///
/// # Errors
/// [`ErrorCode::Internal`] when the JPEG encoder refuses.
pub(crate) fn encode(camera: &Camera, pixels: &Pixels<'_>) -> Result<Image, Error> {
    let data = match camera.encoding {
        ImageEncoding::Rgba8 => packed(camera, pixels),
        ImageEncoding::Jpeg => jpeg(camera, pixels).map_err(|cause| {
            Error::new(ErrorCode::Internal, format!("camera {}: no JPEG: {cause}", camera.id))
        })?,
    };
    Ok(Image {
        camera: camera.id,
        width_px: camera.width_px,
        height_px: camera.height_px,
        kind: camera.kind,
        encoding: camera.encoding,
        data,
    })
}

fn packed(camera: &Camera, pixels: &Pixels<'_>) -> Vec<u8> {
    let row_bytes = camera.width_px as usize * 4;
    let rows = pixels.bytes.chunks(pixels.row_pitch_bytes).take(camera.height_px as usize);
    rows.flat_map(|row| row.get(..row_bytes).unwrap_or(row)).copied().collect()
}

/// Baseline, 4:2:0.
fn jpeg(camera: &Camera, pixels: &Pixels<'_>) -> Result<Vec<u8>, turbojpeg::Error> {
    let mut compressor = Compressor::new()?;
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
