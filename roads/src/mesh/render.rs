//! What a camera sees of a static town.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::pavement::{Detail, pave};
use super::terrain::Land;
use super::{Material, Sink, building, deck, markings, plants};
use crate::Map;

/// Side of the square tiles into which surfaces are cut, in metres.
pub const TILE_M: f64 = 128.0;
/// How far the land goes on beyond the roads, in metres.
const MARGIN_M: f64 = 600.0;

/// Triangles of one material within one tile of the map.
#[derive(Clone, Debug)]
pub struct Surface {
    /// What they are made of.
    pub material: Material,
    /// Corners in metres.
    pub positions_m: Vec<[f32; 3]>,
    /// Unit normals, one per corner.
    pub normals: Vec<[f32; 3]>,
    /// Corner indices, counter-clockwise seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Of each triangle, the place in [`Map::scenery`] of the thing it is a part of.
    pub things: Vec<Option<u32>>,
    /// Smallest corner of the box around it, in metres.
    pub min_m: [f32; 3],
    /// Largest corner of the box around it, in metres.
    pub max_m: [f32; 3],
}

/// Everything a renderer draws of a static town.
#[derive(Clone, Debug, Default)]
pub struct TownMesh {
    /// One surface per tile of [`TILE_M`] and material, so that a renderer can leave out what is
    /// out of sight by its box. A face belongs to the tile of its first corner.
    ///
    /// **Order:** by tile, then material.
    pub surfaces: Vec<Surface>,
}

/// Builds the picture of a map.
#[must_use]
pub fn render(map: &Map) -> TownMesh {
    let mut tiles = Tiles::default();
    let land = Land::new(map, MARGIN_M);
    pave(map, land.as_ref(), Detail::Picture, &mut tiles);
    markings::paint(map, &mut tiles);
    building::raise(map.scenery(), &mut tiles);
    plants::grow(map.scenery(), &mut tiles);
    tiles.thing = None;
    if let Some(land) = &land {
        deck::support(map, land, &mut tiles);
        land.spread(&mut tiles);
    }
    TownMesh { surfaces: tiles.surfaces.into_values().collect() }
}

/// Sorts faces into surfaces.
#[derive(Default)]
pub(super) struct Tiles {
    surfaces: BTreeMap<([i32; 2], Material), Surface>,
    /// Place in the scenery of what the next faces are a part of.
    pub(super) thing: Option<u32>,
}

impl Tiles {
    /// A triangle whose corners have normals of their own.
    pub(super) fn smooth(
        &mut self,
        material: Material,
        corners: [Point3<f64>; 3],
        normals: [Vector3<f64>; 3],
    ) {
        let thing = self.thing;
        let surface = self.surface(material, &corners[0]);
        let first = surface.push(corners, normals);
        surface.indices.push([first, first + 1, first + 2]);
        surface.things.push(thing);
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "coordinates of a map are within a million metres"
    )]
    fn surface(&mut self, material: Material, corner: &Point3<f64>) -> &mut Surface {
        let tile = [corner.x, corner.y].map(|v| (v / TILE_M).floor() as i32);
        self.surfaces.entry((tile, material)).or_insert_with(|| Surface {
            material,
            positions_m: Vec::new(),
            normals: Vec::new(),
            indices: Vec::new(),
            things: Vec::new(),
            min_m: [f32::INFINITY; 3],
            max_m: [f32::NEG_INFINITY; 3],
        })
    }
}

impl Sink for Tiles {
    fn triangle(&mut self, material: Material, corners: [Point3<f64>; 3]) {
        let [a, b, c] = corners;
        self.smooth(material, corners, [normal(&a, &b, &c); 3]);
    }

    fn quad(&mut self, material: Material, corners: [Point3<f64>; 4]) {
        let [a, b, c, d] = corners;
        // The longer way round keeps the normal right when two corners coincide.
        let flat = if (b - a).norm_squared() > (d - c).norm_squared() {
            normal(&a, &b, &c)
        } else {
            normal(&a, &c, &d)
        };
        let thing = self.thing;
        let surface = self.surface(material, &a);
        let first = surface.push(corners, [flat; 4]);
        surface.indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        surface.things.extend([thing; 2]);
    }
}

impl Surface {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "single precision and 32-bit indices are what graphics cards take"
    )]
    fn push<const N: usize>(
        &mut self,
        corners: [Point3<f64>; N],
        normals: [Vector3<f64>; N],
    ) -> u32 {
        let first = self.positions_m.len() as u32;
        for (corner, normal) in corners.iter().zip(&normals) {
            let position = [corner.x as f32, corner.y as f32, corner.z as f32];
            for ((min, max), v) in self.min_m.iter_mut().zip(&mut self.max_m).zip(position) {
                (*min, *max) = (min.min(v), max.max(v));
            }
            self.positions_m.push(position);
            self.normals.push([normal.x as f32, normal.y as f32, normal.z as f32]);
        }
        first
    }
}

fn normal(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>) -> Vector3<f64> {
    (b - a).cross(&(c - a)).try_normalize(1e-12).unwrap_or_else(Vector3::z)
}
