//! Trees: a trunk and a round crown.

use nalgebra::{Point3, Vector3};

use super::Material;
use super::building::cuboid;
use super::render::Tiles;
use crate::labels::SceneryKind;
use crate::scenery::SceneryBox;

/// Corners of an icosahedron of radius 1 about the vertical axis: top, two rings of five, bottom.
fn icosahedron() -> [Vector3<f64>; 12] {
    // The rings of a regular icosahedron lie at height ±1/√5.
    let (height, ring) = (0.2_f64.sqrt(), 0.8_f64.sqrt());
    std::array::from_fn(|corner| match corner {
        0 => Vector3::z(),
        11 => -Vector3::z(),
        _ => {
            let upper = corner <= 5;
            let fifth = if upper { corner as f64 } else { corner as f64 + 0.5 };
            let (sin, cos) = (fifth * std::f64::consts::TAU / 5.0).sin_cos();
            Vector3::new(ring * cos, ring * sin, if upper { height } else { -height })
        }
    })
}

/// Grows every tree of the scenery.
pub(super) fn grow(scenery: &[SceneryBox], tiles: &mut Tiles) {
    let corners = icosahedron();
    for (place, tree) in (0u32..).zip(scenery) {
        if tree.kind != SceneryKind::Tree {
            continue;
        }
        tiles.thing = Some(place);
        cuboid(tree, tree.half_extent_m, [Material::Trunk; 2], tiles);
        let trunk_m = 2.0 * tree.half_extent_m.z;
        // The crown hangs a little over the trunk's upper end.
        let half_height_m = (tree.height_m - trunk_m * 0.9) / 2.0;
        let foot_z = tree.pose.translation.z - tree.half_extent_m.z;
        let middle = Point3::new(
            tree.pose.translation.x,
            tree.pose.translation.y,
            foot_z + tree.height_m - half_height_m,
        );
        let radius_m = Vector3::new(tree.crown_radius_m, tree.crown_radius_m, half_height_m);
        crown(&corners, &middle, &radius_m, tiles);
    }
}

fn crown(
    corners: &[Vector3<f64>; 12],
    middle: &Point3<f64>,
    radius_m: &Vector3<f64>,
    tiles: &mut Tiles,
) {
    let mut face = |indices: [usize; 3]| {
        let normals = indices.map(|index| corners[index]);
        let places = normals.map(|normal| middle + normal.component_mul(radius_m));
        tiles.smooth(Material::Foliage, places, normals);
    };
    for k in 0..5 {
        let (upper, upper_next) = (1 + k, 1 + (k + 1) % 5);
        // Ring corner 6 + k lies half a step before upper corner 1 + (k + 1).
        let (lower, lower_next) = (6 + (k + 4) % 5, 6 + k);
        face([0, upper, upper_next]);
        face([upper, lower, lower_next]);
        face([upper, lower_next, upper_next]);
        face([11, lower_next, lower]);
    }
}
