//! A pickup of flat faces, whose roof is one edge.

use schemas::Vec3;

use super::hull::{Station, hull, lamps};
use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder};
use crate::shape::Shape;

/// Highest place of the roof: along the body, and its height.
const APEX: [f32; 2] = [0.05, 0.97];
/// Fall of the front slope per unit of length.
const FRONT_FALL: f32 = 1.12;
/// Fall of the rear slope per unit of length.
const REAR_FALL: f32 = 0.62;

/// Body and glass.
pub(crate) fn wedge() -> Mesh {
    let mut builder = MeshBuilder::default();
    let station =
        |x: f32, low_z: f32, half_width: f32| Station { x, low_z, high_z: roof_z(x), half_width };
    hull(
        &mut builder,
        &[
            station(-1.0, -0.56, 0.94),
            station(-0.97, -0.66, 0.98),
            station(-0.5, -0.70, 1.0),
            station(APEX[0], -0.70, 1.0),
            station(0.5, -0.70, 1.0),
            station(0.95, -0.66, 0.98),
            station(1.0, -0.58, 0.92),
        ],
    );
    let screen = |x: f32, y: f32| Vec3::new(x + 0.006, y, roof_z(x) + 0.012);
    builder.quad(
        [screen(0.60, -0.78), screen(0.60, 0.78), screen(0.10, 0.78), screen(0.10, -0.78)],
        Material::CarWindow,
    );
    for side in [-1.0f32, 1.0] {
        let at = |x: f32, below: f32| Vec3::new(x, side * 1.004, roof_z(x) - below);
        for window in [
            [at(-0.58, 0.28), at(-0.02, 0.48), at(-0.02, 0.14), at(-0.58, 0.14)],
            [at(0.04, 0.50), at(0.50, 0.20), at(0.50, 0.14), at(0.04, 0.14)],
        ] {
            let [a, b, c, d] = window;
            builder.quad(if side > 0.0 { [b, a, d, c] } else { window }, Material::CarWindow);
        }
    }
    lamps(&mut builder, Shape::Wedge);
    builder.finish()
}

fn roof_z(x: f32) -> f32 {
    let [apex_x, apex_z] = APEX;
    let ahead = x - apex_x;
    apex_z - if ahead > 0.0 { FRONT_FALL * ahead } else { -REAR_FALL * ahead }
}
