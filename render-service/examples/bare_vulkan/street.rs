//! The street as triangles, each of one colour.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use roads::mesh::Material;
use schemas::Frame;

/// A corner of a triangle in the world.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Corner {
    pub(crate) place_m: [f32; 3],
    pub(crate) colour: [u8; 4],
}

/// A colour that few other materials have.
fn colour_of(material: u32) -> [u8; 4] {
    let [r, g, b, _] = material.wrapping_add(1).wrapping_mul(0x9e37_79b1).to_be_bytes();
    [r, g, b, 255]
}

/// Corners, and the numbers of three for each triangle.
pub(crate) type Triangles = (Vec<Corner>, Vec<u32>);

/// All that stands.
pub(crate) fn town(map: &roads::Map) -> Triangles {
    let (mut corners, mut indices) = (Vec::new(), Vec::new());
    let mut numbers: BTreeMap<Material, u32> = BTreeMap::new();
    for surface in roads::mesh::render(map).surfaces {
        // Our walls have windows without triangles.
        if surface.material == Material::Window {
            continue;
        }
        let next = numbers.len() as u32;
        let colour = colour_of(*numbers.entry(surface.material).or_insert(next));
        let first = corners.len() as u32;
        corners
            .extend(surface.positions_m.iter().map(|place_m| Corner { place_m: *place_m, colour }));
        indices.extend(surface.indices.iter().flatten().map(|corner| first + corner));
    }
    (corners, indices)
}

/// All that is seen of a frame's actors, where they are.
pub(crate) fn bodies_of(frame: &Frame) -> Triangles {
    let (mut corners, mut indices) = (Vec::new(), Vec::new());
    for actor in &frame.actors {
        let limbs = schemas::skeleton::limbs(actor, frame.walker_pose(actor.id));
        let placed = bodies::place(actor, frame.type_of(actor), frame.sim_secs, &limbs);
        for part in placed.parts {
            let mesh = part.shape.mesh();
            let first = corners.len() as u32;
            corners.extend(mesh.vertices.iter().map(|vertex| {
                let [x, y, z] = vertex.position;
                let place = |[a, b, c, d]: [f32; 4]| a * x + b * y + c * z + d;
                let material = u32::from(vertex.normal_material[3] as u16 & 0xff);
                let place_m = part.instance.world_from_shape.map(place);
                Corner { place_m, colour: colour_of(64 + material) }
            }));
            indices.extend(mesh.indices.iter().map(|corner| first + corner));
        }
    }
    (corners, indices)
}
