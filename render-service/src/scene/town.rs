//! The static geometry of one map, cut into tiles that a camera can skip.

use std::collections::BTreeMap;
use std::ops::Range;

use bodies::{Material, Vertex, pack};
use schemas::{HiddenScenery, TagId, Vec3};

use super::facade::facade_coordinates;
use super::foliage::FarCrown;
use super::instance::signal::Signals;
use super::instance::street_lamp::StreetLamps;
use super::material::Family;

/// Side of a tile, in metres: small enough to skip most of a town, large enough for few draw calls.
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
    /// In place of crowns whose triangles are in the tiles.
    pub(crate) far_crowns: Vec<FarCrown>,
}

/// One square of a town.
#[derive(Debug)]
pub(crate) struct Tile {
    pub(crate) min_m: Vec3,
    pub(crate) max_m: Vec3,
    /// Ranges of the index buffer; a family that the tile lacks has an empty one.
    pub(crate) indices_of: [(Family, Range<u32>); 3],
    /// Places of things of the scenery and their indices, in the order of the indices; one thing
    /// may have several entries.
    things: Vec<(u32, Range<u32>)>,
}

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
            far_crowns: Vec::new(),
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

    /// How many triangles.
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
        let mut min_m = Vec3::repeat(f32::INFINITY);
        let mut max_m = Vec3::repeat(f32::NEG_INFINITY);
        let mut things: Vec<(u32, Range<u32>)> = Vec::new();
        let indices_of = Family::ALL.map(|family| {
            let start = self.indices.len() as u32;
            for index in families.remove(&family).unwrap_or_default() {
                if let Some(vertex) = self.vertices.get(index as usize) {
                    let position = Vec3::from(vertex.position);
                    min_m = min_m.inf(&position);
                    max_m = max_m.sup(&position);
                    note_thing(&mut things, vertex.label, self.indices.len() as u32);
                }
                self.indices.push(index);
            }
            (family, start..self.indices.len() as u32)
        });
        self.tiles.push(Tile { min_m, max_m, indices_of, things });
    }
}

/// Adds an index to the entry of its corner's thing, which all corners of a triangle share.
fn note_thing(things: &mut Vec<(u32, Range<u32>)>, label: u32, at: u32) {
    let Some(place) = TagId::place_of(label) else { return };
    match things.last_mut() {
        Some((last, range)) if *last == place && range.end == at => range.end = at + 1,
        _ => things.push((place, at..at + 1)),
    }
}

impl Tile {
    /// Distance from a point to the tile's box, squared.
    pub(crate) fn distance_squared(&self, point_m: &Vec3) -> f32 {
        let outside = (self.min_m - point_m).sup(&(point_m - self.max_m)).sup(&Vec3::zeros());
        outside.norm_squared()
    }

    /// Visits the parts of one of its ranges of indices that are not hidden, in order.
    pub(crate) fn shown(
        &self,
        range: &Range<u32>,
        hidden: &HiddenScenery,
        mut visit: impl FnMut(Range<u32>),
    ) {
        let mut start = range.start;
        if !hidden.is_none() {
            let first = self.things.partition_point(|(_, part)| part.start < range.start);
            let things =
                self.things.iter().skip(first).take_while(|(_, part)| part.end <= range.end);
            for (_, part) in things.filter(|(place, _)| hidden.contains(*place)) {
                if start < part.start {
                    visit(start..part.start);
                }
                start = part.end;
            }
        }
        if start < range.end {
            visit(start..range.end);
        }
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
    use schemas::SemanticTag;

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
        assert_eq!(scene.tiles[1].min_m.x, 500.0);
        assert_eq!(scene.tiles[1].max_m.z, 9.0);
    }

    #[test]
    fn hidden_things_leave_gaps_in_the_ranges_of_their_tile() {
        let mut walls = Surface::empty(Material::Wall, WallKind::Plaster);
        for (at, place) in [Some(4), Some(7), None, Some(4), Some(9)].into_iter().enumerate() {
            let first = walls.positions_m.len() as u32;
            walls.positions_m.extend(
                [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]]
                    .map(|[x, y, z]: [f32; 3]| Vec3::new(x, y + at as f32, z)),
            );
            walls.normals.extend([Vec3::y(); 3]);
            walls.triangles.push([first, first + 1, first + 2]);
            let label = place.map_or(3, |place| TagId::of_scenery(SemanticTag::Buildings, place));
            walls.labels.extend([label; 3]);
        }
        let scene = TownScene::new("d", &[walls]);
        let tile = &scene.tiles[0];
        let (_, all) = tile.indices_of.iter().find(|(_, range)| !range.is_empty()).unwrap();
        let shown = |places: &[u32]| {
            let mut hidden = HiddenScenery::default();
            places.iter().for_each(|place| hidden.set(*place, true));
            let mut shown = Vec::new();
            tile.shown(all, &hidden, |part| shown.push([part.start, part.end]));
            shown
        };
        assert_eq!(shown(&[]), [[0, 15]]);
        assert_eq!(shown(&[5]), [[0, 15]]);
        assert_eq!(shown(&[4]), [[3, 9], [12, 15]]);
        assert_eq!(shown(&[4, 7]), [[6, 9], [12, 15]]);
        assert_eq!(shown(&[9]), [[0, 12]]);
        assert_eq!(shown(&[4, 7, 9]), [[6, 9]]);
    }

    #[test]
    fn broken_triangles_are_left_out() {
        let mut broken = surface(Material::Grass, [[f32::NAN, 0.0, 0.0]; 3]);
        broken.triangles.push([0, 1, 7]);
        assert_eq!(TownScene::new("d", &[broken]).triangle_count(), 0);
    }
}
