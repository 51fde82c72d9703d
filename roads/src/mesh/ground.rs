//! What wheels and bodies stand on.

use super::Material;
use super::strip::{borders, cuts};
use crate::Map;
use crate::kinds::LaneType;

/// Height of sidewalks above the road, in metres.
pub(super) const KERB_M: f64 = 0.15;

/// Triangles to stand on, counter-clockwise seen from above.
#[derive(Clone, Debug, Default)]
pub struct GroundMesh {
    /// Corners in metres.
    pub positions_m: Vec<[f32; 3]>,
    /// Corner indices, one triple per triangle.
    pub indices: Vec<[u32; 3]>,
    /// What each triangle is made of, in the order of `indices`.
    pub materials: Vec<Material>,
}

/// The ground of a map: roads, sidewalks with their kerbs, and the land around.
#[must_use]
pub fn ground(map: &Map) -> GroundMesh {
    let mut mesh = GroundMesh::default();
    for road in &map.model.roads {
        for section in &road.sections {
            let cuts = cuts(road, section);
            for lane in section.lanes.iter().filter(|lane| lane.id != 0) {
                let sidewalk = lane.lane_type == LaneType::Sidewalk;
                let (height_m, material) =
                    if sidewalk { (KERB_M, Material::Sidewalk) } else { (0.0, Material::Asphalt) };
                for pair in cuts.windows(2) {
                    let [from, to] = pair else { continue };
                    let [a, b] = borders(road, section, lane.id, *from, height_m);
                    let [c, d] = borders(road, section, lane.id, *to, height_m);
                    let quad = if lane.id > 0 { [a, c, d, b] } else { [b, d, c, a] };
                    mesh.push_quad(quad.map(|p| [p.x as f32, p.y as f32, p.z as f32]), material);
                }
            }
        }
    }
    mesh
}

impl GroundMesh {
    fn push_quad(&mut self, corners: [[f32; 3]; 4], material: Material) {
        let first = u32::try_from(self.positions_m.len()).unwrap_or(u32::MAX);
        self.positions_m.extend(corners);
        self.indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        self.materials.extend([material; 2]);
    }
}
