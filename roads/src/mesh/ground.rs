//! What wheels and bodies stand on.

use nalgebra::Point3;

use super::pavement::{Detail, pave};
use super::terrain::Land;
use super::{Material, Sink, deck};
use crate::{Map, Waypoint};

/// How far the ground goes on beyond the roads, in metres.
const MARGIN_M: f64 = 100.0;

/// Triangles to stand on, counter-clockwise seen from above or outside.
///
/// Faces overlap in junctions, where several connecting roads share the same plane. Houses, trees
/// and posts are not part of it: they are the boxes of [`Map::scenery`].
#[derive(Clone, Debug, Default)]
pub struct GroundMesh {
    /// Corners in metres.
    pub positions_m: Vec<[f32; 3]>,
    /// Corner indices, one triple per triangle.
    pub indices: Vec<[u32; 3]>,
    /// What each triangle is made of, in the order of `indices`.
    pub materials: Vec<Material>,
}

/// The ground of a map: roads, sidewalks with kerbs of 0.15 m, squares, and the land around.
#[must_use]
pub fn ground(map: &Map) -> GroundMesh {
    let mut mesh = GroundMesh::default();
    let land = Land::new(map, MARGIN_M);
    pave(map, land.as_ref(), Detail::Ground, &mut mesh);
    if let Some(land) = &land {
        land.spread(&mut mesh);
    }
    mesh
}

/// How much higher than a lane the height is, in metres, that the roads of an uneven junction have
/// in common, at a point across from a place on it; `None` elsewhere.
#[must_use]
pub fn above_lane_m(map: &Map, place: &Waypoint, at: &Point3<f64>) -> Option<f64> {
    let road = map.model.road(place.road).filter(|road| road.level.is_some())?;
    Some(road.surface_m(place.s, [at.x, at.y]) - road.elevation.value(place.s))
}

/// Undersides and sides of bridges: what is seen of them from below. No wheel stands on it.
#[must_use]
pub fn decks(map: &Map) -> GroundMesh {
    let mut mesh = GroundMesh::default();
    if let Some(land) = Land::new(map, MARGIN_M) {
        deck::support(map, &land, &mut mesh);
    }
    mesh
}

impl GroundMesh {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "single precision and 32-bit indices are what physics engines take"
    )]
    fn corners<const N: usize>(&mut self, corners: [Point3<f64>; N]) -> u32 {
        let first = self.positions_m.len() as u32;
        self.positions_m.extend(corners.map(|p| [p.x as f32, p.y as f32, p.z as f32]));
        first
    }
}

impl Sink for GroundMesh {
    fn triangle(&mut self, material: Material, corners: [Point3<f64>; 3]) {
        let first = self.corners(corners);
        self.indices.push([first, first + 1, first + 2]);
        self.materials.push(material);
    }

    fn quad(&mut self, material: Material, corners: [Point3<f64>; 4]) {
        let first = self.corners(corners);
        self.indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        self.materials.extend([material; 2]);
    }
}
