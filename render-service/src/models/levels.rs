//! Shapes as models, each at several levels of detail.

use std::sync::LazyLock;

use bodies::{Mesh, Shape, Vertex};
use raster::{Corner, Model};
use schemas::Vec3;

use super::block::block_of;

/// Sides of the cells in which corners are drawn together, as parts of a shape's coarse cell.
const CELLS: [f32; 6] = [0.5, 1.0, 2.0, 3.5, 5.0, 8.0];
/// From this part on, and for blocks, an error counts for more, as they keep little of a shape:
/// half a pixel as 0.7.
const STRICT_FROM: f32 = 5.0;
const STRICT: f32 = 1.4;
/// A level is worth its memory if it has fewer triangles than this part of the one before.
const WORTH_IT: f32 = 0.8;

/// One shape at one level of detail.
pub(crate) struct ShapeLevel {
    pub(crate) model: Model,
    /// Place among all levels of all shapes.
    pub(crate) number: usize,
    /// How far it is off along each axis, at most, in the shape's own unit; more of strict ones.
    error: Vec3,
    /// Half of what it spans along each axis.
    half: Vec3,
}

/// Levels of every shape at the place of its number, fine ones first.
static LEVELS: LazyLock<Vec<Vec<ShapeLevel>>> = LazyLock::new(|| {
    let mut levels: Vec<_> = Shape::ALL.iter().map(|shape| levels_of(*shape)).collect();
    let all = levels.iter_mut().flatten();
    all.enumerate().for_each(|(number, level)| level.number = number);
    levels
});

/// A block for every shape at the place of its number.
static BLOCKS: LazyLock<Vec<ShapeLevel>> = LazyLock::new(|| {
    let numbers = LEVELS.iter().map(Vec::len).sum::<usize>()..;
    let blocks = Shape::ALL.iter().zip(numbers).map(|(shape, number)| {
        let (mesh, error) = block_of(&shape.mesh());
        ShapeLevel { number, ..level(&mesh, error) }
    });
    blocks.collect()
});

/// All levels of all shapes and their blocks, at the places of their numbers.
pub(crate) fn all() -> impl Iterator<Item = &'static ShapeLevel> {
    LEVELS.iter().flatten().chain(BLOCKS.iter())
}

/// Radius of a ball around a shape whose axes are stretched like this.
pub(crate) fn radius_m(shape: Shape, stretch: Vec3) -> f32 {
    let fine = LEVELS.get(shape as usize).and_then(|levels| levels.first());
    fine.map_or(0.0, |level| level.half.norm() * stretch.max())
}

/// The coarsest level of a shape whose corners are off by no more than `error_m` in the world, if
/// its axes are stretched like this; `None` if it is within a ball of `least_m`.
pub(crate) fn level_of(
    shape: Shape,
    stretch: Vec3,
    [error_m, least_m]: [f32; 2],
) -> Option<&'static ShapeLevel> {
    if radius_m(shape, stretch) < least_m {
        return None;
    }
    let levels = LEVELS.get(shape as usize)?;
    let is_good = |level: &&ShapeLevel| level.error.component_mul(&stretch).norm() <= error_m;
    levels.iter().rev().find(is_good).or_else(|| levels.first())
}

/// As [`level_of`], or a block that is off by no more: for outlines alone, as most of a shape's
/// looks are lost.
pub(crate) fn outline_of(
    shape: Shape,
    stretch: Vec3,
    [error_m, least_m]: [f32; 2],
) -> Option<&'static ShapeLevel> {
    let level = level_of(shape, stretch, [error_m, least_m])?;
    let is_good = |block: &&ShapeLevel| block.error.component_mul(&stretch).norm() <= error_m;
    let block = BLOCKS.get(shape as usize).filter(is_good);
    Some(block.unwrap_or(level))
}

/// Builds all levels now, not with the first picture.
pub(crate) fn prepare() {
    LazyLock::force(&LEVELS);
    LazyLock::force(&BLOCKS);
}

fn level(mesh: &Mesh, error: Vec3) -> ShapeLevel {
    let half = [0, 1, 2].map(|axis| span(mesh, axis) / 2.0);
    ShapeLevel { model: model_of(mesh), number: 0, error, half: half.into() }
}

fn levels_of(shape: Shape) -> Vec<ShapeLevel> {
    let fine = shape.mesh();
    let mut count = fine.indices.len();
    let mut levels = vec![level(&fine, Vec3::zeros())];
    for part in CELLS {
        let cell = part * shape.coarse_cell();
        let mesh = fine.coarse(cell);
        // A shape that has lost its height, width or length is not that shape any more.
        let is_there = (0..3).all(|axis| span(&mesh, axis) > 0.6 * span(&fine, axis));
        if is_there && (mesh.indices.len() as f32) < WORTH_IT * count as f32 {
            count = mesh.indices.len();
            let counts = if part < STRICT_FROM { 1.0 } else { STRICT };
            levels.push(level(&mesh, fine.coarse_error(cell) * counts));
        }
    }
    if is_limb(shape) {
        let (mesh, error) = block_of(&fine);
        levels.push(level(&mesh, error * STRICT));
    }
    levels
}

/// Whether a shape is a part of a person, who is told from far by colours and outline alone.
fn is_limb(shape: Shape) -> bool {
    use Shape::{Arm, Backpack, Forearm, Head, Leg, LongHair, Shin, Thigh, Torso, UpperArm};
    matches!(
        shape,
        Arm | Backpack | Forearm | Head | Leg | LongHair | Shin | Thigh | Torso | UpperArm
    )
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
            level_of(shape, Vec3::new(2.4, 1.0, 0.74), [error_m, 0.0])
                .unwrap()
                .model
                .triangle_count()
        };
        for shape in [Shape::Sedan, Shape::Bus, Shape::Torso, Shape::Leg, Shape::Wheel] {
            let (fine, middle, far) = (of(shape, 0.0), of(shape, 0.3), of(shape, 10.0));
            assert!(fine >= middle && middle >= far && far > 0, "{shape:?} {fine} {middle} {far}");
            assert!(far * 2 <= fine, "{shape:?}: {far} of {fine}");
        }
    }

    #[test]
    fn parts_of_people_far_away_are_blocks_and_near_ones_are_not() {
        for shape in Shape::ALL.into_iter().filter(|shape| is_limb(*shape)) {
            let of = |error_m: f32| {
                level_of(shape, Vec3::repeat(1.86), [error_m, 0.0]).unwrap().model.triangle_count()
            };
            // Twelve triangles, filled up.
            assert_eq!((of(0.5), of(0.01) > 16), (16, true), "{shape:?}");
        }
    }

    #[test]
    fn outlines_are_blocks_where_those_are_near_enough_and_shapes_elsewhere() {
        for shape in Shape::ALL {
            let stretch = Vec3::new(2.4, 1.0, 0.74);
            let count = |level: Option<&ShapeLevel>| level.unwrap().model.triangle_count();
            let outline = |error_m: f32| count(outline_of(shape, stretch, [error_m, 0.0]));
            let fine = count(level_of(shape, stretch, [0.0, 0.0]));
            assert!(outline(10.0) <= 16, "{shape:?}");
            assert_eq!(outline(0.0), fine, "{shape:?}");
        }
    }
}
