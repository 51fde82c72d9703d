//! Textures on things: on each side of a thing's box one copy, upright as seen from outside.

use std::sync::{Arc, LazyLock};

use crate::vector::{V3, add, affine, dot, norm, scale, sub};

/// Samples along the longer side of what a pixel covers, at most.
const TAPS_MAX: f32 = 4.0;
/// Cosine of the flattest angle that is reckoned with.
const SLANT_MIN: f32 = 0.02;

/// A picture with the smaller ones that far pixels show.
#[derive(Debug)]
pub struct Texture {
    /// Each half as large as the one before, the last one of one pixel.
    levels: Vec<Level>,
    /// What multiplies its colours.
    brightness: f32,
}

/// In sRGB, from the lowest row on.
#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

/// What covers one thing of a model.
#[derive(Clone, Debug)]
pub struct Coat {
    /// The number of the thing.
    pub thing: u32,
    /// The upper three rows of the thing's box from the world, in which it reaches from -1 to 1.
    pub box_from_world: [[f32; 4]; 3],
    /// Half of the size of the box.
    pub half_m: [f32; 3],
    /// In place of its colour.
    pub diffuse: Option<Arc<Texture>>,
    /// What it gives light by.
    pub emissive: Option<Arc<Texture>>,
}

/// What a pixel shows of a thing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub(crate) place_m: V3,
    /// Unit vector.
    pub(crate) normal: V3,
    /// To the places that the next pixels to the right and above would show.
    pub(crate) steps_m: [V3; 2],
}

impl Texture {
    /// Of red, green and blue bytes in sRGB, from the lowest row on, each from left to right;
    /// `brightness` multiplies their linear colours. `None` for another count than the size says.
    pub fn new([width, height]: [usize; 2], brightness: f32, rgb: &[u8]) -> Option<Self> {
        let (pixels, rest) = rgb.as_chunks::<3>();
        if pixels.is_empty() || !rest.is_empty() || pixels.len() != width * height {
            return None;
        }
        let mut level = Level { width, height, pixels: pixels.to_vec() };
        let mut levels = Vec::new();
        while level.pixels.len() > 1 {
            let half = level.half();
            levels.push(std::mem::replace(&mut level, half));
        }
        levels.push(level);
        Some(Self { levels, brightness })
    }

    /// How many bytes it takes, about.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| level.pixels.len() * 3).sum()
    }

    /// Linear colour around a place, 0 to 1 from left to right and upwards, of a pixel with these
    /// sides.
    fn colour(&self, at: [f32; 2], sides: [[f32; 2]; 2]) -> V3 {
        let Some(Level { width, height, .. }) = self.levels.first() else { return [0.0; 3] };
        let length = |[u, v]: [f32; 2]| {
            let (u, v) = (u * *width as f32, v * *height as f32);
            (u * u + v * v).sqrt()
        };
        let [a, b] = sides.map(length);
        let (major, minor, along) = if a > b { (a, b, sides[0]) } else { (b, a, sides[1]) };
        let taps = (major / minor.max(1.0)).ceil().clamp(1.0, TAPS_MAX);
        let covered = (major / taps).max(minor).max(1.0);
        let mut sum = [0.0; 3];
        for tap in 0..taps as usize {
            let off = (tap as f32 + 0.5) / taps - 0.5;
            let at = [at[0] + along[0] * off, at[1] + along[1] * off];
            sum = add(sum, self.between_levels(at, covered));
        }
        scale(sum, self.brightness / taps)
    }

    /// What so many pixels of the largest level show together.
    fn between_levels(&self, at: [f32; 2], covered: f32) -> V3 {
        let mut covered = covered;
        for (level, next) in self.levels.iter().zip(self.levels.iter().skip(1)) {
            if covered < 2.0 {
                let share = covered - 1.0;
                let fine = level.colour(at);
                return add(fine, scale(sub(next.colour(at), fine), share));
            }
            covered *= 0.5;
        }
        self.levels.last().map_or([0.0; 3], |last| last.colour(at))
    }
}

