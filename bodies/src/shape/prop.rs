//! Shapes of things that only stand or lie.

use schemas::Vec3;

use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder, turned};

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

/// Striped planks on two feet.
pub(crate) fn barricade() -> Mesh {
    let mut builder = MeshBuilder::default();
    for side in [-1.0f32, 1.0] {
        let (inner, outer) = (side * 0.80, side * 0.90);
        let (low, high) = (inner.min(outer), inner.max(outer));
        let foot = (Vec3::new(-1.0, low, -1.0), Vec3::new(1.0, high, -0.9));
        builder.cuboid(foot.0, foot.1, Material::BlackPlastic);
        let leg = (Vec3::new(-0.1, low, -0.9), Vec3::new(0.1, high, 1.0));
        builder.cuboid(leg.0, leg.1, Material::Metal);
    }
    for (low, high) in [(-0.25, 0.2), (0.45, 0.95)] {
        for stripe in 0..8 {
            let y = -1.0 + 0.25 * stripe as f32;
            let material = if stripe % 2 == 0 { Material::Prop } else { Material::PropBand };
            builder.cuboid(Vec3::new(-0.3, y, low), Vec3::new(0.3, y + 0.25, high), material);
        }
    }
    builder.finish()
}

/// A seat with a back, looking along x.
pub(crate) fn bench() -> Mesh {
    let mut builder = MeshBuilder::default();
    for side in [-0.85f32, 0.75] {
        let leg = (Vec3::new(-0.9, side, -1.0), Vec3::new(0.9, side + 0.1, 0.0));
        builder.cuboid(leg.0, leg.1, Material::Metal);
    }
    builder.cuboid(Vec3::new(-0.9, -1.0, -0.1), Vec3::new(1.0, 1.0, 0.1), Material::Prop);
    builder.cuboid(Vec3::new(-1.0, -1.0, 0.1), Vec3::new(-0.8, 1.0, 1.0), Material::Prop);
    builder.finish()
}

/// A roof on posts with a glass wall behind, open towards x.
pub(crate) fn shelter() -> Mesh {
    let mut builder = MeshBuilder::default();
    builder.cuboid(Vec3::new(-1.0, -1.0, 0.88), Vec3::new(1.0, 1.0, 1.0), Material::Prop);
    builder.cuboid(Vec3::new(-0.96, -0.95, -0.85), Vec3::new(-0.90, 0.95, 0.8), Material::Glass);
    for (x, y) in [(-0.95, -0.95), (-0.95, 0.89), (0.85, -0.95), (0.85, 0.89)] {
        let post = (Vec3::new(x, y, -1.0), Vec3::new(x + 0.06, y + 0.06, 0.9));
        builder.cuboid(post.0, post.1, Material::Metal);
    }
    builder.cuboid(Vec3::new(-0.8, -0.7, -0.7), Vec3::new(-0.3, 0.7, -0.62), Material::Prop);
    builder.finish()
}

/// A coloured board with a light border on two feet.
pub(crate) fn placard() -> Mesh {
    let mut builder = MeshBuilder::default();
    for side in [-0.7f32, 0.6] {
        let foot = (Vec3::new(-1.0, side, -1.0), Vec3::new(1.0, side + 0.1, -0.3));
        builder.cuboid(foot.0, foot.1, Material::Metal);
    }
    builder.cuboid(Vec3::new(-0.3, -1.0, -0.35), Vec3::new(0.3, 1.0, 1.0), Material::PropBand);
    builder.cuboid(Vec3::new(-0.4, -0.86, -0.22), Vec3::new(0.4, 0.86, 0.87), Material::Prop);
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
            let [cos, sin] = turned(angle);
            Vec3::new(radius * cos, radius * sin, z)
        })
        .collect()
}
