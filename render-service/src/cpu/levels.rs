//! Shapes as models, each at several levels of detail.

use std::sync::LazyLock;

use bodies::{Mesh, Shape, Vertex};
use raster::{Corner, Model};
use schemas::Vec3;

/// Sides of the cells in which corners are drawn together, as parts of a shape's coarse cell.
const CELLS: [f32; 4] = [0.5, 1.0, 2.0, 3.5];
/// A level is worth its memory if it has fewer triangles than this part of the one before.
const WORTH_IT: f32 = 0.8;

/// One shape at one level of detail.
pub(crate) struct ShapeLevel {
    pub(crate) model: Model,
    /// How far it is off along each axis, at most, in the shape's own unit.
    error: Vec3,
    /// Half of what it spans along each axis.
    half: Vec3,
}

/// Levels of every shape at the place of its number, fine ones first.
static LEVELS: LazyLock<Vec<Vec<ShapeLevel>>> =
    LazyLock::new(|| Shape::ALL.iter().map(|shape| levels_of(*shape)).collect());

/// The coarsest level of a shape whose corners are off by no more than `error_m` in the world, if
/// its axes are stretched like this; `None` if it is within a ball of `least_m`.
pub(crate) fn level_of(
    shape: Shape,
    stretch: Vec3,
    [error_m, least_m]: [f32; 2],
) -> Option<&'static Model> {
    let levels = LEVELS.get(shape as usize)?;
    if levels.first()?.half.norm() * stretch.max() < least_m {
        return None;
    }
    let is_good = |level: &&ShapeLevel| level.error.component_mul(&stretch).norm() <= error_m;
    let level = levels.iter().rev().find(is_good).or_else(|| levels.first())?;
    Some(&level.model)
}

/// Builds all levels now, not with the first picture.
pub(crate) fn prepare() {
    LazyLock::force(&LEVELS);
}

fn levels_of(shape: Shape) -> Vec<ShapeLevel> {
    let fine = shape.mesh();
    let mut count = fine.indices.len();
    let level = |mesh: &Mesh, error: Vec3| {
        let half = [0, 1, 2].map(|axis| span(mesh, axis) / 2.0);
        ShapeLevel { model: model_of(mesh), error, half: half.into() }
    };
    let mut levels = vec![level(&fine, Vec3::zeros())];
    for part in CELLS {
        let cell = part * shape.coarse_cell();
        let mesh = fine.coarse(cell);
        // A shape that has lost its height, width or length is not that shape any more.
        let is_there = (0..3).all(|axis| span(&mesh, axis) > 0.6 * span(&fine, axis));
        if is_there && (mesh.indices.len() as f32) < WORTH_IT * count as f32 {
            count = mesh.indices.len();
            levels.push(level(&mesh, fine.coarse_error(cell)));
        }
    }
    levels
}

fn span(mesh: &Mesh, axis: usize) -> f32 {
    let parts = mesh.vertices.iter().filter_map(|vertex| vertex.position.get(axis));
    let (low, high) = parts.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), part| {
        (low.min(*part), high.max(*part))
    });
    high - low
}

fn model_of(mesh: &Mesh) -> Model {
    let corners = mesh.vertices.iter().map(corner_of).collect();
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    Model::new(corners, triangles, &[])
}

/// A corner as the rasteriser reads it.
pub(crate) fn corner_of(vertex: &Vertex) -> Corner {
    let [x, y, z, number] = vertex.normal_material;
    let normal = [x, y, z].map(|part| f32::from(part) / 32_767.0);
    let length = normal.iter().map(|part| part * part).sum::<f32>().sqrt().max(1e-6);
    Corner {
        position: vertex.position,
        normal: normal.map(|part| part / length),
        facade_m: vertex.facade_m,
        label: vertex.label,
        material: (number & 0xff) as u8,
        variant: (number >> 8) as u8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_level_of_a_shape_has_at_most_half_its_triangles() {
        let of = |shape: Shape, error_m: f32| {
            level_of(shape, Vec3::new(2.4, 1.0, 0.74), [error_m, 0.0]).unwrap().triangle_count()
        };
        for shape in [Shape::Sedan, Shape::Bus, Shape::Torso, Shape::Leg, Shape::Wheel] {
            let (fine, middle, far) = (of(shape, 0.0), of(shape, 0.3), of(shape, 10.0));
            assert!(fine >= middle && middle >= far && far > 0, "{shape:?} {fine} {middle} {far}");
            assert!(far * 2 <= fine, "{shape:?}: {far} of {fine}");
        }
    }
}