impl Level {
    /// As large as half of it, each pixel the mean of those in its place.
    fn half(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut pixels = Vec::with_capacity(width * height);
        // The last pixels of odd sides count with those before them.
        let span = |at: usize, count: usize, of: usize| {
            at * of / count..((at + 1) * of).div_ceil(count).min(of)
        };
        for row in 0..height {
            for column in 0..width {
                let (rows, columns) =
                    (span(row, height, self.height), span(column, width, self.width));
                let mut sum = [0.0; 3];
                for row in rows.clone() {
                    for column in columns.clone() {
                        sum = add(sum, self.pixel(column, row));
                    }
                }
                let count = (rows.len() * columns.len()) as f32;
                pixels.push(scale(sum, 1.0 / count).map(encoded));
            }
        }
        Self { width, height, pixels }
    }

    fn pixel(&self, column: usize, row: usize) -> V3 {
        let pixel = self.pixels.get(row * self.width + column).copied().unwrap_or_default();
        pixel.map(|part| LINEAR[usize::from(part)])
    }

    /// Mixed from the four nearest pixels; beyond the edge is what is at the edge.
    fn colour(&self, [u, v]: [f32; 2]) -> V3 {
        let (column, across) = nearest(u, self.width);
        let (row, up) = nearest(v, self.height);
        let mixed = |row: usize| {
            let [a, b] = column.map(|column| self.pixel(column, row));
            add(a, scale(sub(b, a), across))
        };
        let [low, high] = row.map(mixed);
        add(low, scale(sub(high, low), up))
    }
}

/// The two pixels next to a place, and how much of the second one it shows.
fn nearest(at: f32, count: usize) -> ([usize; 2], f32) {
    let last = count - 1;
    let at = (at * count as f32 - 0.5).clamp(0.0, last as f32);
    let first = at as usize;
    ([first, (first + 1).min(last)], at - first as f32)
}

/// Linear light of every byte in sRGB.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let part = byte as f64 / 255.0;
        let linear =
            if part <= 0.040_45 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) };
        linear as f32
    })
});

/// The byte whose light is nearest.
fn encoded(linear: f32) -> u8 {
    let above = LINEAR.partition_point(|other| *other < linear).clamp(1, 255);
    let is_lower = linear - LINEAR[above - 1] < LINEAR[above] - linear;
    (above - usize::from(is_lower)) as u8
}

impl Coat {
    /// The colour of a patch, unless it is the thing's own, and the light that it gives.
    pub(crate) fn on(&self, patch: &Patch) -> (Option<V3>, V3) {
        let (at, sides) = self.laid(patch);
        let colour = |texture: &Arc<Texture>| texture.colour(at, sides);
        let diffuse = self.diffuse.as_ref().map(colour);
        (diffuse, self.emissive.as_ref().map_or([0.0; 3], colour))
    }

    /// Where on the texture a patch is, and its sides there.
    fn laid(&self, patch: &Patch) -> ([f32; 2], [[f32; 2]; 2]) {
        let rows = &self.box_from_world;
        let turned = |v: V3| rows.map(|[x, y, z, _]| dot([x, y, z], v));
        let place = rows.map(|row| affine(row, patch.place_m));
        // The rows are as much longer than units as the box is smaller.
        let [nx, ny, nz] = turned(patch.normal);
        let normal = [nx * self.half_m[0], ny * self.half_m[1], nz * self.half_m[2]];
        let [x, y, z] = normal.map(f32::abs);
        let on = |v: V3| match (z >= x && z >= y, x >= y) {
            // From above, as on a map; from below mirrored.
            (true, _) => [v[0], v[1]],
            (false, true) => [v[1] * normal[0].signum(), v[2]],
            (false, false) => [-v[0] * normal[1].signum(), v[2]],
        };
        let at = on(place).map(|part| part * 0.5 + 0.5);
        (at, patch.steps_m.map(|step| on(turned(step)).map(|part| part * 0.5)))
    }
}

