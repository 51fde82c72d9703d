//! Light that spreads from what is very bright.

use super::linear;

/// Light of a channel from which on a picture has no steps left, and how much more than white it
/// may have been there.
const BRIGHT: f32 = 0.72;
const BEYOND: f32 = 7.0;
/// Radii of the halos as parts of the picture's width, and how much goes into each.
///
/// **Source:** six of Unreal Engine's bloom sizes in two pairs, by their weights.
const HALOS: [(f32, f32); 3] = [(0.006, 0.50), (0.02, 0.22), (0.08, 0.10)];
/// Halos are computed on pictures that are smaller by this.
const COARSE: usize = 2;
/// Boxes one after the other that make a bell.
const BOXES: usize = 3;

/// Adds the halos of what is bright. Pictures without anything bright stay as they are.
pub(super) fn glow(data: &mut [u8], [width_px, height_px]: [u32; 2], intensity: f32) {
    let (width, height) = (width_px as usize, height_px as usize);
    let (pixels, _) = data.as_chunks_mut::<4>();
    let Some(bright) = Plane::bright(pixels, [width, height]).filter(|_| intensity > 0.0) else {
        return;
    };
    let halos = HALOS.map(|(radius, weight)| {
        let mut halo = bright.clone();
        let reach = (radius * width as f32 / COARSE as f32).round().max(1.0) as usize;
        (0..BOXES).for_each(|_| halo.spread(reach));
        (halo, weight * intensity)
    });
    for (index, pixel) in pixels.iter_mut().enumerate() {
        let at = [index % width, index / width];
        let mut light = linear::light(*pixel);
        let mut added = 0.0;
        for (halo, weight) in &halos {
            let more = halo.at(at);
            for (part, more) in light.iter_mut().zip(more) {
                *part += more * weight;
                added += more * weight;
            }
        }
        if added > 1e-4 {
            *pixel = linear::pixel(light);
        }
    }
}

/// Light on a coarser grid.
#[derive(Clone)]
struct Plane {
    width: usize,
    light: Vec<[f32; 3]>,
}

impl Plane {
    /// What is brighter than a picture can tell; `None` where nothing is.
    fn bright(pixels: &[[u8; 4]], [width, height]: [usize; 2]) -> Option<Self> {
        let (coarse_width, coarse_height) = (width.div_ceil(COARSE), height.div_ceil(COARSE));
        let mut light = vec![[0.0; 3]; coarse_width * coarse_height];
        let mut is_any = false;
        let part_of_cell = 1.0 / (COARSE * COARSE) as f32;
        for (index, pixel) in pixels.iter().enumerate() {
            let over = linear::light(*pixel).map(|part| (part - BRIGHT).max(0.0));
            if over == [0.0; 3] {
                continue;
            }
            is_any = true;
            let at = index / width / COARSE * coarse_width + index % width / COARSE;
            for (sum, over) in light.get_mut(at)?.iter_mut().zip(over) {
                *sum += over * (BEYOND / (1.0 - BRIGHT)) * part_of_cell;
            }
        }
        is_any.then_some(Self { width: coarse_width, light })
    }

    /// The mean of all within a reach, along rows and then along columns.
    fn spread(&mut self, reach: usize) {
        let height = self.light.len() / self.width.max(1);
        for row in 0..height {
            self.spread_line(row * self.width, 1, self.width, reach);
        }
        for column in 0..self.width {
            self.spread_line(column, self.width, height, reach);
        }
    }

    fn spread_line(&mut self, first: usize, step: usize, count: usize, reach: usize) {
        let line: Vec<[f32; 3]> =
            (0..count).filter_map(|at| self.light.get(first + at * step).copied()).collect();
        let per_box = 1.0 / (2 * reach + 1) as f32;
        let mut sum = [0.0f32; 3];
        let add = |sum: &mut [f32; 3], light: Option<&[f32; 3]>, sign: f32| {
            for (sum, part) in sum.iter_mut().zip(light.into_iter().flatten()) {
                *sum += sign * part;
            }
        };
        line.iter().take(reach).for_each(|light| add(&mut sum, Some(light), 1.0));
        for at in 0..line.len() {
            add(&mut sum, line.get(at + reach), 1.0);
            if let Some(slot) = self.light.get_mut(first + at * step) {
                *slot = sum.map(|part| (part * per_box).max(0.0));
            }
            add(&mut sum, at.checked_sub(reach).and_then(|at| line.get(at)), -1.0);
        }
    }

    /// At a pixel of the picture: between the four cells around it.
    fn at(&self, [column, row]: [usize; 2]) -> [f32; 3] {
        let height = self.light.len() / self.width.max(1);
        let place = |pixel: usize, count: usize| {
            let at = ((pixel as f32 + 0.5) / COARSE as f32 - 0.5).clamp(0.0, (count - 1) as f32);
            (at as usize, (at as usize + 1).min(count - 1), at.fract())
        };
        let (left, right, across) = place(column, self.width);
        let (above, below, down) = place(row, height);
        let cell = |row: usize, column: usize| {
            self.light.get(row * self.width + column).copied().unwrap_or_default()
        };
        let (a, b) = (cell(above, left), cell(above, right));
        let (c, d) = (cell(below, left), cell(below, right));
        [0, 1, 2].map(|part| {
            let upper = a[part] + (b[part] - a[part]) * across;
            let lower = c[part] + (d[part] - c[part]) * across;
            upper + (lower - upper) * down
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [160, 90];

    /// A dark picture with a square of a colour in its middle.
    fn night(colour: [u8; 3]) -> Vec<u8> {
        let [width, height] = SIZE;
        let is_lamp = |x: u32, y: u32| x.abs_diff(width / 2) < 3 && y.abs_diff(height / 2) < 3;
        let pixel = |index: u32| {
            let [r, g, b] = if is_lamp(index % width, index / width) { colour } else { [10; 3] };
            [r, g, b, 255]
        };
        (0..width * height).flat_map(pixel).collect()
    }

    fn at(data: &[u8], x: u32, y: u32) -> [u8; 4] {
        data.as_chunks::<4>().0[(y * SIZE[0] + x) as usize]
    }

    #[test]
    fn a_lamp_has_a_halo_of_its_own_colour_that_thins_outwards() {
        let mut data = night([255, 40, 20]);
        glow(&mut data, SIZE, 0.675);
        let near = at(&data, 86, 45);
        let further = at(&data, 92, 45);
        assert!(near[0] > 60 && near[0] > further[0] && further[0] > 10, "{near:?} {further:?}");
        assert!(near[2] == 10 && near[3] == 255, "{near:?}");
        let mut stronger = night([255, 40, 20]);
        glow(&mut stronger, SIZE, 2.0);
        assert!(at(&stronger, 92, 45)[0] > further[0]);
    }

    #[test]
    fn what_is_not_bright_has_none_and_neither_has_anything_at_intensity_0() {
        for (colour, intensity) in [([200, 200, 200], 0.675), ([255, 255, 255], 0.0)] {
            let mut data = night(colour);
            glow(&mut data, SIZE, intensity);
            assert!(data == night(colour), "{colour:?} {intensity}");
        }
    }
}
