//! Where colours go.

use super::Eight;
use crate::pixels::PIXEL_BYTES;
use crate::vector::LANES;

/// Rows of a picture that are wanted.
pub(super) struct Out<'a> {
    pub(super) bytes: &'a mut [u8],
    pub(super) pitch_bytes: usize,
    pub(super) first_row: u32,
}

impl Out<'_> {
    pub(super) fn put(&mut self, eight: &Eight, colours: &[u32; LANES]) {
        for (lane, colour) in colours.iter().enumerate() {
            let (column, row) = (eight.columns[lane] as usize, eight.rows[lane] as u32);
            for row in row..row + eight.heights[lane] {
                let Some(at) = self.place((column, row)) else { continue };
                let pixels = self.bytes.get_mut(at..at + eight.widths[lane] * PIXEL_BYTES);
                for pixel in pixels.unwrap_or_default().as_chunks_mut::<PIXEL_BYTES>().0 {
                    *pixel = colour.to_le_bytes();
                }
            }
        }
    }

    /// Puts colours beside each other, of so many pixels each.
    #[inline(always)]
    pub(super) fn put_run<const WIDTH: usize>(
        &mut self,
        place: (usize, u32),
        colours: &[u32; LANES],
    ) {
        let Some(at) = self.place(place) else { return };
        let Some(pixels) = self.bytes.get_mut(at..at + LANES * WIDTH * PIXEL_BYTES) else { return };
        let (pixels, _) = pixels.as_chunks_mut::<PIXEL_BYTES>();
        for (pixels, colour) in pixels.as_chunks_mut::<WIDTH>().0.iter_mut().zip(colours) {
            *pixels = [colour.to_le_bytes(); WIDTH];
        }
    }

    /// Where the bytes of a pixel begin; `None` above the rows that are wanted.
    #[inline(always)]
    fn place(&self, (column, row): (usize, u32)) -> Option<usize> {
        let line = row.checked_sub(self.first_row)?;
        Some(line as usize * self.pitch_bytes + column * PIXEL_BYTES)
    }
}
