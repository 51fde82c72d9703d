//! Blocks that stand for round parts of people far away.

use std::collections::BTreeMap;

use bodies::{Mesh, Vertex};
use schemas::Vec3;

/// What a block spans of what its shape spans: it covers about as many pixels as a round shape.
const PART: f32 = 0.9;

/// A block in the place of a shape, and how far it is off along each axis, at most, in the shape's
/// own unit. Its faces are of what most of the shape that faces their way is of.
pub(crate) fn block_of(fine: &Mesh) -> (Mesh, Vec3) {
    let places: Vec<Vec3> = fine.vertices.iter().map(|vertex| vertex.position.into()).collect();
    let low = places.iter().fold(Vec3::repeat(f32::INFINITY), |low, place| low.inf(place));
    let high = places.iter().fold(Vec3::repeat(f32::NEG_INFINITY), |high, place| high.sup(place));
    let (centre, half) = ((low + high) / 2.0, (high - low) * (PART / 2.0));
    let looks = Looks::of(fine);
    let mut mesh = Mesh::default();
    let mut error = Vec3::zeros();
    for (axis, side) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
        let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut normal_material = [0, 0, 0, looks.facing(axis, side)];
        normal_material[axis] = (side * 32_767.0) as i16;
        let first = mesh.vertices.len() as u32;
        for (across, above) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let mut corner = Vec3::zeros();
            corner[axis] = side;
            corner[right] = across * side;
            corner[up] = above;
            let place = centre + corner.component_mul(&half);
            error = error.sup(&off(&place, &places));
            let position = place.into();
            mesh.vertices.push(Vertex { position, normal_material, facade_m: [0.0; 2], label: 0 });
        }
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    let error = places
        .iter()
        .fold(error, |error, place| error.sup(&from_surface(&(place - centre).abs(), &half)));
    (mesh, error)
}

/// From a place to the nearest of others, along each axis.
fn off(place: &Vec3, others: &[Vec3]) -> Vec3 {
    let ways = others.iter().map(|other| (other - place).abs());
    ways.min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared())).unwrap_or_default()
}

/// From a place to the surface of a block around the origin, along each axis; places in one
/// eighth of space stand for all.
fn from_surface(place: &Vec3, half: &Vec3) -> Vec3 {
    let out = place - half;
    if out.max() > 0.0 {
        return out.sup(&Vec3::zeros());
    }
    let mut way = Vec3::zeros();
    let nearest = out.imax();
    way[nearest] = -out[nearest];
    way
}

/// What the triangles of a shape are of, by the way they face.
struct Looks {
    /// Areas by material and variant, for each axis both ways, then for all.
    areas: [BTreeMap<i16, f32>; 7],
}

impl Looks {
    fn of(mesh: &Mesh) -> Self {
        let mut areas: [BTreeMap<i16, f32>; 7] = Default::default();
        for corners in mesh.indices.as_chunks::<3>().0 {
            let [Some(a), Some(b), Some(c)] =
                corners.map(|corner| mesh.vertices.get(corner as usize))
            else {
                continue;
            };
            let place = |vertex: &Vertex| Vec3::from(vertex.position);
            let normal = (place(b) - place(a)).cross(&(place(c) - place(a)));
            let axis = normal.iamax();
            let [.., number] = a.normal_material;
            for way in [way_of(axis, normal[axis]), 6] {
                *areas[way].entry(number).or_default() += normal.norm();
            }
        }
        Self { areas }
    }

    /// Material and variant of most of what faces along an axis.
    fn facing(&self, axis: usize, side: f32) -> i16 {
        let most = |way: usize| {
            let areas = self.areas[way].iter();
            areas.max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(number, _)| *number)
        };
        most(way_of(axis, side)).or_else(|| most(6)).unwrap_or_default()
    }
}

fn way_of(axis: usize, side: f32) -> usize {
    2 * axis + usize::from(side > 0.0)
}

#[cfg(test)]
mod tests {
    use bodies::Shape;

    use super::*;

    /// Goal: a block covers what its shape covers, and the error that is told is one. Method: ends
    /// of both along each axis, and from each corner of the one the way to the other.
    #[test]
    fn a_block_is_as_large_as_its_shape_and_off_by_no_more_than_it_says() {
        for shape in [Shape::Torso, Shape::Head, Shape::Leg, Shape::Arm] {
            let fine = shape.mesh();
            let (block, error) = block_of(&fine);
            assert_eq!(block.indices.len(), 36, "{shape:?}");
            for axis in 0..3 {
                let ends = |mesh: &Mesh| {
                    let parts = mesh.vertices.iter().map(|vertex| vertex.position[axis]);
                    parts.fold((f32::MAX, f32::MIN), |(low, high), part| {
                        (low.min(part), high.max(part))
                    })
                };
                let ((low, high), (block_low, block_high)) = (ends(&fine), ends(&block));
                assert!(block_low - low <= error[axis] + 1e-6, "{shape:?} {axis}");
                assert!(high - block_high <= error[axis] + 1e-6, "{shape:?} {axis}");
                let part = (block_high - block_low) / (high - low);
                assert!((part - PART).abs() < 1e-3, "{shape:?} {axis}: {part}");
                assert!(error[axis] < high - low, "{shape:?} {axis}: {error}");
            }
        }
    }

    #[test]
    fn the_top_of_a_head_is_hair_and_its_front_is_not() {
        let (block, _) = block_of(&Shape::Head.mesh());
        let of = |normal: [i16; 3]| {
            let is_that = |vertex: &&Vertex| vertex.normal_material.starts_with(&normal);
            block.vertices.iter().find(is_that).map(|vertex| vertex.normal_material[3])
        };
        assert_ne!(of([0, 0, 32_767]), of([32_767, 0, 0]));
    }

    #[test]
    fn faces_are_counter_clockwise_seen_from_outside() {
        let (block, _) = block_of(&Shape::Leg.mesh());
        for corners in block.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|at| Vec3::from(block.vertices[at as usize].position));
            let [x, y, z, _] = block.vertices[corners[0] as usize].normal_material.map(f32::from);
            assert!((b - a).cross(&(c - a)).dot(&Vec3::new(x, y, z)) > 0.0);
        }
    }
}
