//! Points, lines, arrows, boxes and text that clients draw into the world, in colour pictures: as
//! bright by night as by day; text before everything, the rest behind what is nearer.

use schemas::{Pose, Vec3};

use super::font;

/// Nearer to the plane of the camera, a line is cut off.
const NEAR_M: f32 = 0.05;
/// What is drawn on a surface lies before it by so much, and by this share of the distance.
const LIFT_M: f32 = 0.02;
const LIFT_SHARE: f32 = 0.005;
/// Pixels of a point of size 1, as in CARLA.
const PX_PER_SIZE: f32 = 100.0;
/// Widest stroke.
const STROKE_PX_MAX: f32 = 64.0;
/// Rows of a picture for each pixel that a dot of a letter is wide.
const ROWS_PER_DOT: u32 = 240;
/// Letters of one text; the rest is left out.
const LETTERS_MAX: usize = 1_024;

/// What is drawn, in the world.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    pub(crate) figure: Figure,
    pub(crate) rgb: [u8; 3],
    /// Simulated time at which it goes; none: it stays until it is cleared.
    pub(crate) until_secs: Option<f64>,
}

/// Strokes in the world.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Figure {
    /// Place and size.
    Point(Vec3, f32),
    /// Ends of strokes, and their thickness in metres.
    Strokes(Vec<(Vec3, Vec3)>, f32),
    /// Upper left corner, letters, and whether they have a shadow.
    Text(Vec3, String, bool),
}

impl Figure {
    pub(crate) fn line(begin: Vec3, end: Vec3, thickness_m: f32) -> Self {
        Self::Strokes(vec![(begin, end)], thickness_m)
    }

    /// Text from a place on to the right.
    pub(crate) fn text(at_m: Vec3, text: &str, has_shadow: bool) -> Self {
        Self::Text(at_m, text.chars().take(LETTERS_MAX).collect(), has_shadow)
    }

    /// A line with four barbs at its end.
    pub(crate) fn arrow(begin: Vec3, end: Vec3, tip_m: f32, thickness_m: f32) -> Self {
        let along = (end - begin).try_normalize(1.0e-6).unwrap_or_else(Vec3::x);
        let helper = if along.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
        let side = along.cross(&helper).normalize();
        let up = side.cross(&along);
        let barbs = [side, -side, up, -up].map(|aside| (end, end + (aside - along) * tip_m));
        Self::Strokes([(begin, end)].into_iter().chain(barbs).collect(), thickness_m)
    }

    pub(crate) fn is_finite(&self) -> bool {
        let is_point = |point_m: &Vec3| point_m.iter().all(|number| number.is_finite());
        match self {
            Self::Point(at_m, size) => is_point(at_m) && size.is_finite(),
            Self::Text(at_m, ..) => is_point(at_m),
            Self::Strokes(strokes, thickness_m) => {
                let are_ends = |(from, to): &(Vec3, Vec3)| is_point(from) && is_point(to);
                thickness_m.is_finite() && strokes.iter().all(are_ends)
            }
        }
    }

    /// The edges of a box.
    pub(crate) fn cuboid(world_from_box: &Pose, half_m: Vec3, thickness_m: f32) -> Self {
        let corner = |index: usize| {
            let sign = |bit: usize| if index >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let own = half_m.component_mul(&Vec3::new(sign(0), sign(1), sign(2)));
            world_from_box.transform_point(&own.into()).coords
        };
        let edges = (0..8usize).flat_map(|index| {
            let neighbours = (0..3).map(move |bit| index | 1 << bit);
            neighbours.filter(move |other| *other != index).map(move |other| (index, other))
        });
        let strokes = edges.map(|(from, to)| (corner(from), corner(to))).collect();
        Self::Strokes(strokes, thickness_m)
    }
}

/// A colour picture and how far everything in it is.
pub(crate) struct Sheet<'a> {
    /// Rows of red, green, blue and a fourth byte.
    pub(crate) pixels: &'a mut [u8],
    /// Rows of metres along the view, as floats.
    pub(crate) depths: &'a [u8],
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    pub(crate) focal_px: f32,
}

