//! Textures that clients make.

use serde::Deserialize;

/// Pixels row by row; a request bounds how many.
#[derive(Debug, Deserialize)]
pub(crate) struct Texture<C> {
    width: u32,
    height: u32,
    pixels: Vec<C>,
}

/// Red, green, blue in sRGB, alpha.
pub(crate) type Colour = (u8, u8, u8, u8);

/// Red, green, blue, linear, alpha.
pub(crate) type FloatColour = (f32, f32, f32, f32);

/// A colour as light, 0 to 1 and more.
pub(crate) trait Linear: Copy {
    fn linear(self) -> [f32; 3];
}

impl Linear for Colour {
    fn linear(self) -> [f32; 3] {
        let (red, green, blue, _) = self;
        [red, green, blue].map(|part| {
            let part = f32::from(part) / 255.0;
            if part <= 0.040_45 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
        })
    }
}

impl Linear for FloatColour {
    fn linear(self) -> [f32; 3] {
        let (red, green, blue, _) = self;
        [red, green, blue].map(|part| part.max(0.0))
    }
}

impl<C: Linear> Texture<C> {
    /// Width and height; `None` if there are other pixels than these say, or none.
    pub(crate) fn size_px(&self) -> Option<[usize; 2]> {
        let [width, height] = [self.width as usize, self.height as usize];
        let count = self.pixels.len();
        (count > 0 && width.checked_mul(height) == Some(count)).then_some([width, height])
    }

    /// The mean of some pixels.
    pub(crate) fn mean(
        &self,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
    ) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for row in rows.clone() {
            for column in columns.clone() {
                let pixel = self.pixels.get(row * self.width as usize + column);
                let parts = pixel.map_or([0.0; 3], |pixel| pixel.linear());
                sum.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
            }
        }
        let count = (rows.len() * columns.len()).max(1) as f32;
        sum.map(|part| part / count)
    }
}
