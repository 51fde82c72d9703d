//! The static geometry of one map, square by square.

use std::collections::BTreeMap;
use std::ops::Range;

use bodies::{Material, Vertex, pack};
use schemas::Vec3;

use super::buildings::Buildings;
use super::coat::ThingBoxes;
use super::facade::facade_coordinates;
use super::foliage::Crown;
use super::instance::signal::Signals;
use super::instance::street_lamp::StreetLamps;
use super::material::Family;

/// Side of a square, in metres.
const TILE_M: f32 = 48.0;

/// Triangles of one material.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Of all of them.
    pub material: Material,
    /// For walls; unused elsewhere.
    pub wall: WallKind,
    /// Corners in the world, in metres.
    pub positions_m: Vec<Vec3>,
    /// Unit normals, one per corner.
    pub normals: Vec<Vec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Of each corner, a packed [`TagId`](schemas::TagId); a corner without one has the tag of the
    /// material.
    pub labels: Vec<u32>,
}

/// What a wall is built of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum WallKind {
    /// Plaster in one of several colours.
    #[default]
    Plaster,
    /// Bricks.
    Brick,
    /// Bare concrete.
    Concrete,
}

impl Surface {
    /// A surface without triangles.
    pub fn empty(material: Material, wall: WallKind) -> Self {
        Self {
            material,
            wall,
            positions_m: Vec::new(),
            normals: Vec::new(),
            triangles: Vec::new(),
            labels: Vec::new(),
        }
    }
}

/// The static geometry of one map, ready for upload.
///
/// **Frame:** world. **Determinism:** equal surfaces give equal scenes.
#[derive(Debug)]
pub struct TownScene {
    pub(crate) digest: String,
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) indices: Vec<u32>,
    pub(crate) tiles: Vec<Tile>,
    pub(crate) signals: Signals,
    pub(crate) street_lamps: StreetLamps,
    /// Of its trees; not among the triangles.
    pub(crate) crowns: Vec<Crown>,
    /// On which textures are laid.
    pub(crate) boxes: ThingBoxes,
    pub(crate) buildings: Buildings,
}

/// The indices of one square of a town; a family that it lacks has an empty range.
pub(crate) type Tile = [(Family, Range<u32>); 3];

type TileKey = (i32, i32);

impl TownScene {
    /// Cuts surfaces into tiles. Triangles with a missing corner or a position that is no number
    /// are left out.
    pub fn new(digest: impl Into<String>, surfaces: &[Surface]) -> Self {
        let mut scene = Self {
            digest: digest.into(),
            vertices: Vec::new(),
            indices: Vec::new(),
            tiles: Vec::new(),
            signals: Signals::default(),
            street_lamps: StreetLamps::default(),
            crowns: Vec::new(),
            boxes: ThingBoxes::default(),
            buildings: Buildings::default(),
        };
        let mut of_tile: BTreeMap<TileKey, BTreeMap<Family, Vec<u32>>> = BTreeMap::new();
        for surface in surfaces {
            let first = scene.vertices.len() as u32;
            scene.push_vertices(surface);
            let family = Family::of(surface.material);
            for triangle in &surface.triangles {
                let Some(key) = tile_of(surface, triangle) else { continue };
                let indices = of_tile.entry(key).or_default().entry(family).or_default();
                indices.extend(triangle.iter().map(|corner| first + corner));
            }
        }
        for families in of_tile.into_values() {
            scene.push_tile(families);
        }
        scene
    }

    /// Of the map's text.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// How many triangles, but for those of the crowns of its trees.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    fn push_vertices(&mut self, surface: &Surface) {
        let facades = (surface.material == Material::Wall).then(|| facade_coordinates(surface));
        let of_material = u32::from(surface.material.tag().number());
        for (at, position) in surface.positions_m.iter().enumerate() {
            let normal = surface.normals.get(at).copied().unwrap_or_else(Vec3::z);
            let facade =
                facades.as_ref().and_then(|facades| facades.get(at)).copied().unwrap_or_default();
            self.vertices.push(Vertex {
                position: [position.x, position.y, position.z],
                normal_material: pack(normal, surface.material, facade.variant),
                facade_m: facade.along_up_m,
                label: surface.labels.get(at).copied().unwrap_or(of_material),
            });
        }
    }

    fn push_tile(&mut self, mut families: BTreeMap<Family, Vec<u32>>) {
        let tile = Family::ALL.map(|family| {
            let start = self.indices.len() as u32;
            self.indices.extend(families.remove(&family).unwrap_or_default());
            (family, start..self.indices.len() as u32)
        });
        self.tiles.push(tile);
    }
}

fn tile_of(surface: &Surface, triangle: &[u32; 3]) -> Option<TileKey> {
    let mut centre = Vec3::zeros();
    for corner in triangle {
        centre += surface.positions_m.get(*corner as usize)? / 3.0;
    }
    let finite = centre.iter().all(|part| part.is_finite());
    finite.then(|| ((centre.x / TILE_M).floor() as i32, (centre.y / TILE_M).floor() as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(material: Material, corners: [[f32; 3]; 3]) -> Surface {
        Surface {
            material,
            wall: WallKind::Plaster,
            positions_m: corners.map(Vec3::from).to_vec(),
            normals: vec![Vec3::z(); 3],
            triangles: vec![[0, 1, 2]],
            labels: Vec::new(),
        }
    }

    #[test]
    fn triangles_far_apart_lie_in_tiles_of_their_own() {
        let near = surface(Material::Asphalt, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let far =
            surface(Material::Wall, [[500.0, 0.0, 0.0], [501.0, 0.0, 0.0], [500.0, 0.0, 9.0]]);
        let scene = TownScene::new("d", &[near, far]);
        assert_eq!(scene.triangle_count(), 2);
        assert_eq!(scene.tiles.len(), 2);
    }

    #[test]
    fn broken_triangles_are_left_out() {
        let mut broken = surface(Material::Grass, [[f32::NAN, 0.0, 0.0]; 3]);
        broken.triangles.push([0, 1, 7]);
        assert_eq!(TownScene::new("d", &[broken]).triangle_count(), 0);
    }
}
