//! The ground below what moves on: mostly the face of before, if no other face there can count.

use std::sync::atomic::{AtomicU8, Ordering};

use nalgebra::Vector2;
use schemas::Vec3;

use super::{EDGE_M, Face, Ground, Surface};

/// So far inside of its borders a face may be the only one.
const INSIDE_M: f32 = 8.0 * EDGE_M;
/// So much lower than another face one is below it, whatever is rounded.
const LOWER_M: f32 = 0.02;

/// The face that was found last; saves time and decides nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Known(Option<Found>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    cell: u32,
    face: u32,
    is_alone: bool,
}

/// Which faces count alone, by their entries in the lists of all cells. Each is looked into when
/// something comes to it first.
#[derive(Debug, Default)]
pub(super) struct Alone(Vec<AtomicU8>);

const UNKNOWN: u8 = 0;
const ALONE: u8 = 1;
const NOT_ALONE: u8 = 2;

impl Alone {
    pub(super) fn unknown(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU8::new(UNKNOWN)).collect())
    }

    fn get_or(&self, entry: usize, find: impl FnOnce() -> bool) -> bool {
        let Some(known) = self.0.get(entry) else { return false };
        match known.load(Ordering::Relaxed) {
            UNKNOWN => {
                let is_alone = find();
                known.store(if is_alone { ALONE } else { NOT_ALONE }, Ordering::Relaxed);
                is_alone
            }
            known => known == ALONE,
        }
    }
}

impl Ground {
    /// As [`below`](Self::below), for what was over the known face before and may be so still.
    ///
    /// - **Cost:** a few nanoseconds while it is.
    pub(crate) fn below_from(&self, known: &mut Known, point: Vec3) -> Surface {
        let Some(cell) = self.cell_index(point) else { return self.open_land };
        let before = known.0.filter(|found| found.cell as usize == cell);
        if let Some(Found { face, .. }) = before.filter(|found| found.is_alone)
            && let Some(height_m) = self.faces[face as usize].height_inside_m(point)
            && height_m <= point.z
        {
            return self.surface(height_m, face);
        }
        let Some((height_m, entry)) = self.highest(cell, point) else { return self.open_land };
        let face = self.cell_faces[entry];
        if before.is_none_or(|found| found.face != face) {
            let is_alone = self.alone.get_or(entry, || self.is_alone(cell, entry));
            *known = Known(Some(Found { cell: cell as u32, face, is_alone }));
        }
        self.surface(height_m, face)
    }

    /// Whether no other face of a cell is as high as one of it anywhere well inside that.
    fn is_alone(&self, cell: usize, entry: usize) -> bool {
        let face = &self.faces[self.cell_faces[entry] as usize];
        let Some(inside) = Outline::new(face, INSIDE_M) else { return false };
        let corners_m = self.corners_m(cell).map(|xy_m| xy_m.push(0.0));
        let heights_m = corners_m.map(|corner_m| face.height_m(corner_m));
        self.entries(cell).filter(|other| *other != entry).all(|other| {
            let other = &self.faces[self.cell_faces[other] as usize];
            let mut corners = corners_m.iter().zip(heights_m);
            corners.all(|(at, height_m)| other.height_m(*at) < height_m - LOWER_M)
                || Outline::new(other, 0.0).is_some_and(|outline| outline.is_apart_from(&inside))
        })
    }
}

impl Face {
    /// The height of its plane at a point, if that is well inside of all its borders.
    #[inline]
    fn height_inside_m(&self, point: Vec3) -> Option<f32> {
        let along = self.along(point.xy() - self.corner.xy());
        let [x, y] = self.across;
        let beyond = (0..4).map(|at| {
            let inside = self.outside[at] + INSIDE_M * (x[at].abs() + y[at].abs());
            along[at] >= inside
        });
        beyond.fold(true, |all, inside| all & inside).then_some(self.corner.z + along[3])
    }
}

/// The borders of a face, moved inwards, and where they meet.
struct Outline {
    /// Normals inwards.
    across: [Vector2<f64>; 3],
    /// Where the sides are along the normals, from the corner.
    outside: [f64; 3],
    corner_m: Vector2<f64>,
    corners_m: [Vector2<f64>; 3],
}

impl Outline {
    /// `None` where nothing is left.
    fn new(face: &Face, inwards_m: f32) -> Option<Self> {
        let corner_m = face.corner.xy().cast::<f64>();
        let across = [0, 1, 2].map(|edge| {
            Vector2::new(f64::from(face.across[0][edge]), f64::from(face.across[1][edge]))
        });
        let outside = [0, 1, 2].map(|edge| {
            f64::from(face.outside[edge]) + f64::from(inwards_m) * across[edge].abs().sum()
        });
        let mut corners_m = [corner_m; 3];
        for (first, corner) in corners_m.iter_mut().enumerate() {
            let (second, third) = ((first + 1) % 3, (first + 2) % 3);
            let (a, b) = (across[first], across[second]);
            let meet = Vector2::new(
                outside[first] * b.y - outside[second] * a.y,
                a.x * outside[second] - b.x * outside[first],
            ) / a.perp(&b);
            // Sides that do not meet are nowhere, and a border that was moved too far keeps it out.
            let is_left = across[third].dot(&meet) >= outside[third];
            if !is_left {
                return None;
            }
            *corner += meet;
        }
        Some(Self { across, outside, corner_m, corners_m })
    }

