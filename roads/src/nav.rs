//! Where people walk: a mesh of convex polygons over sidewalks, crossings and the roads beside.
//!
//! [`NavMesh::new`] makes it from any map; `detour` writes it as the file that CARLA's client
//! library loads. Both serve the same polygons, so that walkers steered by a client and walkers of
//! our own go the same ways.
//!
//! Lanes are cut into flat pieces (`bands`), crossings are drawn out to the sidewalks
//! (`crossing`). Per storey (`storeys`) the borders of what is joined are triangulated
//! (`partition`, `outline`) and triangles joined to polygons (`convex`); heights come from
//! the pieces (`cover`).

mod bands;
mod convex;
mod cover;
mod crossing;
pub mod detour;
mod funnel;
mod outline;
mod partition;
mod path;
mod piece;
mod query;
mod storeys;
mod surface;
mod tree;

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3};

use crate::{Map, limits};
use convex::{Ring, edges};
use cover::Cover;
use piece::{Class, Weld, metres};
use surface::area_m2;
use tree::Tree;

/// Most corners of a polygon: what the client's format holds.
pub const CORNERS_MAX: usize = 6;

/// What someone on foot may expect on a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Area {
    /// No vehicles.
    Sidewalk,
    /// Vehicles stop, or should.
    Crosswalk,
    /// Vehicles drive, or stand.
    Road,
}

/// A convex polygon of the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    /// Three to [`CORNERS_MAX`] positions in [`NavMesh::vertices`], counter-clockwise seen from
    /// above.
    pub corners: Vec<u32>,
    /// For each edge, from the corner of the same position to the next, the polygon beyond it.
    pub neighbours: Vec<Option<u32>>,
    /// What it is part of.
    pub area: Area,
}

/// Why a map has no navigation mesh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NavError {
    /// The map's lanes bend or change more often than is allowed for.
    #[error("wanted at most {limit} flat pieces of walkable ground, found {found} and more")]
    TooManyPieces {
        /// Pieces cut before giving up.
        found: usize,
        /// [`limits::NAV_PIECES_MAX`].
        limit: usize,
    },
    /// The map's lanes lie on top of each other.
    #[error("wanted at most {limit} flat pieces of walkable ground at one place, found {found}")]
    TooDense {
        /// Pieces at the fullest place.
        found: usize,
        /// [`limits::NAV_PIECES_AT_PLACE_MAX`].
        limit: usize,
    },
    /// The map's lanes are wider or longer than any place on earth.
    #[error("wanted walkable ground over at most {limit} squares of land, found {found:.0}")]
    TooWide {
        /// Squares under the boxes of all pieces.
        found: f64,
        /// [`limits::NAV_SQUARES_MAX`].
        limit: f64,
    },
}

/// The polygons people walk on.
///
/// **Frame:** that of the map. Sidewalks are as high as those of [`crate::mesh::ground()`].
/// **Determinism:** the same map gives the same mesh.
#[derive(Debug, Default)]
pub struct NavMesh {
    vertices: Vec<Point3<f64>>,
    polygons: Vec<Polygon>,
    tree: Tree,
    /// Sidewalk polygons, each with the area in square metres up to and including it.
    sidewalks: Vec<(f64, u32)>,
}

impl NavMesh {
    /// The mesh of a map; empty when the map has no sidewalks.
    ///
    /// # Errors
    /// [`NavError`] for a map beyond all proportion.
    pub fn new(map: &Map) -> Result<Self, NavError> {
        let mut weld = Weld::default();
        bands::cut(map, &mut weld);
        for corners in map.crosswalks() {
            weld.add(Class::Crosswalk, u32::MAX, &crossing::drawn_out(&corners));
        }
        if weld.len() > limits::NAV_PIECES_MAX {
            let found = weld.len();
            return Err(NavError::TooManyPieces { found, limit: limits::NAV_PIECES_MAX });
        }
        let pieces = weld.into_pieces();
        let (found, limit) = (Cover::squares(&pieces), limits::NAV_SQUARES_MAX);
        if found > limit {
            return Err(NavError::TooWide { found, limit });
        }
        let cover = Cover::new(&pieces);
        let (found, limit) = (cover.fullest(), limits::NAV_PIECES_AT_PLACE_MAX);
        if found > limit {
            return Err(NavError::TooDense { found, limit });
        }
        let mut assembly = Assembly::default();
        for (storey, pieces) in storeys::split(&pieces, &cover).iter().enumerate() {
            let cover = Cover::new(pieces);
            let (places, faces) = partition::triangulate(pieces, &cover);
            assembly.add(storey, &places, &convex::join(&places, &faces), &cover);
        }
        Ok(assembly.finish())
    }

