//! Who looks: a pinhole, or the sun.

use std::ops::Range;

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
pub(crate) struct Projection {
    pub(crate) x: [f32; 4],
    pub(crate) y: [f32; 4],
    pub(crate) w: [f32; 4],
    /// For the sun alone; a pinhole's is 1 / w.
    pub(crate) nearness: [f32; 4],
    pub(crate) near_m: f32,
    pub(crate) is_sun: bool,
    pub(crate) centre_px: [f32; 2],
    /// Inward; what is behind one is not seen.
    planes: [[f32; 4]; 5],
    eye_m: V3,
    /// Pixels that a metre across has at a distance of a metre.
    pub(crate) focal_px: f32,
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

    pub(crate) fn projection(&self, rows: Range<u32>) -> Projection {
        let [half_width, half_height] = self.half_extent;
        let (width, height) = (self.width_px as f32, self.height_px as f32);
        let row = |axis: V3, by: f32| {
            let [x, y, z] = scale(axis, by);
            [x, y, z, -by * dot(axis, self.eye_m)]
        };
        let (focal_x, focal_y) = (width / (2.0 * half_width), height / (2.0 * half_height));
        let (x, y) = (row(self.left, -focal_x), row(self.up, -focal_y));
        let w = row(self.forward, 1.0);
        let sum = |a: [f32; 4], by: f32, b: [f32; 4]| {
            let mut sum = b;
            sum.iter_mut().zip(a).for_each(|(sum, a)| *sum += by * a);
            sum
        };
        let centre_px = [width / 2.0, height / 2.0];
        // One pixel more on every side.
        let (top, bottom) = (rows.start as f32 - 1.0, rows.end as f32 + 1.0);
        let negative = |[x, y, z, w]: [f32; 4]| [-x, -y, -z, -w];
        let mut near = w;
        near[3] -= self.near_m;
        let planes = [
            near,
            sum(w, width / 2.0 + 1.0, x),
            sum(w, width / 2.0 + 1.0, negative(x)),
            sum(w, height / 2.0 - top, y),
            sum(w, bottom - height / 2.0, negative(y)),
        ];
        Projection {
            x,
            y,
            w,
            nearness: [0.0; 4],
            near_m: self.near_m,
            is_sun: false,
            centre_px,
            planes,
            eye_m: self.eye_m,
            focal_px: focal_x,
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
    pub(crate) fn projection(&self) -> Projection {
        let half = self.side_px as f32 / 2.0;
        let by = |row: [f32; 4], by: f32| row.map(|part| part * by);
        let negative = by(self.depth, -1.0);
        let inside = |row: [f32; 4]| [row[0], row[1], row[2], row[3] + 1.0];
        let metre = norm([self.right[0], self.right[1], self.right[2]]);
        Projection {
            x: by(self.right, half),
            y: by(self.up, -half),
            w: [0.0, 0.0, 0.0, 1.0],
            nearness: inside(negative),
            near_m: 0.0,
            is_sun: true,
            centre_px: [half; 2],
            planes: [
                inside(self.right),
                inside(by(self.right, -1.0)),
                inside(self.up),
                inside(by(self.up, -1.0)),
                inside(negative),
            ],
            eye_m: [0.0; 3],
            focal_px: metre * half,
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
            planes: self.planes.map(turned),
            ..*self
        }
    }

    /// Whether any of a ball may be seen.
    pub(crate) fn may_see(&self, centre: V3, radius: f32) -> bool {
        self.planes.iter().all(|plane| {
            let [x, y, z, _] = *plane;
            affine(*plane, centre) >= -radius * norm([x, y, z])
        })
    }

    /// How near a ball comes; for the sun, 1.
    pub(crate) fn distance(&self, centre: V3, radius: f32) -> f32 {
        if self.is_sun {
            return 1.0;
        }
        let [x, y, z, _] = self.w;
        let outside = affine(self.w, centre) - radius * norm([x, y, z]);
        outside.max(self.near_m)
    }

    pub(crate) fn eye_m(&self) -> V3 {
        self.eye_m
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
