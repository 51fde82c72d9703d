//! The ground below what moves on: mostly the face of before, if no other face there can count.

use std::sync::atomic::{AtomicU32, Ordering};

use nalgebra::Vector2;
use schemas::Vec3;

use super::{EDGE_M, Face, Ground, Surface};

/// So far inside of its borders a face may be the only one.
const INSIDE_M: f32 = 8.0 * EDGE_M;
/// Parts along each side of a cell, in which faces may be alone.
const PARTS: usize = 4;

/// The face that was found last; saves time and decides nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Known(Option<Found>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    place: Place,
    /// In the lists of all cells.
    entry: u32,
    face: u32,
    is_alone: bool,
}

/// A part of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    cell: u32,
    /// Row by row.
    part: u8,
}

/// Which faces count alone in which parts, by their entries in the lists of all cells. Each is
/// looked into when something comes to it first.
#[derive(Debug, Default)]
pub(super) struct Alone(Vec<AtomicU32>);

impl Alone {
    pub(super) fn unknown(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU32::new(0)).collect())
    }

    /// The lower half of a word tells which parts are known, the upper one where it is alone.
    fn get_or(&self, entry: u32, part: u8, find: impl FnOnce() -> bool) -> bool {
        let Some(word) = self.0.get(entry as usize) else { return false };
        let (known, alone) = (1 << part, 1 << (PARTS * PARTS) << part);
        let before = word.load(Ordering::Relaxed);
        if before & known != 0 {
            return before & alone != 0;
        }
        let is_alone = find();
        word.fetch_or(if is_alone { known | alone } else { known }, Ordering::Relaxed);
        is_alone
    }
}

impl Ground {
    /// As [`below`](Self::below), for what was over the known face before and may be so still.
    ///
    /// - **Cost:** a few nanoseconds while it is.
    pub(crate) fn below_from(&self, known: &mut Known, point: Vec3) -> Surface {
        let Some(place) = self.place(point) else { return self.open_land };
        let still = known.0.and_then(|found| self.still(found, place));
        if let Some(found) = still.filter(|found| found.is_alone)
            && let Some(height_m) = self.faces[found.face as usize].height_inside_m(point)
            && height_m <= point.z
        {
            *known = Known(Some(found));
            return self.surface(height_m, found.face);
        }
        let highest = self.highest(place.cell as usize, point);
        let Some((height_m, entry)) = highest else { return self.open_land };
        *known = Known(Some(self.found(place, entry as u32)));
        self.surface(height_m, self.cell_faces[entry])
    }

    /// A face that was found before, in the place where something is now.
    #[inline]
    fn still(&self, before: Found, place: Place) -> Option<Found> {
        if before.place == place {
            return Some(before);
        }
        if before.place.cell == place.cell {
            return Some(self.found(place, before.entry));
        }
        let mut entries = self.entries(place.cell as usize);
        let entry = entries.find(|entry| self.cell_faces[*entry] == before.face)?;
        Some(self.found(place, entry as u32))
    }

    fn found(&self, place: Place, entry: u32) -> Found {
        let face = self.cell_faces[entry as usize];
        let is_alone =
            self.alone.get_or(entry, place.part, || self.is_alone(place, entry as usize));
        Found { place, entry, face, is_alone }
    }

    fn place(&self, point: Vec3) -> Option<Place> {
        let cells = self.cells(point);
        if !self.holds(cells) {
            return None;
        }
        let [column, row] = (cells * PARTS as f32).data.0[0].map(|at| at as usize % PARTS);
        Some(Place { cell: self.cell_at(cells) as u32, part: (row * PARTS + column) as u8 })
    }

    fn part_corners_m(&self, Place { cell, part }: Place) -> [Vector2<f32>; 4] {
        let (cell, part) = (cell as usize, usize::from(part));
        let cells = [cell % self.columns, cell / self.columns].map(|at| at as f32);
        let parts = [part % PARTS, part / PARTS].map(|at| at as f32 / PARTS as f32);
        self.square_m(Vector2::from(cells) + Vector2::from(parts), 1.0 / PARTS as f32)
    }