    /// Corners of the polygons, in metres.
    #[must_use]
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// The polygons.
    #[must_use]
    pub fn polygons(&self) -> &[Polygon] {
        &self.polygons
    }

    /// Whether there is nowhere to walk.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty()
    }

    /// The corners of a polygon in metres; none for a polygon of another mesh.
    #[must_use]
    pub fn outline(&self, polygon: u32) -> Vec<Point3<f64>> {
        let corners = self.polygons.get(polygon as usize).map_or(&[][..], |p| &p.corners);
        corners.iter().filter_map(|corner| self.vertices.get(*corner as usize).copied()).collect()
    }
}

/// Puts the polygons of all storeys together.
#[derive(Default)]
struct Assembly {
    vertices: Vec<Point3<f64>>,
    rings: Vec<Ring>,
    /// Vertices by place on the grid, with their storey.
    known: BTreeMap<[i64; 2], Vec<(usize, u32)>>,
}

/// Vertices of two storeys are one when their heights differ by less, in metres.
const SAME_HEIGHT_M: f64 = 0.5;

impl Assembly {
    fn add(&mut self, storey: usize, places: &[[f64; 2]], rings: &[Ring], cover: &Cover<'_>) {
        let mut vertex_of: BTreeMap<u32, u32> = BTreeMap::new();
        for ring in rings {
            let corners = ring.corners.iter().map(|corner| {
                *vertex_of.entry(*corner).or_insert_with(|| {
                    let place = places.get(*corner as usize).copied().unwrap_or_default();
                    self.vertex(storey, place, cover)
                })
            });
            let corners = corners.collect();
            self.rings.push(Ring { corners, ground: ring.ground });
        }
    }

    /// The vertex at a place in grid steps: that of another storey where roads of two meet.
    #[allow(clippy::cast_possible_truncation, reason = "there are fewer corners than 2³²")]
    fn vertex(&mut self, storey: usize, place: [f64; 2], cover: &Cover<'_>) -> u32 {
        let [x, y] = metres(place);
        let point = Point3::new(x, y, cover.height_m(Point2::new(x, y)));
        let known = self.known.entry(place.map(|v| v.round() as i64)).or_default();
        let meets = known.iter().find(|(other, vertex)| {
            let height_m = self.vertices.get(*vertex as usize).map_or(f64::INFINITY, |v| v.z);
            *other != storey && (height_m - point.z).abs() < SAME_HEIGHT_M
        });
        if let Some((_, vertex)) = meets {
            return *vertex;
        }
        let vertex = self.vertices.len() as u32;
        known.push((storey, vertex));
        self.vertices.push(point);
        vertex
    }

    fn finish(self) -> NavMesh {
        let mut owner: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for (index, ring) in (0..).zip(&self.rings) {
            for edge in edges(&ring.corners) {
                owner.entry(edge).or_insert(index);
            }
        }
        let polygons: Vec<Polygon> = self
            .rings
            .into_iter()
            .map(|ring| {
                let beyond = edges(&ring.corners).map(|(from, to)| owner.get(&(to, from)).copied());
                Polygon {
                    neighbours: beyond.collect(),
                    area: ring.ground.area,
                    corners: ring.corners,
                }
            })
            .collect();
        let mut mesh = NavMesh { vertices: self.vertices, polygons, ..NavMesh::default() };
        let outlines: Vec<Vec<Point3<f64>>> =
            (0..).take(mesh.polygons.len()).map(|polygon| mesh.outline(polygon)).collect();
        mesh.tree = Tree::new(outlines.iter().map(|corners| tree::bounds(corners)));
        let mut sum_m2 = 0.0;
        for (index, (polygon, corners)) in (0..).zip(mesh.polygons.iter().zip(&outlines)) {
            if polygon.area == Area::Sidewalk {
                sum_m2 += area_m2(corners);
                mesh.sidewalks.push((sum_m2, index));
            }
        }
        mesh
    }
}
