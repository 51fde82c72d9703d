//! Joins triangles to convex polygons.

use std::collections::BTreeMap;

use super::CORNERS_MAX;
use super::partition::{Face, Ground};

/// How far a corner may lie inside the line between its neighbours, in grid steps.
const FLAT_STEPS: f64 = 0.05;

/// A convex polygon, counter-clockwise seen from above.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    pub(super) corners: Vec<u32>,
    pub(super) ground: Ground,
}

/// Joins triangles of the same ground across their longest common edges first, as long as the
/// result is convex and has at most [`CORNERS_MAX`] corners. `places` are in grid steps.
pub(super) fn join(places: &[[f64; 2]], faces: &[Face]) -> Vec<Ring> {
    let mut rings: Vec<Option<Ring>> = faces
        .iter()
        .map(|face| Some(Ring { corners: face.corners.to_vec(), ground: face.ground }))
        .collect();
    let mut owner: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (index, face) in faces.iter().enumerate() {
        owner.extend(edges(&face.corners).map(|edge| (edge, index)));
    }
    for (from, to) in inner_edges(places, faces, &owner) {
        let (Some(&one), Some(&other)) = (owner.get(&(from, to)), owner.get(&(to, from))) else {
            continue;
        };
        let (Some(Some(a)), Some(Some(b))) = (rings.get(one), rings.get(other)) else { continue };
        let Some(corners) = joined(places, &a.corners, &b.corners, (from, to)) else { continue };
        let ground = a.ground;
        owner.extend(edges(&b.corners).map(|edge| (edge, one)));
        owner.remove(&(from, to));
        owner.remove(&(to, from));
        if let Some(ring) = rings.get_mut(one) {
            *ring = Some(Ring { corners, ground });
        }
        if let Some(ring) = rings.get_mut(other) {
            *ring = None;
        }
    }
    rings.into_iter().flatten().collect()
}

/// The directed edges of a ring.
pub(super) fn edges(corners: &[u32]) -> impl Iterator<Item = (u32, u32)> {
    let nexts = corners.iter().cycle().skip(1);
    corners.iter().copied().zip(nexts.copied())
}

/// Edges between two faces of the same ground, the longest first.
fn inner_edges(
    places: &[[f64; 2]],
    faces: &[Face],
    owner: &BTreeMap<(u32, u32), usize>,
) -> Vec<(u32, u32)> {
    let ground = |edge| owner.get(&edge).and_then(|index| faces.get(*index)).map(|f| f.ground);
    let mut inner: Vec<(u32, u32)> = owner
        .keys()
        .copied()
        .filter(|(from, to)| from < to && ground((*from, *to)) == ground((*to, *from)))
        .collect();
    let length2 = |edge: &(u32, u32)| {
        let [from, to] = [edge.0, edge.1].map(|index| place(places, index));
        (to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2)
    };
    inner.sort_by(|a, b| length2(b).total_cmp(&length2(a)).then(a.cmp(b)));
    inner
}

fn place(places: &[[f64; 2]], index: u32) -> [f64; 2] {
    places.get(index as usize).copied().unwrap_or_default()
}

/// One ring out of two with a common edge; `None` if that is no convex polygon of allowed size.
fn joined(
    places: &[[f64; 2]],
    one: &[u32],
    other: &[u32],
    (from, to): (u32, u32),
) -> Option<Vec<u32>> {
    let count = one.len() + other.len() - 2;
    if count > CORNERS_MAX {
        return None;
    }
    // Both start at the far end of the common edge, which runs opposite in the other ring.
    let around = |ring: &[u32], start: u32| -> Option<Vec<u32>> {
        let first = ring.iter().position(|corner| *corner == start)?;
        Some(ring.iter().cycle().skip(first).take(ring.len() - 1).copied().collect())
    };
    let mut corners = around(one, to)?;
    corners.extend(around(other, from)?);
    let mut sorted = corners.clone();
    sorted.sort_unstable();
    sorted.dedup();
    (sorted.len() == count && is_convex(places, &corners)).then_some(corners)
}

fn is_convex(places: &[[f64; 2]], corners: &[u32]) -> bool {
    let count = corners.len();
    (0..count).all(|k| {
        let at = |step: usize| corners.get((k + step) % count).map(|index| place(places, *index));
        let (Some(a), Some(b), Some(c)) = (at(0), at(1), at(2)) else { return false };
        let [ab, bc] = [[b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]];
        let turn = ab[0] * bc[1] - ab[1] * bc[0];
        let ahead = ab[0] * bc[0] + ab[1] * bc[1];
        let length = ab[0].hypot(ab[1]).max(bc[0].hypot(bc[1]));
        turn > 0.0 || (turn >= -FLAT_STEPS * length && ahead > 0.0)
    })
}