    /// Whether one face of a cell counts wherever something is well inside of it in a part of the
    /// cell: no other is higher there, and of those as high it is the first.
    fn is_alone(&self, place: Place, entry: usize) -> bool {
        let face = &self.faces[self.cell_faces[entry] as usize];
        let Some(inside) = Outline::new(face, INSIDE_M) else { return false };
        let corners_m = self.part_corners_m(place);
        self.entries(place.cell as usize).filter(|other| *other != entry).all(|at| {
            let other = &self.faces[self.cell_faces[at] as usize];
            !other.may_cover(&corners_m)
                || other.is_below(face, &corners_m)
                || other.yields_to(face, at > entry)
                || Outline::new(other, 0.0).is_some_and(|outline| outline.is_apart_from(&inside))
        })
    }
}

impl Face {
    /// Whether its plane is lower than another one between some points, whatever is rounded.
    fn is_below(&self, higher: &Self, corners_m: &[Vector2<f32>; 4]) -> bool {
        /// More than single precision makes of a height, and by how far away all is.
        const ROUNDING_M: f32 = 1.0e-3;
        const ROUNDING: f32 = 1.0e-6;
        let steep = [self, higher].map(|face| face.slope().abs().sum());
        corners_m.iter().all(|corner_m| {
            let far_m = [self, higher].map(|face| {
                corner_m.abs().sum()
                    + (corner_m - face.corner.xy()).abs().sum()
                    + face.corner.z.abs()
            });
            let rounded_m = far_m[0].max(far_m[1]) * ROUNDING * (1.0 + steep[0] + steep[1]);
            let at = corner_m.push(0.0);
            self.height_m(at) < higher.height_m(at) - ROUNDING_M - rounded_m
        })
    }

    /// Whether both are level and it is lower, or as high and later in the list.
    fn yields_to(&self, other: &Self, is_later: bool) -> bool {
        let are_level = [self, other].iter().all(|face| face.slope() == Vector2::zeros());
        let (own_m, other_m) = (self.corner.z, other.corner.z);
        are_level && (own_m < other_m || is_later && own_m == other_m)
    }

    fn slope(&self) -> Vector2<f32> {
        Vector2::new(self.across[0][3], self.across[1][3])
    }

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
        for road in 0..6u8 {
            let turn = between(rng, -3.0, 3.0);
            let rise = if road % 2 == 0 { 0.0 } else { between(rng, -0.1, 0.1) };
            let friction = 1.0 - 0.1 * f32::from(road);
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
                    quad([a, b, c, at(step, lane + 3.5)], friction);
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
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let below = [at(-4.0, -4.0), at(4.0, -4.0), at(0.0, 4.0)];
        let level = [(0.0, true), (0.0005, true), (-0.0005, true), (-0.1, true)];
        let sloped = [(0.0, false), (0.0005, false), (-0.0005, false), (-0.1, true)];
        for (slope, cases) in [(0.0, level), (0.1, sloped)] {
            for (above_m, is_alone) in cases {
                let raised = |corner: Vec3, z: f32| corner + Vec3::z() * (z + slope * corner.x);
                let first = below.map(|corner| raised(corner, 0.0));
                let second = below.map(|corner| raised(corner * 0.5, above_m));
                let ground = Ground::new([(first, 1.0), (second, 0.7)]);
                let mut known = Known::default();
                let point = Vec3::new(0.3, -1.2, 1.0);
                let found = ground.below_from(&mut known, point);
                assert_eq!(found, ground.below(point), "{slope}, {above_m}");
                let known = known.0.map(|found| found.is_alone);
                assert_eq!(known, Some(is_alone), "{slope}, {above_m}");
            }
        }
    }

    #[test]
    fn what_is_beside_does_not_matter_in_a_part_that_it_does_not_reach() {
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let wide = [at(-9.0, -9.0, 0.0), at(9.0, -9.0, 0.0), at(0.0, 9.0, 0.0)];
        let small = [at(0.1, 0.1, 0.01), at(0.3, 0.1, 0.01), at(0.1, 0.3, 0.01)];
        let ground = Ground::new([(wide, 1.0), (small, 0.7)]);
        let alone_at = |x: f32| {
            let mut known = Known::default();
            ground.below_from(&mut known, at(x, 0.6, 1.0));
            known.0.map(|found| found.is_alone)
        };
        // From -9 m on cells are 2 m wide, their parts half a metre.
        assert_eq!(alone_at(0.2), Some(true));
        assert_eq!(alone_at(0.7), Some(true));
        let mut known = Known::default();
        ground.below_from(&mut known, at(0.4, 0.4, 1.0));
        assert_eq!(known.0.map(|found| found.is_alone), Some(false));
    }
}
