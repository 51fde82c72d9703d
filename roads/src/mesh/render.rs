//! What a camera sees of a static town.

use std::collections::BTreeMap;

use super::Material;
use crate::Map;

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
    /// Smallest corner of the box around it, in metres.
    pub min_m: [f32; 3],
    /// Largest corner of the box around it, in metres.
    pub max_m: [f32; 3],
}

/// Everything a renderer draws of a static town.
#[derive(Clone, Debug, Default)]
pub struct TownMesh {
    /// One surface per material and tile of 64 m, so that a renderer can leave out what is out of
    /// sight by its box.
    pub surfaces: Vec<Surface>,
}

/// Builds the picture of a map.
#[must_use]
pub fn render(map: &Map) -> TownMesh {
    let ground = super::ground(map);
    let mut surfaces: BTreeMap<Material, Surface> = BTreeMap::new();
    for (triangle, material) in ground.indices.iter().zip(&ground.materials) {
        let surface = surfaces.entry(*material).or_insert_with(|| Surface {
            material: *material,
            positions_m: Vec::new(),
            normals: Vec::new(),
            indices: Vec::new(),
            min_m: [f32::INFINITY; 3],
            max_m: [f32::NEG_INFINITY; 3],
        });
        let first = u32::try_from(surface.positions_m.len()).unwrap_or(u32::MAX);
        for corner in triangle {
            if let Some(position) = ground.positions_m.get(*corner as usize) {
                surface.positions_m.push(*position);
                surface.normals.push([0.0, 0.0, 1.0]);
                for axis in 0..3 {
                    surface.min_m[axis] = surface.min_m[axis].min(position[axis]);
                    surface.max_m[axis] = surface.max_m[axis].max(position[axis]);
                }
            }
        }
        surface.indices.push([first, first + 1, first + 2]);
    }
    TownMesh { surfaces: surfaces.into_values().collect() }
}
