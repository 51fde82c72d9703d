//! Shapes of things that only stand or lie.

use schemas::Vec3;

use super::material::Material;
use super::mesh::{Mesh, MeshBuilder};

/// A plain block.
pub(crate) fn block() -> Mesh {
    let mut builder = MeshBuilder::default();
    builder.cuboid(Vec3::repeat(-1.0), Vec3::repeat(1.0), Material::Prop);
    builder.finish()
}

/// A traffic cone: a plate, and a cone with two light bands.
pub(crate) fn cone() -> Mesh {
    let mut builder = MeshBuilder::default();
    builder.cuboid(Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.0, -0.92), Material::BlackPlastic);
    let radius = |z: f32| 0.78 - 0.34 * (z + 0.92);
    stack(
        &mut builder,
        &[
            (-0.92, -0.35, Material::Prop),
            (-0.35, -0.05, Material::PropBand),
            (-0.05, 0.30, Material::Prop),
            (0.30, 0.55, Material::PropBand),
            (0.55, 1.0, Material::Prop),
        ],
        radius,
    );
    builder.finish()
}

/// A barrel with a light band.
pub(crate) fn barrel() -> Mesh {
    let mut builder = MeshBuilder::default();
    let bands =
        [(-1.0, 0.1, Material::Prop), (0.1, 0.5, Material::PropBand), (0.5, 1.0, Material::Prop)];
    stack(&mut builder, &bands, |_| 1.0);
    builder.finish()
}

/// Bands of a round body around z, and a lid on top.
fn stack(builder: &mut MeshBuilder, bands: &[(f32, f32, Material)], radius: impl Fn(f32) -> f32) {
    for (low, high, material) in bands {
        builder.band(&circle(*low, radius(*low)), &circle(*high, radius(*high)), *material);
    }
    if let Some((_, top, material)) = bands.last() {
        builder.fan(&circle(*top, radius(*top)), *material);
    }
}

/// Sixteen points around z, counter-clockwise seen from above.
fn circle(z: f32, radius: f32) -> Vec<Vec3> {
    (0..16)
        .map(|at| {
            let angle = std::f32::consts::TAU * at as f32 / 16.0;
            Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
        })
        .collect()
}
