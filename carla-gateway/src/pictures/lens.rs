//! Lenses that bend pictures, and break colours.

use schemas::{Image, ImageEncoding};

use super::linear;
use crate::dialect::Actor;
use crate::rpc::Refusal;

/// CARLA's default of `lens_x_size` and `lens_y_size`.
const SIZE: f32 = 0.08;
/// Shift of red and green per unit of chromatic aberration, as parts of the distance from the
/// middle: 0.007 % per nanometre of wavelength from blue, at 611.3, 549.1 and 464.3 nm.
const RED: f32 = 0.007 * (611.3 - 464.3) * 0.01;
const GREEN: f32 = 0.007 * (549.1 - 464.3) * 0.01;

/// A lens that bends pictures.
///
/// A place at a distance ρ from the middle, in picture widths, shows what is at ρ (1 + k ρ² +
/// k³ ρ³) without a lens, as far as the circle says: `multiplier` (2 ρ)^`falloff`, at most 1.
/// **Source:** the polynomial of SSontech's cubic lens distortion; how CARLA's shader, which is no
/// text, mixes it in is a guess from its attributes: at its default multiplier 0 it does nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lens {
    k: f32,
    k_cube: f32,
    /// Stretch of both axes.
    stretch: [f32; 2],
    falloff: f32,
    multiplier: f32,
}

impl Lens {
    /// As a camera's attributes ask for it; `None` where it does nothing.
    pub(super) fn of(actor: &Actor) -> Result<Option<Self>, Refusal> {
        let lens = Self {
            k: actor.number("lens_k", -1.0)?.clamp(-100.0, 100.0),
            k_cube: actor.number("lens_kcube", 0.0)?.clamp(-100.0, 100.0),
            stretch: [
                actor.number("lens_x_size", SIZE)?.clamp(0.0, 1.0) / SIZE,
                actor.number("lens_y_size", SIZE)?.clamp(0.0, 1.0) / SIZE,
            ],
            falloff: actor.number("lens_circle_falloff", 5.0)?.clamp(0.0, 10.0),
            multiplier: actor.number("lens_circle_multiplier", 0.0)?.clamp(0.0, 10.0),
        };
        let bends = lens.multiplier > 0.0 && (lens.k != 0.0 || lens.k_cube != 0.0);
        Ok(bends.then_some(lens))
    }

    /// Where in the unbent picture a pixel's middle is, in pixels.
    fn source(&self, at: [f32; 2], [width, height]: [f32; 2]) -> [f32; 2] {
        let [x, y] = [(at[0] - width / 2.0) / width, (at[1] - height / 2.0) / width];
        let [sx, sy] = [x * self.stretch[0], y * self.stretch[1]];
        let square = sx * sx + sy * sy;
        let radius = square.sqrt();
        let part = (self.multiplier * (2.0 * radius).powf(self.falloff)).clamp(0.0, 1.0);
        let factor = 1.0 + part * square * (self.k + self.k_cube * radius);
        [width / 2.0 + x * width * factor, height / 2.0 + y * width * factor]
    }

    /// Bends a picture: colours flow into each other, other kinds take the nearest pixel. What lies
    /// outside shows the edge.
    pub(super) fn bend(&self, image: &mut Image) {
        match image.encoding {
            ImageEncoding::Rgba8 => self.bend_pixels(image, smooth),
            ImageEncoding::DepthF32 | ImageEncoding::TagIdU32 => {
                self.bend_pixels(image, nearest::<4>);
            }
            ImageEncoding::TagU8 => self.bend_pixels(image, nearest::<1>),
            ImageEncoding::NormalI8 => self.bend_pixels(image, nearest::<3>),
            ImageEncoding::Jpeg => {}
        }
    }

    fn bend_pixels<const N: usize>(
        &self,
        image: &mut Image,
        pick: impl Fn(&[[u8; N]], [usize; 2], [f32; 2]) -> Option<[u8; N]>,
    ) {
        let (width, height) = (image.width_px as usize, image.height_px as usize);
        let flat = image.data.clone();
        let (flat, _) = flat.as_chunks::<N>();
        let size = [width as f32, height as f32];
        let (pixels, _) = image.data.as_chunks_mut::<N>();
        for (index, pixel) in pixels.iter_mut().enumerate() {
            let at = [(index % width) as f32 + 0.5, (index / width) as f32 + 0.5];
            if let Some(picked) = pick(flat, [width, height], self.source(at, size)) {
                *pixel = picked;
            }
        }
    }
}

fn nearest<const N: usize>(
    pixels: &[[u8; N]],
    [width, height]: [usize; 2],
    [x, y]: [f32; 2],
) -> Option<[u8; N]> {
    let column = (x.max(0.0) as usize).min(width - 1);
    let row = (y.max(0.0) as usize).min(height - 1);
    pixels.get(row * width + column).copied()
}

fn smooth(pixels: &[[u8; 4]], size: [usize; 2], at: [f32; 2]) -> Option<[u8; 4]> {
    sampled(pixels, size, at).map(linear::pixel)
}

