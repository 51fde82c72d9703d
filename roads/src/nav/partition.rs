//! Cuts the ground of one storey into triangles that meet edge to edge.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::Solver;
use i_overlay::i_float::int::point::IntPoint;
use nalgebra::Point2;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Triangulation};

use super::Area;
use super::cover::{Cover, Covers};
use super::outline::split_at_corners;
use super::piece::{Class, GridPoint, Piece, grid_point, metres};

type Plane = ConstrainedDelaunayTriangulation<spade::Point2<f64>>;

/// Smaller spots and holes are left out, in square grid steps: 0.05 m².
const SPOT_MIN: u64 = 50_000;

/// What a triangle is part of. Triangles are joined only when all of it is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ground {
    pub(super) area: Area,
    /// Whether it climbs from the road onto the sidewalk.
    pub(super) is_kerb: bool,
}

/// A triangle, counter-clockwise seen from above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub(super) corners: [u32; 3],
    pub(super) ground: Ground,
}

/// Places in grid steps, and the triangles between them.
pub(super) fn triangulate(pieces: &[Piece], cover: &Cover<'_>) -> (Vec<[f64; 2]>, Vec<Face>) {
    let of = |class: Class| -> Vec<Vec<IntPoint<i32>>> {
        let own = pieces.iter().filter(|piece| piece.class == class);
        own.map(|piece| piece.corners.iter().map(|c| grid_point(c).into()).collect()).collect()
    };
    let sidewalks = outlines(&of(Class::Sidewalk), &[], OverlayRule::Subject);
    let roads = outlines(&of(Class::Road), &[], OverlayRule::Subject);
    let kerbs = outlines(&of(Class::Kerb), &[], OverlayRule::Subject);
    // Crossings end where sidewalks begin, so that none of their corners lies within one.
    let crossings = outlines(&of(Class::Crosswalk), &sidewalks, OverlayRule::Difference);
    let lines: Vec<Vec<GridPoint>> = [sidewalks, roads, kerbs, crossings]
        .into_iter()
        .flatten()
        .map(|line| line.into_iter().map(|point| [point.x, point.y]).collect())
        .collect();
    faces(&split_at_corners(&lines), cover)
}

/// The borders of the joint area of some contours, less that of others.
fn outlines(
    subject: &[Vec<IntPoint<i32>>],
    clip: &[Vec<IntPoint<i32>>],
    rule: OverlayRule,
) -> Vec<Vec<IntPoint<i32>>> {
    let options =
        IntOverlayOptions { min_output_area: SPOT_MIN, ..IntOverlayOptions::keep_all_points() };
    let mut overlay = Overlay::from_subj_and_clip_custom(subject, clip, options, Solver::default());
    overlay.overlay(rule, FillRule::NonZero).into_iter().flatten().collect()
}

fn faces(lines: &[Vec<GridPoint>], cover: &Cover<'_>) -> (Vec<[f64; 2]>, Vec<Face>) {
    let mut plane = Plane::new();
    let handles = insert_corners(lines, &mut plane);
    let handle = |corner: &GridPoint| handles.get(corner).copied();
    for line in lines {
        for (from, to) in line.iter().zip(line.iter().cycle().skip(1)) {
            if let (Some(from), Some(to)) = (handle(from), handle(to))
                && from != to
            {
                plane.add_constraint_and_split(from, to, |place| place);
            }
        }
    }
    let places = plane.vertices().map(|vertex| [vertex.position().x, vertex.position().y]);
    let places: Vec<[f64; 2]> = places.collect();
    let faces = plane.inner_faces().filter_map(|face| {
        let middle = face.center();
        let [x, y] = metres([middle.x, middle.y]);
        let ground = ground(cover.at(Point2::new(x, y)))?;
        let corners = face.vertices().map(|vertex| u32::try_from(vertex.index()).unwrap_or(0));
        Some(Face { corners, ground })
    });
    let faces = faces.collect();
    (places, faces)
}

/// Inserts the corners of all lines, without the lines.
///
/// First a few of them from all over the lines, then twice as many, and so on. One after another,
/// those of the second side of a long road would each turn over nearly all edges between the first
/// side and the second. Within a round they stay in the order of the lines, as the triangulation
/// looks for a place near the last one.
fn insert_corners(
    lines: &[Vec<GridPoint>],
    plane: &mut Plane,
) -> BTreeMap<GridPoint, FixedVertexHandle> {
    let mut handles = BTreeMap::new();
    let corners: Vec<&GridPoint> = lines.iter().flatten().collect();
    for round in (0..=corners.len().checked_ilog2().unwrap_or(0)).rev() {
        for corner in corners.iter().skip(1 << round).step_by(2 << round) {
            insert(corner, plane, &mut handles);
        }
    }
    corners.first().into_iter().for_each(|corner| insert(corner, plane, &mut handles));
    handles
}

fn insert(
    corner: &GridPoint,
    plane: &mut Plane,
    handles: &mut BTreeMap<GridPoint, FixedVertexHandle>,
) {
    if let Entry::Vacant(free) = handles.entry(*corner) {
        let [x, y] = corner.map(f64::from);
        // Grid points are whole numbers of moderate size, which the triangulation never refuses.
        if let Ok(handle) = plane.insert(spade::Point2::new(x, y)) {
            free.insert(handle);
        }
    }
}

/// What a place with such cover is: the road goes before the sidewalk where maps let both overlap.
fn ground(covers: Covers) -> Option<Ground> {
    let [road, sidewalk, crosswalk, kerb] =
        [Class::Road, Class::Sidewalk, Class::Crosswalk, Class::Kerb].map(|c| covers.has(c));
    let area = if road {
        if crosswalk { Area::Crosswalk } else { Area::Road }
    } else if sidewalk {
        Area::Sidewalk
    } else if crosswalk {
        Area::Crosswalk
    } else if kerb {
        Area::Road
    } else {
        return None;
    };
    Some(Ground { area, is_kerb: kerb && !road && !sidewalk })
}
