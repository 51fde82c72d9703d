//! Triangles in the picture: where a way leaves them, and what they are joined to.

use crate::model::Model;
use crate::scene::Placed;
use crate::vector::{LANES, V3, add, affine, cross, dot, scale, sub};
use crate::view::Projection;

/// Planes whose nearness changes alike from one pixel to the next, but for this share of it, do not
/// meet there.
const MEETING: f32 = 1e-4;

/// So many triangles that are too thin to be seen may lie between two pixels.
const THIN_MAX: usize = 4;

/// A triangle in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// From the first corner to the second, and so on. The product with a place and 1 is positive
    /// on the inner side.
    sides: [V3; 3],
    /// The product with a place and 1 is how near it is there.
    pub(super) nearness: V3,
    pub(super) is_front: bool,
    /// Beyond each side, once somebody asked.
    pub(super) beyond: [Option<Beyond>; 3],
}

/// What a triangle shares a side with.
#[derive(Clone, Copy, Debug)]
pub(super) enum Beyond {
    /// Nothing, as far as its cluster tells, or what turns away.
    Nothing,
    /// This one of the same model.
    Triangle(u32),
}

impl Outline {
    /// Of a triangle of a placed model, as it is seen. Homogeneous, so that corners behind the
    /// viewer do not matter.
    pub(super) fn of(placed: &Placed<'_>, local: &Projection, triangle: u32) -> Option<Self> {
        let corners = placed.model.triangles.get(triangle as usize)?;
        let [centre_x, centre_y] = local.centre_px;
        let [a, b, c] = placed.model.corners_of(corners)?.map(|corner| {
            let [x, y, w] = [local.x, local.y, local.w].map(|row| affine(row, corner.position));
            [x + centre_x * w, y + centre_y * w, w]
        });
        let turn = dot(a, cross(b, c));
        let sides = [cross(a, b), cross(b, c), cross(c, a)];
        let sides = sides.map(|side| scale(side, turn.signum()));
        let [x, y, z] = sides;
        let nearness = scale(add(add(x, y), z), 1.0 / turn.abs());
        // Rows of a picture go down: what faces the viewer turns the other way.
        Some(Self { sides, nearness, is_front: turn < 0.0, beyond: [None; 3] })
    }

    /// By which side a way leaves it, and after which share; `None` where it ends inside.
    pub(super) fn leaves(&self, [from, to]: Way) -> Option<(usize, f32)> {
        let mut least = None;
        for (at, side) in self.sides.iter().enumerate() {
            let value = |[x, y]: [f32; 2]| dot(*side, [x, y, 1.0]);
            let (inside, outside) = (value(from).max(0.0), value(to));
            if outside < 0.0 {
                let share = inside / (inside - outside);
                if least.is_none_or(|(_, least)| share < least) {
                    least = Some((at, share));
                }
            }
        }
        least
    }

    /// After which share of a way, between these two, something else comes out of it.
    pub(super) fn meets(
        &self,
        other: Option<V3>,
        way: Way,
        (after, before): (f32, f32),
    ) -> Option<f32> {
        let apart = sub(self.nearness, other?);
        let [begin, end] = way.map(|[x, y]| dot(apart, [x, y, 1.0]));
        let [x, y] = way[1];
        let is_steep = begin - end > MEETING * dot(self.nearness, [x, y, 1.0]).abs();
        let share = begin / (begin - end);
        (is_steep && share > after && share < before).then_some(share)
    }
}

/// From the middle of one pixel to that of another one.
pub(super) type Way = [[f32; 2]; 2];

/// The share of a way, between what one triangle shows and something else of this nearness, at
/// which those end that are joined to the first one. It goes on to the next one after a share. What
/// is in between is too thin to be seen.
pub(super) fn joined_end(
    placed: &Placed<'_>,
    local: &Projection,
    (mut triangle, mut share): (u32, f32),
    other: Option<V3>,
    way: Way,
) -> f32 {
    for _ in 0..THIN_MAX {
        let next = Outline::of(placed, local, triangle);
        let Some(next) = next.filter(|next| next.is_front) else { break };
        let leaves = next.leaves(way);
        let before = leaves.map_or(1.0, |(_, ends)| ends);
        if let Some(met) = next.meets(other, way, (share, before)) {
            return met;
        }
        let Some((side, ends)) = leaves.filter(|(_, ends)| *ends > share) else { break };
        share = ends;
        let Beyond::Triangle(beyond) = across(placed.model, triangle, side) else { break };
        triangle = beyond;
    }
    share
}

/// What shares a side with a triangle, of those in its cluster.
pub(super) fn across(model: &Model, triangle: u32, side: usize) -> Beyond {
    let at = triangle as usize;
    let before = model.clusters.partition_point(|cluster| cluster.triangles.end <= at);
    let Some(cluster) = model.clusters.get(before) else { return Beyond::Nothing };
    let Some(own) = model.local.get(at / LANES) else { return Beyond::Nothing };
    let corner = |number: usize| own[number % 3][at % LANES];
    let (first, second) = (corner(side), corner(side + 1));
    let eights = cluster.triangles.start / LANES..cluster.triangles.end.div_ceil(LANES);
    for (eight, [a, b, c]) in eights.clone().zip(model.local.get(eights).unwrap_or_default()) {
        // The other one goes along the side the other way.
        let shares = |lane: usize| {
            let along =
                |from: &[u8; LANES], to: &[u8; LANES]| (from[lane] == second) & (to[lane] == first);
            along(a, b) | along(b, c) | along(c, a)
        };
        let found: [bool; LANES] = std::array::from_fn(shares);
        if let Some(lane) = found.iter().position(|is_it| *is_it) {
            return Beyond::Triangle((eight * LANES + lane) as u32);
        }
    }
    Beyond::Nothing
}
