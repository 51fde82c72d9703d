//! Triangles, and a builder that smooths what is round and keeps edges.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use nalgebra::ComplexField;
use schemas::Vec3;

use crate::material::Material;

/// One corner of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Metres in the world for a town, the shape's own frame for a shape.
    pub position: [f32; 3],
    /// Unit normal × 32767, then [`Material`] number + 256 × colour variant.
    pub normal_material: [i16; 4],
    /// Metres along and up a facade; unused elsewhere.
    pub facade_m: [f32; 2],
    /// A packed [`TagId`](schemas::TagId); 0 in shapes, whose instance says it.
    pub label: u32,
}

/// Indexed triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Three per triangle.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// The same shape with all corners of one cell of a grid drawn together: for far away and for
    /// shadows, where small triangles cost the most and show the least.
    pub fn coarse(&self, cell: f32) -> Self {
        let mut coarse = Self::default();
        let mut known: HashMap<([i32; 3], [i16; 4]), u32> = HashMap::new();
        let centre_of = self.centres(cell);
        let cell_of = |vertex: &Vertex| cell_of(vertex, cell);
        for corners in self.indices.chunks_exact(3) {
            let vertices: Vec<&Vertex> =
                corners.iter().filter_map(|index| self.vertices.get(*index as usize)).collect();
            let [a, b, c] = vertices.as_slice() else { continue };
            let cells = [cell_of(a), cell_of(b), cell_of(c)];
            if cells[0] == cells[1] || cells[1] == cells[2] || cells[2] == cells[0] {
                continue;
            }
            for (vertex, cell) in vertices.iter().zip(cells) {
                // Normals that differ by less than a sixth share a corner.
                let rough = vertex.normal_material.map(|part| part / 6_000);
                let key = [rough[0], rough[1], rough[2], vertex.normal_material[3]];
                let index = *known.entry((cell, key)).or_insert_with(|| {
                    let (sum, count) =
                        centre_of.get(&cell).copied().unwrap_or((Vec3::zeros(), 1.0));
                    coarse.vertices.push(Vertex { position: (sum / count).into(), ..**vertex });
                    coarse.vertices.len() as u32 - 1
                });
                coarse.indices.push(index);
            }
        }
        coarse
    }

    /// How far corners are moved along each axis, at most, when those of one cell are drawn
    /// together.
    pub fn coarse_error(&self, cell: f32) -> Vec3 {
        let centre_of = self.centres(cell);
        self.vertices.iter().fold(Vec3::zeros(), |most, vertex| {
            let place = Vec3::from(vertex.position);
            let centre = centre_of.get(&cell_of(vertex, cell)).map(|(sum, count)| sum / *count);
            most.sup(&(centre.unwrap_or(place) - place).abs())
        })
    }

    /// Sum and count of the corners in each cell.
    fn centres(&self, cell: f32) -> HashMap<[i32; 3], (Vec3, f32)> {
        let mut centre_of: HashMap<[i32; 3], (Vec3, f32)> = HashMap::new();
        for vertex in &self.vertices {
            let at = cell_of(vertex, cell);
            let (sum, count) = centre_of.entry(at).or_insert((Vec3::zeros(), 0.0));
            *sum += Vec3::from(vertex.position);
            *count += 1.0;
        }
        centre_of
    }
}

fn cell_of(vertex: &Vertex, cell: f32) -> [i32; 3] {
    vertex.position.map(|part| (part / cell).round() as i32)
}

/// Packs a unit normal and a material into a vertex's four small integers.
pub fn pack(normal: Vec3, material: Material, variant: u8) -> [i16; 4] {
    let scaled = normal.map(|part| (part.clamp(-1.0, 1.0) * 32_767.0).round() as i16);
    let number = i16::from(material as u8) + 256 * i16::from(variant & 0x7f);
    [scaled.x, scaled.y, scaled.z, number]
}

/// Collects triangles, then gives them normals.
#[derive(Debug, Default)]
pub(crate) struct MeshBuilder {
    triangles: Vec<([Vec3; 3], Material)>,
}

/// Faces that meet at a smaller angle than this (its cosine) look round.
const CREASE_COS: f32 = 0.80;

impl MeshBuilder {
    /// A triangle, counter-clockwise seen from outside.
    pub(crate) fn triangle(&mut self, corners: [Vec3; 3], material: Material) {
        self.triangles.push((corners, material));
    }

    /// A four-sided face, counter-clockwise seen from outside.
    pub(crate) fn quad(&mut self, [a, b, c, d]: [Vec3; 4], material: Material) {
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }

    /// A flat polygon that its centre sees whole, counter-clockwise seen from outside.
    pub(crate) fn fan(&mut self, ring: &[Vec3], material: Material) {
        let centre = ring.iter().sum::<Vec3>() / ring.len().max(1) as f32;
        for (at, corner) in ring.iter().enumerate() {
            if let Some(next) = ring.get((at + 1) % ring.len()) {
                self.triangle([centre, *corner, *next], material);
            }
        }
    }

    /// The skin between rings of equally many points, and a lid on both ends. Rings follow each
    /// other along an axis and run counter-clockwise seen against it.
    pub(crate) fn loft(&mut self, rings: &[Vec<Vec3>], material: Material) {
        for (ring, next) in rings.iter().zip(rings.iter().skip(1)) {
            self.band(ring, next, material);
        }
        if let (Some(first), Some(last)) = (rings.first(), rings.last()) {
            let reversed: Vec<Vec3> = first.iter().rev().copied().collect();
            self.fan(&reversed, material);
            self.fan(last, material);
        }
    }

