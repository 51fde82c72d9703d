//! Who looks: a pinhole, or the sun.

use crate::vector::{V3, affine, dot, norm, scale};

/// A pinhole camera.
///
/// **Frame:** the world's; metres.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Where it is.
    pub eye_m: [f32; 3],
    /// Unit vector along the view.
    pub forward: [f32; 3],
    /// Unit vector to the picture's left.
    pub left: [f32; 3],
    /// Unit vector to the picture's top.
    pub up: [f32; 3],
    /// Half width and half height of the picture at distance 1.
    pub half_extent: [f32; 2],
    /// Of the picture.
    pub width_px: u32,
    /// Of the picture.
    pub height_px: u32,
    /// Nothing nearer than this is drawn.
    pub near_m: f32,
}

/// The sun's view of a square: rows of the matrix from the world to a cube from -1 to 1, left to
/// right and bottom to top, whose depth runs from 0 at the sun to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct SunView {
    /// To the right.
    pub right: [f32; 4],
    /// Up.
    pub up: [f32; 4],
    /// Away from the sun.
    pub depth: [f32; 4],
    /// Pixels a side of the map.
    pub side_px: u32,
}

/// How places become pixels: across and down from the middle times the distance along the view,
/// that distance, and a nearness that grows towards the viewer and is linear in the picture.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// Across, in pixels times metres.
    pub x: [f32; 4],
    /// Down, in pixels times metres.
    pub y: [f32; 4],
    /// Metres along the view; 1 for the sun.
    pub w: [f32; 4],
    /// For the sun alone; a pinhole's is 1 / w.
    pub nearness: [f32; 4],
    /// Nothing nearer than this is drawn; 0 for the sun.
    pub near_m: f32,
    /// Whether it is the sun.
    pub is_sun: bool,
    /// Of the picture.
    pub centre_px: [f32; 2],
    /// What is further than this from the middle, in pixels, is not in the picture.
    pub limits: [f32; 2],
    /// How fast the distances from the picture's sides, from those above and below and from what
    /// is nearest grow with a metre.
    pub norms: [f32; 3],
    /// Where the viewer is; meaningless for the sun.
    pub eye_m: [f32; 3],
    /// Pixels that a metre has at a distance of a metre, across and down.
    pub focal_px: [f32; 2],
}

impl View {
    /// Along the view to a pixel's place from 0 to the width and height, in metres per metre.
    pub(crate) fn ray_parts(&self) -> RayParts {
        let [half_width, half_height] = self.half_extent;
        RayParts {
            across: 2.0 * half_width / self.width_px as f32,
            down: 2.0 * half_height / self.height_px as f32,
            half_width,
            half_height,
        }
    }

    /// How places become pixels of it.
    pub fn projection(&self) -> Projection {
        let [half_width, half_height] = self.half_extent;
        let (width, height) = (self.width_px as f32, self.height_px as f32);
        let row = |axis: V3, by: f32| {
            let [x, y, z] = scale(axis, by);
            [x, y, z, -by * dot(axis, self.eye_m)]
        };
        let focal_px = [width / (2.0 * half_width), height / (2.0 * half_height)];
        // One pixel more on every side.
        let limits = [width / 2.0 + 1.0, height / 2.0 + 1.0];
        let norm = |at: usize| (limits[at] * limits[at] + focal_px[at] * focal_px[at]).sqrt();
        Projection {
            x: row(self.left, -focal_px[0]),
            y: row(self.up, -focal_px[1]),
            w: row(self.forward, 1.0),
            nearness: [0.0; 4],
            near_m: self.near_m,
            is_sun: false,
            centre_px: [width / 2.0, height / 2.0],
            limits,
            norms: [norm(0), norm(1), 1.0].map(|norm| norm * 1.001),
            eye_m: self.eye_m,
            focal_px,
        }
    }
}

/// What rays to pixels are put together from.
#[derive(Clone, Copy)]
pub(crate) struct RayParts {
    pub(crate) across: f32,
    pub(crate) down: f32,
    pub(crate) half_width: f32,
    pub(crate) half_height: f32,
}

impl SunView {
    /// How places become pixels of the map.
    pub fn projection(&self) -> Projection {
        let half = self.side_px as f32 / 2.0;
        let by = |row: [f32; 4], by: f32| row.map(|part| part * by);
        let negative = by(self.depth, -1.0);
        let inside = |row: [f32; 4]| [row[0], row[1], row[2], row[3] + 1.0];
        let length = |[x, y, z, _]: [f32; 4]| norm([x, y, z]);
        let metre = half * length(self.right);
        Projection {
            x: by(self.right, half),
            y: by(self.up, -half),
            w: [0.0, 0.0, 0.0, 1.0],
            nearness: inside(negative),
            near_m: 0.0,
            is_sun: true,
            centre_px: [half; 2],
            limits: [half; 2],
            norms: [metre, half * length(self.up), length(self.depth)],
            eye_m: [0.0; 3],
            focal_px: [metre; 2],
        }
    }
}

impl Projection {
    /// As seen from a frame that stands in the world like this.
    pub(crate) fn within(&self, world_from_local: &[[f32; 4]; 3]) -> Self {
        let turned = |row: [f32; 4]| turned(row, world_from_local);
        Self {
            x: turned(self.x),
            y: turned(self.y),
            w: turned(self.w),
            nearness: turned(self.nearness),
            ..*self
        }
    }

    /// Whether any of a ball in the frame of this may be in the picture.
    pub(crate) fn may_see(&self, centre: V3, radius: f32) -> bool {
        let (x, y, w) = (affine(self.x, centre), affine(self.y, centre), affine(self.w, centre));
        let ahead = if self.is_sun { affine(self.nearness, centre) } else { w - self.near_m };
        let [across, down, along] = self.norms.map(|norm| norm * radius);
        ahead >= -along
            && self.limits[0] * w - x.abs() >= -across
            && self.limits[1] * w - y.abs() >= -down
    }
}

fn turned([x, y, z, w]: [f32; 4], matrix: &[[f32; 4]; 3]) -> [f32; 4] {
    let [a, b, c] = matrix;
    let mut row = [0.0; 4];
    for (((part, a), b), c) in row.iter_mut().zip(a).zip(b).zip(c) {
        *part = x * a + y * b + z * c;
    }
    row[3] += w;
    row
}

/// Where a place in the world is in a frame that stands in it like this; `None` if the frame is
/// flat or turned inside out.
pub(crate) fn seen_from(matrix: &[[f32; 4]; 3], place_m: V3) -> Option<V3> {
    let [a, b, c] = matrix.map(|[x, y, z, _]| [x, y, z]);
    let rest = [place_m[0] - matrix[0][3], place_m[1] - matrix[1][3], place_m[2] - matrix[2][3]];
    let (bc, ca, ab) =
        (crate::vector::cross(b, c), crate::vector::cross(c, a), crate::vector::cross(a, b));
    let volume = dot(a, bc);
    if volume.is_nan() || volume <= 0.0 {
        return None;
    }
    let axis = |at: usize| (bc[at] * rest[0] + ca[at] * rest[1] + ab[at] * rest[2]) / volume;
    Some([axis(0), axis(1), axis(2)])
}