/// Light at a place between the middles of four pixels.
fn sampled(pixels: &[[u8; 4]], [width, height]: [usize; 2], [x, y]: [f32; 2]) -> Option<[f32; 3]> {
    let across = (x - 0.5).clamp(0.0, (width - 1) as f32);
    let down = (y - 0.5).clamp(0.0, (height - 1) as f32);
    let (column, row) = (across as usize, down as usize);
    let (next, below) = ((column + 1).min(width - 1), (row + 1).min(height - 1));
    let light =
        |row: usize, column: usize| pixels.get(row * width + column).copied().map(linear::light);
    let (a, b) = (light(row, column)?, light(row, next)?);
    let (c, d) = (light(below, column)?, light(below, next)?);
    let (right, low) = (across - column as f32, down - row as f32);
    Some([0, 1, 2].map(|part| {
        let upper = a[part] + (b[part] - a[part]) * right;
        let lower = c[part] + (d[part] - c[part]) * right;
        upper + (lower - upper) * low
    }))
}

/// Breaks colours outside of a part of the picture: red is drawn out most, blue not at all.
///
/// **Source:** Unreal Engine 4.26's scene fringe.
pub(super) fn fringe(
    data: &mut [u8],
    [width_px, height_px]: [u32; 2],
    [intensity, offset]: [f32; 2],
) {
    let (width, height) = (width_px as usize, height_px as usize);
    let flat = data.to_vec();
    let (flat, _) = flat.as_chunks::<4>();
    let steep = 1.0 / (1.0 - offset).max(1e-3);
    let (pixels, _) = data.as_chunks_mut::<4>();
    for (index, pixel) in pixels.iter_mut().enumerate() {
        let at = [(index % width) as f32 + 0.5, (index / width) as f32 + 0.5];
        let half = [width as f32 / 2.0, height as f32 / 2.0];
        let place = |part: f32| {
            [0, 1].map(|axis| {
                let from_middle = at[axis] / half[axis] - 1.0;
                let beyond = ((from_middle.abs() - offset) * steep).clamp(0.0, 1.0);
                at[axis] - beyond.copysign(from_middle) * part * intensity * half[axis]
            })
        };
        let mut light = linear::light(*pixel);
        for (channel, part) in [RED, GREEN].into_iter().enumerate() {
            if let Some(found) = sampled(flat, [width, height], place(part)) {
                light[channel] = found[channel];
            }
        }
        *pixel = linear::pixel(light);
    }
}

#[cfg(test)]
mod tests {
    use schemas::ImageKind;

    use super::*;

    const LENS: Lens =
        Lens { k: -1.0, k_cube: 0.0, stretch: [1.0; 2], falloff: 0.0, multiplier: 1.0 };
    const SIDE: u32 = 100;

    /// A cross of one bright column and one bright row through (80, 50).
    fn bar(kind: ImageKind, encoding: ImageEncoding) -> Image {
        let lit = |index: u32| index % SIDE == 80;
        let data = (0..SIDE * SIDE).flat_map(|index| {
            let byte = if lit(index) { 200 } else { 0 };
            match encoding {
                ImageEncoding::TagU8 => vec![byte],
                _ => vec![byte, byte, byte, 255],
            }
        });
        Image { camera: 0, width_px: SIDE, height_px: SIDE, kind, encoding, data: data.collect() }
    }

    #[test]
    fn a_lens_with_a_negative_k_pushes_things_outwards_and_leaves_the_middle() {
        let [x, y] = LENS.source([50.0, 50.0], [100.0; 2]);
        assert_eq!([x, y], [50.0, 50.0]);
        // Half a width out, the picture shows what was three quarters of that out.
        assert_eq!(LENS.source([100.0, 50.0], [100.0; 2]), [87.5, 50.0]);
        let mut tags = bar(ImageKind::Semantic, ImageEncoding::TagU8);
        LENS.bend(&mut tags);
        let row = &tags.data[50 * 100..51 * 100];
        let lit: Vec<usize> = (0..100).filter(|column| row[*column] == 200).collect();
        assert!(!lit.is_empty() && lit.iter().all(|column| (83..90).contains(column)), "{lit:?}");
    }

    #[test]
    fn the_circle_says_where_a_lens_bends() {
        let outside = Lens { falloff: 8.0, ..LENS };
        let near = outside.source([60.0, 50.0], [100.0; 2])[0];
        assert!((near - 60.0).abs() < 1e-3, "{near}");
        assert!(outside.source([99.0, 50.0], [100.0; 2])[0] < 91.0);
    }

    #[test]
    fn a_broken_bar_is_red_outside_and_blue_inside() {
        let mut image = bar(ImageKind::Rgb, ImageEncoding::Rgba8);
        fringe(&mut image.data, [SIDE; 2], [10.0, 0.0]);
        let (pixels, _) = image.data.as_chunks::<4>();
        let brightest = |channel: usize| {
            (0..100).max_by_key(|column| pixels[50 * 100 + column][channel]).unwrap()
        };
        let [red, green, blue] = [brightest(0), brightest(1), brightest(2)];
        assert!(red > green && green > blue && blue == 80, "{red} {green} {blue}");
    }
}