    /// The skin between two rings, without lids.
    pub(crate) fn band(&mut self, ring: &[Vec3], next: &[Vec3], material: Material) {
        let count = ring.len().min(next.len());
        for at in 0..count {
            let after = (at + 1) % count;
            if let (Some(a), Some(b), Some(c), Some(d)) =
                (ring.get(at), ring.get(after), next.get(after), next.get(at))
            {
                self.quad([*a, *b, *c, *d], material);
            }
        }
    }

    /// A box with faces along the axes.
    pub(crate) fn cuboid(&mut self, min: Vec3, max: Vec3, material: Material) {
        let ring = |x: f32| {
            vec![
                Vec3::new(x, min.y, min.z),
                Vec3::new(x, max.y, min.z),
                Vec3::new(x, max.y, max.z),
                Vec3::new(x, min.y, max.z),
            ]
        };
        self.loft(&[ring(min.x), ring(max.x)], material);
    }

    /// Gives every corner the mean normal of the faces around it that are nearly coplanar.
    pub(crate) fn finish(self) -> Mesh {
        let faces: Vec<(Vec3, f32)> = self.triangles.iter().map(|(c, _)| normal_area(c)).collect();
        let mut around: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
        for (face, (corners, _)) in self.triangles.iter().enumerate() {
            for corner in corners {
                around.entry(quantised(corner)).or_default().push(face);
            }
        }
        let mut mesh = Mesh::default();
        let mut known: HashMap<([i32; 3], [i16; 4]), u32> = HashMap::new();
        for ((corners, material), (normal, area)) in self.triangles.iter().zip(&faces) {
            if *area <= 0.0 {
                continue;
            }
            for corner in corners {
                let place = quantised(corner);
                let smooth = smooth_normal(normal, around.get(&place), &faces);
                let normal_material = pack(smooth, *material, 0);
                let index = *known.entry((place, normal_material)).or_insert_with(|| {
                    let position = [corner.x, corner.y, corner.z];
                    let facade_m = [0.0; 2];
                    mesh.vertices.push(Vertex { position, normal_material, facade_m, label: 0 });
                    mesh.vertices.len() as u32 - 1
                });
                mesh.indices.push(index);
            }
        }
        mesh
    }
}

fn smooth_normal(own: &Vec3, around: Option<&Vec<usize>>, faces: &[(Vec3, f32)]) -> Vec3 {
    let neighbours = around.into_iter().flatten().filter_map(|face| faces.get(*face));
    let sum: Vec3 = neighbours
        .filter(|(normal, _)| normal.dot(own) > CREASE_COS)
        .map(|(normal, area)| normal * *area)
        .sum();
    sum.try_normalize(1e-12).unwrap_or(*own)
}

/// Unit normal and area; zero area for a degenerate triangle.
fn normal_area([a, b, c]: &[Vec3; 3]) -> (Vec3, f32) {
    let cross = (b - a).cross(&(c - a));
    let doubled = cross.norm();
    if doubled > 1e-9 { (cross / doubled, doubled / 2.0) } else { (Vec3::z(), 0.0) }
}

/// A position in tenths of a millimetre, or of a thousandth of a unit shape.
pub fn quantised(position: &Vec3) -> [i32; 3] {
    [position.x, position.y, position.z].map(|part| (part * 1e4).round() as i32)
}

/// Cosine and sine, the same on every machine.
pub(crate) fn turned(angle_rad: f32) -> [f32; 2] {
    let (sin, cos) = ComplexField::sin_cos(angle_rad);
    [cos, sin]
}

/// `count` points on an ellipse in the y-z plane at `x`, counter-clockwise seen from +x.
pub(crate) fn ellipse(centre: Vec3, radius_y: f32, radius_z: f32, count: usize) -> Vec<Vec3> {
    (0..count)
        .map(|at| {
            let angle = std::f32::consts::TAU * (at as f32 + 0.5) / count as f32;
            let [cos, sin] = turned(angle);
            centre + Vec3::new(0.0, radius_y * cos, radius_z * sin)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_outward(mesh: &Mesh) -> bool {
        mesh.vertices.iter().all(|vertex| {
            let outward: f32 = vertex
                .position
                .iter()
                .zip(&vertex.normal_material)
                .map(|(part, normal)| part * f32::from(*normal))
                .sum();
            outward > 0.0
        })
    }

    #[test]
    fn a_box_has_sharp_edges_and_outward_normals() {
        let mut builder = MeshBuilder::default();
        builder.cuboid(Vec3::repeat(-1.0), Vec3::repeat(1.0), Material::Prop);
        let mesh = builder.finish();
        assert!(is_outward(&mesh));
        // Every normal is along one axis: eight corners × three faces, and six lid centres at most.
        for vertex in &mesh.vertices {
            let along =
                vertex.normal_material.iter().take(3).filter(|part| part.abs() > 100).count();
            assert_eq!(along, 1, "{vertex:?}");
        }
    }

    #[test]
    fn a_tube_of_many_sides_is_smooth_around_and_sharp_at_its_lids() {
        let mut builder = MeshBuilder::default();
        let ring = |x: f32| ellipse(Vec3::new(x, 0.0, 0.0), 1.0, 1.0, 16);
        builder.loft(&[ring(-1.0), ring(1.0)], Material::Prop);
        let mesh = builder.finish();
        assert!(is_outward(&mesh));
        // 16 corners × 2 rings on the skin, as many on the lids, two lid centres.
        assert_eq!(mesh.vertices.len(), 16 * 4 + 2);
    }
}