    /// Whether a side of one of both has the other one beyond it, whatever is rounded.
    fn is_apart_from(&self, other: &Self) -> bool {
        self.has_beyond_a_side(other) || other.has_beyond_a_side(self)
    }

    fn has_beyond_a_side(&self, other: &Self) -> bool {
        /// More than single precision makes of a place, and by its distance.
        const ROUNDING_M: f64 = 2.5e-4;
        const ROUNDING: f64 = 4.0e-6;
        (0..3).any(|side| {
            let across = self.across[side];
            other.corners_m.iter().all(|corner_m| {
                let from_corner = corner_m - self.corner_m;
                let more_m = ROUNDING_M + ROUNDING * from_corner.abs().sum();
                across.dot(&from_corner) + across.abs().sum() * more_m < self.outside[side]
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use schemas::SplitMix64;

    use super::*;

    fn between(rng: &mut SplitMix64, low: f32, high: f32) -> f32 {
        low + (high - low) * ((rng.next_u64() >> 40) as f32 / 16_777_216.0)
    }

    /// Roads of squares that join at their sides and cross each other, over land below.
    fn streets(rng: &mut SplitMix64, origin_m: f32) -> Vec<([Vec3; 3], f32)> {
        let mut triangles = Vec::new();
        let base = Vec3::new(origin_m, -origin_m, 0.0);
        let mut quad = |corners: [Vec3; 4], friction: f32| {
            let [a, b, c, d] = corners.map(|corner| corner + base);
            triangles.extend([([a, b, c], friction), ([a, c, d], friction)]);
        };
        let reach = [-60.0f32, 60.0].map(|x| [-60.0f32, 60.0].map(|y| Vec3::new(x, y, -0.05)));
        quad([reach[0][0], reach[1][0], reach[1][1], reach[0][1]], 0.5);
        for road in 0..6 {
            let (turn, rise) = (between(rng, -3.0, 3.0), between(rng, -0.1, 0.1));
            let (along, across) =
                (Vec3::new(turn.cos(), turn.sin(), rise), between(rng, -9.0, 9.0));
            let left = Vec3::new(-turn.sin(), turn.cos(), 0.0);
            let low = if road % 3 == 0 { 5.0 } else { 0.0 };
            let at = |step: u8, side: f32| {
                along * (4.0 * f32::from(step) - 40.0) + left * (across + side) + Vec3::z() * low
            };
            for step in 0..20 {
                for lane in [-3.5, 0.0] {
                    let corners = [(step, lane), (step + 1, lane), (step + 1, lane + 3.5)];
                    let [a, b, c] = corners.map(|(step, side)| at(step, side));
                    quad([a, b, c, at(step, lane + 3.5)], 1.0);
                }
            }
        }
        triangles
    }

    #[test]
    fn what_moves_on_finds_the_ground_that_a_search_finds() {
        let mut rng = SplitMix64::new(5);
        let (mut alone, mut all) = (0, 0);
        for origin_m in [0.0, 700.0, 40_000.0] {
            let ground = Ground::new(streets(&mut rng, origin_m));
            for _ in 0..300 {
                let mut known = Known::default();
                let [x, y] = [(); 2].map(|()| between(&mut rng, -45.0, 45.0));
                let (turn, high) = (between(&mut rng, -3.0, 3.0), between(&mut rng, 0.0, 7.0));
                let step_m = between(&mut rng, 0.0005, 0.2);
                let mut at = Vec3::new(origin_m + x, y - origin_m, high);
                for _ in 0..200 {
                    at += Vec3::new(turn.cos(), turn.sin(), 0.0) * step_m;
                    let found = ground.below_from(&mut known, at);
                    assert_eq!(found, ground.below(at), "{at:?}, {known:?}");
                    alone += u32::from(known.0.is_some_and(|found| found.is_alone));
                    all += 1;
                }
            }
        }
        assert!(alone * 2 > all && alone < all, "{alone} of {all}");
    }

    #[test]
    fn a_face_that_another_one_may_be_above_is_not_alone() {
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let lower = [at(-4.0, -4.0, 0.0), at(4.0, -4.0, 0.0), at(0.0, 4.0, 0.0)];
        for (above_m, is_alone) in [(0.0, false), (0.01, false), (-0.01, false), (-0.1, true)] {
            let upper = lower.map(|corner| corner * 0.5 + Vec3::z() * above_m);
            let ground = Ground::new([(lower, 1.0), (upper, 0.7)]);
            let mut known = Known::default();
            ground.below_from(&mut known, at(0.3, -1.2, 1.0));
            assert_eq!(known.0.map(|found| found.is_alone), Some(is_alone), "{above_m}");
        }
    }
}
