//! Frames of motorcycles and bicycles; wheels and rider are shapes of their own.

use schemas::Vec3;

use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder};
use crate::shape::walker::rod;

/// Tank, seat, engine, fork, lamps. The box reaches up to the handlebar at z = 0.1; the rider above
/// is a shape of its own.
pub(crate) fn motorcycle() -> Mesh {
    let mut builder = MeshBuilder::default();
    let at = Vec3::new;
    builder.cuboid(at(-0.06, -0.34, -0.28), at(0.34, 0.34, 0.02), Material::Paint);
    builder.cuboid(at(-0.66, -0.28, -0.26), at(-0.06, 0.28, -0.14), Material::BlackPlastic);
    builder.cuboid(at(-0.20, -0.30, -0.76), at(0.28, 0.30, -0.32), Material::Chrome);
    builder.cuboid(at(-0.84, -0.18, -0.24), at(-0.60, 0.18, -0.10), Material::Paint);
    builder.cuboid(at(-0.87, -0.16, -0.22), at(-0.83, 0.16, -0.12), Material::TailLamp);
    builder.cuboid(at(0.44, -0.24, -0.12), at(0.54, 0.24, 0.06), Material::HeadLamp);
    for side in [-0.2, 0.2] {
        rod(&mut builder, at(0.66, side, -0.68), at(0.38, side, 0.06), 0.03, Material::Chrome);
        rod(
            &mut builder,
            at(-0.62, side, -0.68),
            at(-0.10, side, -0.60),
            0.03,
            Material::BlackPlastic,
        );
    }
    rod(&mut builder, at(0.34, -0.9, 0.10), at(0.34, 0.9, 0.10), 0.025, Material::BlackPlastic);
    builder.finish()
}

/// Tubes, saddle, handlebar.
pub(crate) fn bicycle() -> Mesh {
    let mut builder = MeshBuilder::default();
    let at = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let crank = at(-0.04, -0.66);
    let (seat, head) = (at(-0.22, -0.08), at(0.42, -0.08));
    for (from, to) in [
        (crank, seat),
        (crank, head),
        (at(-0.18, -0.20), head),
        (at(-0.62, -0.62), crank),
        (at(-0.62, -0.62), seat),
        (at(0.62, -0.62), head),
        (head, at(0.40, 0.08)),
    ] {
        rod(&mut builder, from, to, 0.022, Material::Paint);
    }
    builder.cuboid(
        Vec3::new(-0.36, -0.25, -0.08),
        Vec3::new(-0.10, 0.25, -0.03),
        Material::BlackPlastic,
    );
    rod(
        &mut builder,
        Vec3::new(0.42, -0.9, 0.08),
        Vec3::new(0.42, 0.9, 0.08),
        0.02,
        Material::BlackPlastic,
    );
    builder.finish()
}