/// Draws all shapes as the camera sees them.
pub(crate) fn sketch(sheet: &mut Sheet<'_>, world_from_camera: &Pose, shapes: &[Shape]) {
    let camera_from_world = world_from_camera.inverse();
    let seen = |point_m: &Vec3| camera_from_world.transform_point(&(*point_m).into()).coords;
    for shape in shapes {
        match &shape.figure {
            Figure::Point(at_m, size) => {
                let at_m = seen(at_m);
                if at_m.x > NEAR_M {
                    let half_px = (size * PX_PER_SIZE / 2.0).clamp(0.5, STROKE_PX_MAX);
                    sheet.blot(sheet.project(at_m), at_m.x, half_px, shape.rgb);
                }
            }
            Figure::Strokes(strokes, thickness_m) => {
                for (from, to) in strokes {
                    sheet.stroke(seen(from), seen(to), *thickness_m, shape.rgb);
                }
            }
            Figure::Text(at_m, text, has_shadow) => {
                let at_m = seen(at_m);
                if at_m.x > NEAR_M {
                    sheet.write(sheet.project(at_m), text, (shape.rgb, *has_shadow));
                }
            }
        }
    }
}

impl Sheet<'_> {
    /// Column and row of a point before the camera.
    fn project(&self, point_m: Vec3) -> (f32, f32) {
        let half = (self.width_px as f32 / 2.0, self.height_px as f32 / 2.0);
        let scale = self.focal_px / point_m.x;
        (half.0 - point_m.y * scale, half.1 - point_m.z * scale)
    }

    /// A line between two points in the camera's axes.
    fn stroke(&mut self, mut from: Vec3, mut to: Vec3, thickness_m: f32, rgb: [u8; 3]) {
        if from.x > to.x {
            std::mem::swap(&mut from, &mut to);
        }
        if to.x <= NEAR_M {
            return;
        }
        if from.x < NEAR_M {
            from = from.lerp(&to, (NEAR_M - from.x) / (to.x - from.x));
        }
        let (start, end) = (self.project(from), self.project(to));
        let Some((first, last)) = self.visible_share(start, end) else { return };
        let long_px = (end.0 - start.0).abs().max((end.1 - start.1).abs()) * (last - first);
        let steps =
            (long_px.ceil() as usize).clamp(1, 2 * (self.width_px + self.height_px) as usize);
        for step in 0..=steps {
            let share = first + (last - first) * step as f32 / steps as f32;
            let at = (start.0 + (end.0 - start.0) * share, start.1 + (end.1 - start.1) * share);
            // Depth runs straight in its inverse.
            let depth_m = 1.0 / ((1.0 - share) / from.x + share / to.x);
            let half_px = (thickness_m / 2.0 * self.focal_px / depth_m).clamp(0.5, STROKE_PX_MAX);
            self.blot(at, depth_m, half_px, rgb);
        }
    }

    /// The part of a line on the sheet, with a margin for its thickness, as shares of its length.
    fn visible_share(&self, start: (f32, f32), end: (f32, f32)) -> Option<(f32, f32)> {
        let (mut first, mut last) = (0.0f32, 1.0f32);
        for (from, to, size) in [(start.0, end.0, self.width_px), (start.1, end.1, self.height_px)]
        {
            let (low, high) = (-STROKE_PX_MAX, size as f32 + STROKE_PX_MAX);
            let length = to - from;
            if length.abs() < 1.0e-6 {
                if from < low || from > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - from) / length, (high - from) / length);
            (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
        }
        (first <= last).then_some((first, last))
    }

    /// Letters from a place to the right and downwards, before everything.
    fn write(&mut self, at: (f32, f32), text: &str, (rgb, has_shadow): ([u8; 3], bool)) {
        let dot_px = (self.height_px / ROWS_PER_DOT).max(1);
        let (mut line, mut column) = (0, 0);
        for letter in text.chars() {
            if letter == '\n' {
                (line, column) = (line + 1, 0);
                continue;
            }
            let left = at.0.round() + (column * font::ADVANCE * dot_px) as f32;
            let top = at.1.round() + (line * font::LINE * dot_px) as f32;
            let is_beside = left >= self.width_px as f32 || left < -((8 * dot_px) as f32);
            if !is_beside && has_shadow {
                let shifted = (left + dot_px as f32, top + dot_px as f32);
                self.put_letter(letter, shifted, (dot_px, [0; 3]));
            }
            if !is_beside {
                self.put_letter(letter, (left, top), (dot_px, rgb));
            }
            column += 1;
        }
    }

    fn put_letter(&mut self, letter: char, at: (f32, f32), (dot_px, rgb): (u32, [u8; 3])) {
        let (pixels, _) = self.pixels.as_chunks_mut::<4>();
        let columns = font::columns(letter);
        for (across, bits) in (0..dot_px * columns.len() as u32)
            .filter_map(|across| Some((across, columns.get((across / dot_px) as usize)?)))
        {
            for down in (0..dot_px * 7).filter(|down| bits >> (down / dot_px) & 1 == 1) {
                let (x, y) = (at.0 + across as f32, at.1 + down as f32);
                if x < 0.0 || y < 0.0 || x >= self.width_px as f32 || y >= self.height_px as f32 {
                    continue;
                }
                let index = (y as u32 * self.width_px + x as u32) as usize;
                if let Some(pixel) = pixels.get_mut(index) {
                    pixel[..3].copy_from_slice(&rgb);
                }
            }
        }
    }

    /// A square at a distance, where nothing nearer is.
    fn blot(&mut self, at: (f32, f32), depth_m: f32, half_px: f32, rgb: [u8; 3]) {
        let range = |middle: f32, size: u32| {
            let low = (middle - half_px).round().clamp(0.0, size as f32) as u32;
            let high = (middle + half_px).round().clamp(0.0, size as f32) as u32;
            low..high.max(low)
        };
        let before_m = depth_m - LIFT_M - LIFT_SHARE * depth_m;
        let (depths, _) = self.depths.as_chunks::<4>();
        let (pixels, _) = self.pixels.as_chunks_mut::<4>();
        for row in range(at.1, self.height_px) {
            for column in range(at.0, self.width_px) {
                let index = (row * self.width_px + column) as usize;
                let is_free =
                    depths.get(index).is_none_or(|depth| f32::from_le_bytes(*depth) >= before_m);
                if let Some(pixel) = pixels.get_mut(index).filter(|_| is_free) {
                    pixel[..3].copy_from_slice(&rgb);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE_PX: u32 = 100;

    /// Column and row of all pixels that are not black any more.
    fn drawn(figure: Figure, wall_m: f32) -> Vec<(u32, u32)> {
        let shape = Shape { figure, rgb: [255, 0, 0], until_secs: None };
        let mut pixels = vec![0; (SIDE_PX * SIDE_PX * 4) as usize];
        let depths = wall_m.to_le_bytes().repeat((SIDE_PX * SIDE_PX) as usize);
        let mut sheet = Sheet {
            pixels: &mut pixels,
            depths: &depths,
            width_px: SIDE_PX,
            height_px: SIDE_PX,
            focal_px: 50.0,
        };
        sketch(&mut sheet, &Pose::identity(), &[shape]);
        let red = pixels.chunks(4).zip(0u32..).filter(|(pixel, _)| pixel[0] == 255);
        red.map(|(_, index)| (index % SIDE_PX, index / SIDE_PX)).collect()
    }

    #[test]
    fn a_line_to_the_left_is_left_in_the_picture_unless_something_is_before_it() {
        let line = || Figure::line(Vec3::new(10.0, 0.0, 0.0), Vec3::new(10.0, 5.0, 0.0), 0.02);
        let pixels = drawn(line(), 20.0);
        assert!(pixels.len() >= 25 && pixels.len() < 80, "{}", pixels.len());
        assert!(
            pixels
                .iter()
                .all(|(column, row)| (24..=51).contains(column) && (49..=51).contains(row))
        );
        assert_eq!(drawn(line(), 5.0), []);
    }

    #[test]
    fn what_is_behind_the_camera_is_cut_off() {
        let through = Figure::line(Vec3::new(-5.0, 0.0, -1.0), Vec3::new(50.0, 0.0, -1.0), 0.05);
        let pixels = drawn(through, 1.0e3);
        assert!(!pixels.is_empty() && pixels.iter().all(|(_, row)| *row >= 50));
        assert_eq!(drawn(Figure::Point(Vec3::new(-1.0, 0.0, 0.0), 0.1), 1.0e3), []);
    }

    #[test]
    fn text_stands_to_the_right_of_its_place_even_behind_a_wall() {
        let text = |text: &str| Figure::text(Vec3::new(10.0, 0.0, 0.0), text, false);
        let bar = drawn(text("|"), 2.0);
        assert_eq!(bar, (50..57).map(|row| (52, row)).collect::<Vec<_>>());
        let two = drawn(text("||"), 2.0);
        assert!(two.len() == 14 && two.contains(&(58, 50)), "{two:?}");
        let below = drawn(text("|\n|"), 2.0);
        assert!(below.len() == 14 && below.contains(&(52, 59)), "{below:?}");
        assert_eq!(drawn(Figure::text(Vec3::new(-1.0, 0.0, 0.0), "behind", true), 2.0), []);
        assert!(!drawn(text(&"long ".repeat(500)), 2.0).is_empty());
    }

    #[test]
    fn a_box_has_twelve_edges_and_a_point_ten_pixels() {
        let Figure::Strokes(edges, _) = Figure::cuboid(&Pose::identity(), Vec3::repeat(1.0), 0.1)
        else {
            panic!("a box is made of strokes")
        };
        assert_eq!(edges.len(), 12);
        assert_eq!(drawn(Figure::Point(Vec3::new(5.0, 0.0, 0.0), 0.1), 1.0e3).len(), 100);
    }
}