/// A step from one pixel to the next on a surface that is seen along a direction.
pub(crate) fn step_on(step_m: V3, normal: V3, direction: V3) -> V3 {
    let facing = dot(normal, direction).min(-SLANT_MIN);
    let along = sub(step_m, scale(direction, dot(normal, step_m) / facing));
    let length = norm(along);
    if length.is_finite() { along } else { step_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four pixels: red and green below, blue and white above.
    fn four() -> Arc<Texture> {
        let rgb = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
        Arc::new(Texture::new([2, 2], 1.0, rgb.as_flattened()).unwrap())
    }

    /// On a block 4 by 2 by 6 m around the origin.
    fn coat() -> Coat {
        Coat {
            thing: 0,
            box_from_world: [
                [0.5, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0 / 3.0, 0.0],
            ],
            half_m: [2.0, 1.0, 3.0],
            diffuse: Some(four()),
            emissive: None,
        }
    }

    fn seen(place_m: V3, normal: V3) -> V3 {
        let steps_m = [[0.0; 3]; 2];
        coat().on(&Patch { place_m, normal, steps_m }).0.unwrap()
    }

    #[test]
    fn every_side_shows_the_whole_texture_upright_and_readable_from_outside() {
        let [red, green, blue] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        // Whoever looks from the east has the south to his left.
        for (normal, left, right) in [
            ([1.0, 0.0, 0.0], [2.0, -0.9, 0.0], [2.0, 0.9, 0.0]),
            ([-1.0, 0.0, 0.0], [-2.0, 0.9, 0.0], [-2.0, -0.9, 0.0]),
            ([0.0, 1.0, 0.0], [1.8, 1.0, 0.0], [-1.8, 1.0, 0.0]),
            ([0.0, -1.0, 0.0], [-1.8, -1.0, 0.0], [1.8, -1.0, 0.0]),
        ] {
            let at = |place: V3, z: f32| seen([place[0], place[1], z], normal);
            assert_eq!(at(left, -2.9), red, "{normal:?}");
            assert_eq!(at(right, -2.9), green, "{normal:?}");
            assert_eq!(at(left, 2.9), blue, "{normal:?}");
            assert_eq!(at(right, 2.9), [1.0; 3], "{normal:?}");
        }
        let up = [0.0, 0.0, 1.0];
        assert_eq!(seen([-1.8, -0.9, 3.0], up), red);
        assert_eq!(seen([1.8, -0.9, 3.0], up), green);
        assert_eq!(seen([-1.8, 0.9, 3.0], up), blue);
    }

    #[test]
    fn a_pixel_shows_the_mean_of_what_it_covers() {
        let texture = four();
        let whole = texture.colour([0.5, 0.5], [[1.0, 0.0], [0.0, 1.0]]);
        assert!(whole.iter().all(|part| (part - 0.5).abs() < 0.01), "{whole:?}");
        // A pixel that is as wide as the lower half is high.
        let low = texture.colour([0.5, 0.25], [[0.5, 0.0], [0.0, 0.0]]);
        let [red, green, blue] = low;
        assert!((red - 0.5).abs() < 0.01 && (green - 0.5).abs() < 0.01 && blue < 0.01, "{low:?}");
    }

    #[test]
    fn bytes_come_back_and_sizes_that_do_not_fit_are_none() {
        for byte in 0..=255 {
            assert_eq!(encoded(LINEAR[usize::from(byte)]), byte);
        }
        assert!(Texture::new([2, 2], 1.0, &[0; 11]).is_none());
        assert!(Texture::new([0, 2], 1.0, &[]).is_none());
        let odd = Texture::new([5, 3], 1.0, &[200; 45]).unwrap();
        let sizes = odd.levels.iter().map(|level| [level.width, level.height]);
        assert_eq!(sizes.collect::<Vec<_>>(), [[5, 3], [2, 1], [1, 1]]);
        assert!(odd.levels.iter().all(|level| level.pixels.iter().all(|it| *it == [200; 3])));
    }
}
